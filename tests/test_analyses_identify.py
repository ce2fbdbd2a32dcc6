"""Identification: the measured press, its simulation and emulator, the posterior, and the result."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.identify.emulator import Emulator
from finger3d.analyses.identify.material_tests import LawInTests
from finger3d.analyses.identify.posterior import FittedValues, fitted_values, sampled
from finger3d.analyses.identify.presses import MeasuredPress, Simulation, read_measured
from finger3d.analyses.pressed_body import under
from finger3d.errors import Finger3dError, MissingError
from finger3d.materials.modulus import modulus_of_shore_00
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import table_row
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.results.journal import Journal
from finger3d.scene import parse
from tests.identify_cases import FREE, PRESS, TRUE, bench
from tests.scenes import written
from tests.sensor_cases import SCENE, scene

KNOWN = ("force_z_N", "normal_force_N", "gauge_a")


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, scene(press=PRESS).to_toml())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("normal_force_N\n1\n", "depth_mm"),
        ("depth_mm,normal_force\n1,2\n2,3\n", 'column "normal_force": .*"normal_force_N"'),
        ("depth_mm,force_N\n1,2\n2,3\n", 'column "force_N": did you mean "normal_force_N"[?]'),
        ("depth_mm,stick_ratio_area\n1,2\n2,3\n", 'column "stick_ratio_area": it is none of'),
        ("depth_mm,gauge_a,gauge_a_std\n1,2,0.1\n2,3,1e-160\n", "line 3: gauge_a_std = 1e-160: must be from 1e-12"),
        ("depth_mm,force_z_N,gauge_a_std\n1,2,3\n2,3,4\n", 'column "gauge_a_std" .*"gauge_a"'),
        ("depth_mm,gauge_a\n1,2\n3,3\n2,4\n", "line 4: depth_mm = 2: "),
        ("depth_mm,gauge_a,gauge_a_std\n1,2,0.1\n2,3,0\n", "line 3: gauge_a_std = 0: "),
        ("0.1,2\n0.2,3\n", "it has no line of names"),
        ("slide_x_mm,gauge_a\n0,2\n3,3\n2,4\n", "line 4: slide_x_mm = 2: .*time_s or step"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    with pytest.raises(Finger3dError) as found:
        read_measured(path, KNOWN)
    assert re.search(told, str(found.value))
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("text", "index", "at", "columns"),
    [
        ("step,time_s,depth_mm,gauge_a\n1,0,1,5\n2,0,2,6\n", "step", [1, 2], {"depth_mm", "gauge_a"}),
        ("time_s,depth_mm,gauge_a\n0,1,5\n0,2,6\n", "depth_mm", [1, 2], {"gauge_a"}),
        ("depth_mm,slide_x_mm,gauge_a\n3,0,5\n3,-1,6\n", "slide_x_mm", [0, -1], {"depth_mm", "gauge_a"}),
        ("slide_z_mm;gauge_a;method;outcome\n0;5;newton;converged\n1;6;;\n", "slide_z_mm", [0, 1], {"gauge_a"}),
    ],
)
def test_the_first_column_that_changes_in_one_direction_locates_the_rows(
    tmp_path: Path, text: str, index: str, at: list[float], columns: set[str]
) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    found = read_measured(path, (*KNOWN, "depth_mm"))
    assert (found.index, found.at.tolist(), set(found.columns)) == (index, at, columns)


WITH_OFFSET = (FreeKey("material.E_MPa", 0.5, 2.0), FreeKey("depth_offset_mm", -0.5, 0.5))
ROW = {
    "values": [1.25, 0.0],
    "outcome": "converged",
    "curve": {"depth_mm": [0.0, 5.0, 10.0], "normal_force_N": [0.0, 2.0, 5.0], "gauge_g36": [0.0, 0.01, 0.03]},
}


def simulation(path: Path, *rows: dict) -> Simulation:
    """A simulation whose solutions are known: nothing is pressed."""
    return Simulation(SCENE, None, WITH_OFFSET, Journal(path / "presses.jsonl", list(rows)))


def measured(at: list[float], path: str = "bench.csv") -> MeasuredPress:
    columns = {name: np.zeros(len(at)) for name in ("normal_force_N", "gauge_g36")}
    return MeasuredPress(Path(path), "depth_mm", np.array(at), columns, {}, tuple(range(2, 2 + len(at))))


def test_forces_scale_with_the_modulus_and_strains_do_not(tmp_path: Path) -> None:
    known = simulation(tmp_path, ROW)
    found = known.curve([2.5, 0.3])
    assert [*found["normal_force_N"]] == [0.0, 4.0, 10.0]
    assert [*found["gauge_g36"]] == [0.0, 0.01, 0.03]
    assert known.solved == 1


def test_the_offset_is_added_to_the_measured_depth(tmp_path: Path) -> None:
    known = simulation(tmp_path, ROW)
    found = known.at([1.25, 0.5], measured([4.5, 9.5]))
    assert [*found["normal_force_N"]] == pytest.approx([2.0, 5.0])
    with pytest.raises(Finger3dError, match=r"line 2: depth_mm = 10: with .* 10\.5, .* ends at 10; .* up to 0 only"):
        known.at([1.25, 0.5], measured([10.0]))


def test_a_press_that_failed_is_not_tried_again(tmp_path: Path) -> None:
    known = simulation(tmp_path, {"values": [1.25, 0.0], "outcome": "too deep", "curve": {}})
    with pytest.raises(Finger3dError, match=r"material\.E_MPa = 1\.25.*too deep"):
        known.curve([0.7, 0.1])


def test_increments_end_at_the_measured_rows(tmp_path: Path) -> None:
    """Between its four increments of 2.5 mm the press of the scene has no numbers at these depths."""
    rows, free = measured([1.3, 6.1]), (FreeKey("friction.mu", 0.1, 0.7),)
    found = Simulation(SCENE, None, free, Journal(tmp_path / "presses.jsonl", []), measured=rows).at([0.4], rows)
    body = build(scene(friction={"mu": 0.4}).model())
    legs = (Leg(1.3, steps=1), Leg(6.1, steps=2))  # no longer than 2.5 mm
    for number in range(2):
        *_, last = march(under(body, legs=legs[: number + 1]))
        numbers = table_row(body.points, last)
        for name in rows.columns:
            assert found[name][number] == pytest.approx(numbers[name], rel=1e-9)


SPACE = (
    FreeKey("friction.mu", 0.02, 1.0),
    FreeKey("material.nu", 0.3, 0.49),
    FreeKey("material.E_MPa", 0.5, 2.0),
    FreeKey("depth_offset_mm", -0.5, 0.5),
)
DEPTHS = np.array([2.0, 4.0, 6.0])


def curve(mu: float, nu: float) -> dict[str, Any]:
    """A force that stiffens with nu, and a strain that ceases to depend on mu."""
    depth = np.linspace(0.0, 7.0, 29)
    stiffness = (1.0 - nu) / (1.0 + nu) / (1.0 - 2.0 * nu)
    return {"depth_mm": depth, "normal_force_N": stiffness * depth**1.5, "gauge_a": 1e-3 * depth * np.tanh(4.0 * mu)}


def emulator(tmp_path: Path, free: tuple[FreeKey, ...] = SPACE, fails: Callable[..., bool] | None = None) -> Emulator:
    columns = {name: curve(0.3, 0.4)[name][[8, 16, 24]] for name in ("normal_force_N", "gauge_a")}
    data = MeasuredPress(tmp_path / "bench.csv", "depth_mm", DEPTHS, columns, {}, (2, 3, 4))

    class Known(Simulation):
        def _solve(self, point: tuple[float, ...]) -> dict[str, Any]:
            if fails and fails(*point[:2]):
                return {"values": list(point), "outcome": "it slips", "curve": {}}
            found = {name: v.tolist() for name, v in curve(*point[:2]).items()}
            return {"values": list(point), "outcome": "converged", "curve": found}

    known = Known(SCENE, None, free, Journal(tmp_path / "presses.jsonl", []))
    return Emulator(known, data, LawInTests(SCENE, scene(), free, {}))


def test_numbers_between_presses_converge_to_those_of_presses(tmp_path: Path) -> None:
    """Modulus, friction, Poisson's ratio and offset at once: presses nearby leave a tenth of the design's error."""
    found = emulator(tmp_path)
    for shares in found.design():
        found.press(shares)
    wanted = np.array([0.6, 0.8, 0.7, 0.3])
    true = found.simulation.at([s.value(x) for s, x in zip(found.free, wanted, strict=True)], found.data)
    errors = []
    for near in (0.0, 0.05):
        if near:
            for shift in near * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]):
                found.press(wanted + [*shift, 0.0, 0.0])
        error = [np.abs(found.columns(wanted)[name] - values).max() / values.max() for name, values in true.items()]
        errors.append(max(error))
    assert errors[1] < 0.1 * errors[0]


def test_shares_whose_nearest_press_failed_count_as_failing(tmp_path: Path) -> None:
    found = emulator(tmp_path, fails=lambda mu, nu: nu > 0.45)
    for shares in found.design():
        found.press(shares)
    found.check()
    assert found.fails(np.array([[0.5, 0.9, 0.5, 0.5], [0.5, 0.2, 0.5, 0.5]])).tolist() == [True, False]
    none = emulator(tmp_path, fails=lambda mu, nu: mu < 2.0)
    for shares in none.design():
        none.press(shares)
    with pytest.raises(MissingError, match="it slips"):
        none.check()
    assert issubclass(MissingError, Finger3dError)


SCALES = [FreeKey("friction.mu", 0.0, 1.0), FreeKey("material.E_MPa", 0.0, 2.0)]
COUNT = 4096
"""Samples; the error of a standard deviation is about 1 / sqrt(2 n) = 0.011 of it."""


def fitted(response: Callable[[Any], Any], shares: Any, noise: float = 0.01, scales: Any = SCALES) -> FittedValues:
    """Values at shares (k,), from readings (s, n) of a response to shares (s, k), with independent noise."""
    data = response(np.array([shares]))

    def residuals(at: Any) -> Any:
        return (response(at) - data) / noise

    samples = sampled(lambda at: -0.5 * np.sum(residuals(at) ** 2, axis=1), len(shares), COUNT)
    steps = 1e-6 * np.eye(len(shares))
    slope = (residuals(shares + steps) - residuals(shares - steps)).T / 2e-6
    return fitted_values(scales, np.array(shares), samples, slope, np.zeros((len(slope), len(slope))))


def linear(matrix: Any) -> Callable[[Any], Any]:
    return lambda shares: shares @ np.transpose(matrix)


def test_a_straight_response_has_a_normal_distribution() -> None:
    matrix = np.array([[1.0, 0.3], [0.2, 1.0], [0.5, 0.5]])
    found = fitted(linear(matrix), [0.4, 0.5])
    covariance = 1e-4 * np.linalg.inv(matrix.T @ matrix)
    sd = np.sqrt(np.diag(covariance))
    assert found.stds == pytest.approx(sd * [1.0, 2.0], rel=0.05)
    assert found.low == pytest.approx([0.4 - sd[0], 1.0 - 2.0 * sd[1]], abs=1e-3)
    assert found.correlation[0, 1] == pytest.approx(covariance[0, 1] / sd[0] / sd[1], abs=0.05)
    assert found.untold == ()


def test_an_interval_is_one_deviation_of_the_share_to_both_sides() -> None:
    """On a logarithmic scale it is longer above the value than below, and it ends at the bounds."""
    scales = [FreeKey("a", 1.0, 100.0), FreeKey("b", 0.0, 1.0)]
    assert scales[0].is_logarithmic
    assert scales[0].share(scales[0].value(0.3)) == pytest.approx(0.3)
    found = fitted(linear(np.eye(2)), [0.5, 1.0], 0.05, scales)
    assert found.low[0] == pytest.approx(10.0 * 100.0**-0.05, rel=0.02)  # 1/12 of a deviation
    assert found.high == pytest.approx([10.0 * 100.0**0.05, 1.0], rel=0.02)
    # of the half of a normal distribution below the bound, 84 % are within 1.41 deviations
    assert found.low[1] == pytest.approx(1.0 - 1.41 * 0.05, abs=4e-3)
    assert "b is at its upper bound: widen it" in found.untold


def test_the_part_of_the_errors_of_the_simulation() -> None:
    """An error of 3 deviations in the only reading of the first value, none in that of the second."""
    scales, root = [FreeKey("a", 0.0, 1.0), FreeKey("b", 0.0, 2.0)], math.sqrt(10.0)
    slope = np.diag([1e3 / root, 1e3])
    samples = sampled(lambda at: -0.5 * np.sum(((at - 0.5) @ slope) ** 2, axis=1), 2, COUNT)
    found = fitted_values(scales, np.array([0.5, 0.5]), samples, slope, np.diag([0.9, 0.0]))
    assert found.numerical == pytest.approx([3e-3, 0.0], rel=0.05)
    assert found.stds == pytest.approx([math.hypot(1e-3, 3e-3), 2e-3], rel=0.05)


def test_where_friction_ceases_to_change_a_reading_the_interval_reaches_the_bound() -> None:
    """Beyond mu = 0.3 all sticks: a fit that ends there has an equal likelihood up to the bound."""
    found = fitted(lambda at: np.stack([np.minimum(at[:, 0], 0.3), at[:, 1], 0.0 * at[:, 0]], axis=1), [0.35, 0.5])
    # a uniform distribution from 0.3 to 1 has 84 % below 0.89, and a root mean square distance of 0.36 from 0.35
    assert found.low[0] == pytest.approx(0.35)
    assert found.high[0] == pytest.approx(0.89, abs=0.02)
    assert found.stds[0] == pytest.approx(0.36, abs=0.02)
    assert "the data do not bound friction.mu from above" in found.untold


def test_two_maxima_are_told_and_the_deviation_of_all_values_spans_them() -> None:
    """The first reading has the same value at mu and 0.9 - mu; the modulus that goes with it differs."""
    found = fitted(lambda at: np.stack([(at[:, 0] - 0.45) ** 2, at[:, 1] + 0.2 * at[:, 0]], axis=1), [0.2, 0.5], 0.003)
    assert found.stds[0] == pytest.approx(0.5 / math.sqrt(2.0), rel=0.1)
    assert found.stds[1] == pytest.approx(2.0 * 0.2 * 0.5 / math.sqrt(2.0), rel=0.1)
    assert any("fit about as well" in note for note in found.untold)


def noise_sds(fitted: FittedValues) -> np.ndarray:
    """Standard deviations without the part of mesh and increments."""
    return np.sqrt(fitted.stds**2 - fitted.numerical**2)


def test_known_values_are_found_again(tmp_path: Path, scene_file: Path) -> None:
    found = finger3d.identify(scene_file, bench(tmp_path / "bench.csv"), FREE, tmp_path / "out")
    for value, std, true in zip(found.fitted.values, found.fitted.stds, TRUE.values(), strict=True):
        assert value == pytest.approx(true, abs=4.0 * std)
    for sd, true in zip(noise_sds(found.fitted), TRUE.values(), strict=True):
        assert sd < 0.15 * true
    assert (found.fitted.numerical > 0.0).all()
    assert found.notes == ()
    data = json.loads((tmp_path / "out" / "identify.json").read_text())
    assert data["values"]["friction.mu"]["value"] == found.fitted.values[1]
    again = finger3d.load(tmp_path / "out" / "identified.toml")
    assert again.model().material.E_MPa == pytest.approx(found.fitted.values[0])
    assert {"identify.png", "identify.csv", "report.html", "presses.jsonl"} <= {
        p.name for p in (tmp_path / "out").iterdir()
    }


def test_errors_of_the_mesh_do_not_depend_on_the_bounds_of_the_modulus(tmp_path: Path, scene_file: Path) -> None:
    measured, found = bench(tmp_path / "bench.csv", stds=True), []
    for number, bounds in enumerate(((0.05, 5.0), (0.3, 0.5))):
        free = FREE | {"material.E_MPa": bounds}
        found.append(finger3d.identify(scene_file, measured, free, tmp_path / f"out{number}").fitted.numerical)
    # a deviation from 2048 samples is known to 2 %, and presses are at other places in either case
    assert found[1] == pytest.approx(found[0], rel=0.15)


@pytest.mark.slow
def test_intervals_hold_over_many_benches(tmp_path: Path, scene_file: Path) -> None:
    inside = []
    for seed in range(30):
        measured = bench(tmp_path / f"bench{seed}.csv", seed, stds=True)
        fitted = finger3d.identify(scene_file, measured, FREE, tmp_path / f"out{seed}").fitted
        errors = np.abs(fitted.values - list(TRUE.values()))
        inside += list(errors <= noise_sds(fitted))  # the benches have the mesh of the scene
    # a share of 60 has a standard deviation of 0.06
    assert np.mean(inside) == pytest.approx(0.683, abs=0.15)


def test_a_hardness_is_fitted_by_the_modulus_that_it_gives(tmp_path: Path, scene_file: Path) -> None:
    """Forces scale with the modulus of the hardness, so that one press is enough."""
    measured, fitted = bench(tmp_path / "bench.csv"), {}
    for key, bounds in {"material.E_MPa": (0.05, 5.0), "material.shore_00": (5.0, 90.0)}.items():
        options = ["friction.mu=0.2", "material.nu=0.45"]
        found = finger3d.identify(scene_file, measured, {key: bounds}, tmp_path / key, options)
        assert found.presses == 1
        fitted[key] = float(found.fitted.values[0])
    assert modulus_of_shore_00(fitted["material.shore_00"]) == pytest.approx(fitted["material.E_MPa"], rel=5e-3)


def test_an_offset_of_the_depth_is_found(tmp_path: Path, scene_file: Path) -> None:
    measured = bench(tmp_path / "bench.csv", offset=0.3)
    free = {"material.E_MPa": (0.05, 5.0), "depth_offset_mm": (-1.0, 0.0)}
    found = finger3d.identify(scene_file, measured, free, tmp_path / "out", ["friction.mu=0.2", "press.depth_mm=10.5"])
    assert found.fitted.values[1] == pytest.approx(-0.3, abs=0.05)


def test_the_depth_is_fitted_under_a_prescribed_force(tmp_path: Path, scene_file: Path) -> None:
    force = {"press": {"force_N": 60.0, "steps": 5}}
    true = parse(scene(**force, material={"nu": 0.45, "E_MPa": 0.8}).as_dict() | {"press": force["press"]})
    rows = [f"{i},{step.depth_mm!r}" for i, step in enumerate(finger3d.press(true).steps, start=1)]
    measured = tmp_path / "bench.csv"
    measured.write_text("step,depth_mm\n" + "\n".join(rows) + "\n")
    scene_file.write_text(parse(scene(**force).as_dict() | {"press": force["press"]}).to_toml(defaults=False))
    found = finger3d.identify(scene_file, measured, {"material.E_MPa": (0.3, 2.0)}, tmp_path / "out")
    assert found.presses > 3  # under a force everything depends on the modulus
    assert found.fitted.values[0] == pytest.approx(0.8, rel=5e-3)


def test_the_curves_of_a_press_that_slides_give_its_friction_back(tmp_path: Path) -> None:
    legs = [{"depth_mm": 3.0, "steps": 2}, {"depth_mm": 3.0, "slide_x_mm": -2.0, "steps": 4}]
    path = written(tmp_path, scene(press={"leg": legs}, friction={"mu": 0.3}).to_toml())
    history = finger3d.press(path).to_dataframe()
    for name, index, rows in (
        ("all", "step", history),
        ("slide", "slide_x_mm", history[["slide_x_mm", "normal_force_N", "tangential_force_x_N"]][2:]),
    ):
        rows.to_csv(tmp_path / f"{name}.csv", index=False)
        found = finger3d.identify(path, tmp_path / f"{name}.csv", {"friction.mu": (0.1, 1.0)}, tmp_path / name)
        assert found.measured.index == index
        assert found.fitted.values[0] == pytest.approx(0.3, abs=1e-3)  # ten times the convergence of the fit
    (tmp_path / "far.csv").write_text("slide_x_mm,normal_force_N\n-1,5\n-3,5\n")
    with pytest.raises(Finger3dError, match="line 3: slide_x_mm = -3: the path of the scene ends at -2"):
        finger3d.identify(path, tmp_path / "far.csv", {"friction.mu": (0.1, 1.0)}, tmp_path / "far")


def test_the_history_of_a_press_gives_its_modulus_back(tmp_path: Path, scene_file: Path) -> None:
    history = finger3d.press(scene_file).to_dataframe()
    history["force_x_N"] += [1e-16, -1e-16] * 4  # of a symmetrical press, which other sums have as round-off
    history.to_csv(tmp_path / "history.csv", index=False)
    found = finger3d.identify(scene_file, tmp_path / "history.csv", {"material.E_MPa": (0.1, 5.0)}, tmp_path / "out")
    assert found.measured.index == "step"
    assert found.fitted.values[0] == pytest.approx(1.0, rel=1e-6)


def test_what_the_data_cannot_tell_is_said(tmp_path: Path, scene_file: Path) -> None:
    """A force at one small depth tells E nu together, and nothing of friction."""
    rows = list(csv.DictReader(bench(tmp_path / "all.csv").open()))
    measured = tmp_path / "bench.csv"
    lines = [f"{r['depth_mm']},{r['normal_force_N']},1.0" for r in rows]
    measured.write_text("depth_mm,normal_force_N,normal_force_N_std\n" + "\n".join(lines) + "\n")
    free = {"material.E_MPa": (0.05, 5.0), "friction.mu": (0.5, 0.7)}
    found = finger3d.identify(scene_file, measured, free, tmp_path / "out")
    assert any("friction.mu" in note for note in found.notes)


def test_a_scene_that_does_not_fit_is_said(tmp_path: Path, scene_file: Path) -> None:
    measured = bench(tmp_path / "bench.csv", stds=True)
    found = finger3d.identify(
        scene_file, measured, {"material.E_MPa": (0.05, 5.0)}, tmp_path / "out", ["friction.mu=0.05"]
    )
    assert found.reduced_chi_square > 10.0
    assert any(f" {found.reduced_chi_square**0.5:.2g} " in note for note in found.notes)


def test_an_interrupted_identification_continues(tmp_path: Path, scene_file: Path, monkeypatch: Any) -> None:
    measured, out = bench(tmp_path / "bench.csv"), tmp_path / "out"
    whole, count = Journal.append, 0

    def some(journal: Journal, row: Any) -> None:
        nonlocal count
        count += 1
        if count > 5:
            raise KeyboardInterrupt
        whole(journal, row)

    monkeypatch.setattr(Journal, "append", some)
    with pytest.raises(KeyboardInterrupt):
        finger3d.identify(scene_file, measured, FREE, out)
    assert len((out / "presses.jsonl").read_text().splitlines()) == 5
    monkeypatch.setattr(Journal, "append", whole)
    solved: list[Any] = []
    monkeypatch.setattr(Journal, "append", lambda journal, row: (solved.append(row), whole(journal, row))[1])
    found = finger3d.identify(scene_file, measured, FREE, out)
    assert len(solved) == found.presses - 5
    again = finger3d.identify(scene_file, measured, FREE, out)
    assert len(solved) == again.presses - 5
    assert again.fitted.values == pytest.approx(found.fitted.values, rel=1e-12)
