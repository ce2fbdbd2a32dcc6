"""Error bars: the arithmetic of the estimate, and that true errors lie below twice of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from finger3d import designs
from finger3d.accuracy import ORDER, Grain, coarser, estimate, main_numbers, mesh_error, step_error
from finger3d.cli import main
from finger3d.cli.press import with_error
from finger3d.contact.law import Coulomb
from finger3d.history import Frame
from finger3d.model import Gauge, Leg, Material, MeshOptions, Model
from finger3d.solve import Problem, build, march
from tests.scenes import HALF_CYLINDER, changed

FAST = {"assembly": 1.0, "contact": 0.1}
SCENE = changed(HALF_CYLINDER, domain="plane-strain")


def half_cylinder(size: float, steps: int = 10) -> Model:
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    return Model(
        design, Material(1.0, 0.45), MeshOptions(size, 5.0 * size, "swept"), (Leg(1.0, steps=steps),),
        friction=Coulomb(0.25), gauges=(Gauge("g", 1.5, 4.0, angle=0.5),), domain="plane-strain",
    )  # fmt: skip


def pressed(model: Model) -> tuple[Problem, list[Frame]]:
    problem = build(model)
    return problem, list(march(problem))


def last_of(model: Model) -> dict[str, float]:
    problem, frames = pressed(model)
    return main_numbers(problem, frames[-1])


def test_an_error_of_the_assumed_order_is_found_exactly() -> None:
    exact, scale = 7.0, 0.3
    fine, coarse = ({"normal_force_N": exact + scale * h**ORDER, "gauge_g": 0.0} for h in (1.0, 2.0))
    # the grain is so fine that its floor, 0.1 * share^2 of the force, lies far below
    found = mesh_error(fine, coarse, 2.0, (Grain(1e-3, 1e-3), Grain(2e-3, 2e-3)))
    assert found["normal_force_N"] == pytest.approx(scale, rel=1e-12)


def test_a_length_is_never_better_than_half_the_distance_of_points() -> None:
    same = {"contact_half_length_mm": 3.0}
    assert mesh_error(same, same, 2.0, (Grain(0.2, 0.1), Grain(0.4, 0.2))) == {"contact_half_length_mm": 0.1}


def test_the_true_error_of_every_number_is_below_twice_the_estimate() -> None:
    # the factor 2 is issue 8's; 90 % of all cases are judged by validation/error_bars.py, these are typical ones
    problem, frames = pressed(half_cylinder(0.2))
    found = estimate(problem, frames, FAST)
    truth = last_of(half_cylinder(0.05))
    told = main_numbers(problem, frames[-1])
    assert set(found.discretisation) == set(found.steps) == set(told)
    for name, value in told.items():
        assert abs(value - truth[name]) <= 2.0 * found.discretisation[name], name
    # and says something: a force known to 1 %, not to 100 %
    assert found.discretisation["normal_force_N"] <= 0.01 * told["normal_force_N"]


def test_the_step_error_falls_with_the_increments_and_bounds_the_true_one() -> None:
    problem, _ = pressed(half_cylinder(0.2))
    runs = {n: replace(problem, model=replace(problem.model, legs=(Leg(1.0, steps=n),))) for n in (5, 10, 20, 160)}
    told = {n: main_numbers(p, list(march(p))[-1]) for n, p in runs.items()}
    name = "friction_sum_N"
    bars = {n: step_error(runs[n], told[n])[name] for n in (5, 10, 20)}
    for n, bar in bars.items():
        assert abs(told[n][name] - told[160][name]) <= 2.0 * bar
    assert bars[20] < bars[5]


def test_few_increments_are_judged_by_more() -> None:
    # one and two give the very same here, which says nothing of what many would give
    problem, frames = pressed(half_cylinder(0.2, steps=1))
    told = main_numbers(problem, frames[-1])
    many = last_of(half_cylinder(0.2, steps=80))
    name = "friction_sum_N"
    assert 0.0 < abs(told[name] - many[name]) <= 2.0 * step_error(problem, told)[name]


def test_where_marching_is_dear_increments_are_judged_on_the_companion() -> None:
    problem, frames = pressed(half_cylinder(0.1))
    found = estimate(problem, frames, {"assembly": 9.0, "contact": 1.0})
    assert "steps: four times as many on the coarse mesh" in found.method
    assert found.steps["friction_sum_N"] > 0.0


def test_the_companion_stays_within_the_finger() -> None:
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=3.0)
    options = MeshOptions(2.0, 40.0, "ftetwild")
    model = Model(design, Material(1.0, 0.3), options, (Leg(1.0),))
    found = coarser(model).mesh
    # as wide as the finger is, and as high: the 36.6 mm of its edge are rounded, its top lies at 49.997 mm
    assert (found.size_mm, found.base_size_mm, found.mesher) == (3.0, design.height_mm, "swept")


def test_press_prints_error_bars_and_keeps_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(changed(SCENE, size_mm=0.2), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "a"), "--no-figures"]) == 0
    bars = json.loads((tmp_path / "a" / "summary.json").read_text(encoding="utf-8"))["error_estimate"]
    assert set(bars) == {"discretisation", "steps", "method", "seconds"}
    assert "gauge_g" in bars["discretisation"]
    line = next(t for t in capsys.readouterr().out.splitlines() if "normal force" in t)
    assert " +- " in line
    assert main(["press", str(scene), "--out", str(tmp_path / "b"), "--no-figures", "--no-error"]) == 0
    assert json.loads((tmp_path / "b" / "summary.json").read_text(encoding="utf-8"))["error_estimate"] is None
    assert " +- " not in capsys.readouterr().out


def test_a_mesh_too_coarse_to_judge_spoils_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(changed(SCENE, size_mm=3.0, base_size_mm=5.0), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["error_estimate"]["discretisation"] == {}
    assert summary["error_estimate"]["method"].startswith("no estimate: ")
    assert summary["outcome"] == "converged"
    assert "no estimate: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (304.4123, 0.6, "304.41 +- 0.60"),
        (304.4123, 12.3, "304 +- 12"),
        (0.0324, 0.00331, "0.0324 +- 0.0033"),
        (3.0, None, "3"),
    ],
)
def test_a_number_is_printed_to_its_bar(value: float, error: float | None, text: str) -> None:
    assert with_error(value, error, 5) == text


def test_no_companion_is_meshed_where_the_mesh_came_from_the_cache() -> None:
    # a hemisphere has no section to sweep; whether its mesh was read or made is all that counts here
    problem, frames = pressed(half_cylinder(0.4))
    ball = designs()["hemisphere"](radius_mm=7.31)
    model = replace(problem.model, design=ball, domain="solid", mesh=MeshOptions(0.731, 3.0, "ftetwild"))
    read = replace(problem, model=model, report=replace(problem.report, from_cache=True))
    found = estimate(read, frames, FAST)
    assert found.discretisation == {}
    assert found.method.startswith("no estimate: a coarser mesh is not in the cache")
    assert found.of("normal_force_N") is None
