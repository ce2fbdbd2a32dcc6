"""Identification: values that are known are found again, with deviations that hold; bad files are refused by line."""

from __future__ import annotations

import csv
import errno
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.analyses.identify.posterior import FittedValues
from finger3d.analyses.pressed_body import PressedBody
from finger3d.errors import Finger3dError, MissingError
from finger3d.materials.modulus import modulus_of_shore_00
from finger3d.results.journal import Journal
from finger3d.scene import parse
from tests.identify_cases import FREE, PRESS, TRUE, bench
from tests.scenes import written
from tests.sensor_cases import scene


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, scene(press=PRESS).to_toml())


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


def test_the_modulus_alone_needs_one_press(tmp_path: Path, scene_file: Path) -> None:
    measured = bench(tmp_path / "bench.csv")
    found = finger3d.identify(
        scene_file, measured, {"material.E_MPa": (0.05, 5.0)}, tmp_path / "out", ["friction.mu=0.2"]
    )
    assert found.presses == 1
    assert found.fitted.values[0] == pytest.approx(0.37, abs=4.0 * found.fitted.stds[0])


def test_presses_are_few_and_share_bodies(tmp_path: Path, scene_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four points with noise, three unknowns: nine presses of the design, and those that the emulator asks for."""
    counted = {"bodies": 0, "presses": 0}
    built, pressed = PressedBody._built, PressedBody.steps

    def count(name: str, function: Any) -> Any:
        def counting(*args: Any, **kwargs: Any) -> Any:
            counted[name] += 1
            return function(*args, **kwargs)

        return counting

    monkeypatch.setattr(PressedBody, "_built", count("bodies", built))
    monkeypatch.setattr(PressedBody, "steps", count("presses", pressed))
    measured = bench(tmp_path / "bench.csv", stds=True)
    lines = measured.read_text().splitlines()
    measured.write_text("\n".join([lines[0], *lines[2::2]]) + "\n")
    found = finger3d.identify(scene_file, measured, FREE | {"material.nu": (0.3, 0.495)}, tmp_path / "out")
    assert found.measured.count == 2 * 4
    assert found.presses == counted["presses"] <= 25
    assert counted["bodies"] <= 16  # of one body all friction that is tried at first
    for value, std, true in zip(found.fitted.values, found.fitted.stds, [*TRUE.values(), 0.45], strict=True):
        assert value == pytest.approx(true, abs=4.0 * std)


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


def test_a_full_disk_keeps_the_values_that_were_found(tmp_path: Path, scene_file: Path, monkeypatch: Any) -> None:
    def full(source: Any, target: Any) -> None:
        if str(target).endswith(".png"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(source, target)

    replace, out = os.replace, tmp_path / "out"
    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(MissingError, match=r"identify.png: No space left on device; make room"):
        finger3d.identify(scene_file, bench(tmp_path / "bench.csv"), FREE, out)
    assert (out / "identify.json").stat().st_size > 100
    assert (out / "identify.csv").stat().st_size > 100


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
