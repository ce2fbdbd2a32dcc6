"""Files of a press, and what an interruption leaves of them."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from finger3d.cli import main
from tests.scenes import HALF_CYLINDER, changed, solid, written

SECTION = changed(HALF_CYLINDER, steps=5, size_mm=0.2)
SOLID = solid(SECTION, 0.4)
STEP_KEYS = set(
    """depth_mm slide_x_mm slide_z_mm time_s normal_force_N tangential_force_x_N tangential_force_z_N friction_sum_N
    outward_friction_x_N outward_friction_z_N contact_area_mm2 stick_area_mm2 contact_half_length_mm
    stick_half_length_mm largest_penetration_mm force_x_N force_y_N force_z_N moment_x_Nmm moment_y_Nmm moment_z_Nmm
    turn_x_deg turn_y_deg turn_z_deg external_work_mJ dissipation_mJ gauges iterations residual outcome""".split()
)
CONTACT_COLUMNS = (
    "face x_mm y_mm z_mm area_mm2 normal_x normal_y normal_z pressure_MPa shear_x_MPa shear_y_MPa shear_z_MPa gap_mm "
    "slip_x_mm slip_y_mm slip_z_mm status".split()
)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("text", [SECTION, SOLID], ids=["section", "solid"])
def test_press_writes_what_the_contract_names(tmp_path: Path, text: str) -> None:
    out = tmp_path / "results with spaces, ü"
    assert main(["press", str(written(tmp_path, text)), "--out", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert set(summary) >= {"scene", "effects", "outcome", "steps", "mesh", "cost", "versions"}
    assert summary["outcome"] == "converged"
    assert summary["effects"] == []
    assert summary["scene"]["contact"]["rule"] == "projection"  # defaults are filled in
    assert len(summary["steps"]) == 5
    for step in summary["steps"]:
        assert set(step) >= STEP_KEYS
        assert ("contact_half_length_end_mm" in step) == (text is SOLID)
        assert step["outcome"] == "converged"
        assert step["residual"] <= 1e-8
    assert summary["cost"]["factorizations"] == 1
    assert set(summary["cost"]["seconds"]) >= {"cad", "mesh", "assembly", "condensation", "contact", "output", "total"}
    assert set(summary["mesh"]) >= {"points", "cells", "dofs", "contact_points", "min_dihedral_deg", "volume_mm3",
                                    "cad_volume_mm3", "hash", "from_cache"}  # fmt: skip
    assert {"finger3d", "numpy", "scipy"} <= set(summary["versions"])
    points = table(out / "contact.csv")
    assert list(points[0]) == CONTACT_COLUMNS
    force = sum(float(p["pressure_MPa"]) * float(p["area_mm2"]) for p in points)
    assert force == pytest.approx(summary["steps"][-1]["normal_force_N"], rel=1e-12)
    assert {p["status"] for p in points} <= {"open", "stick", "slip"}
    history = table(out / "history.csv")
    assert [float(h["normal_force_N"]) for h in history] == [s["normal_force_N"] for s in summary["steps"]]
    assert float(history[-1]["gauge_g"]) == summary["steps"][-1]["gauges"]["g"]
    assert all((out / name).stat().st_size > 10_000 for name in ("finger.png", "contact.png", "force.png"))
    # the scene as run gives the same run
    again = tmp_path / "again"
    assert main(["press", str(out / "scene.toml"), "--out", str(again), "--no-figures"]) == 0
    repeated = json.loads((again / "summary.json").read_text(encoding="utf-8"))
    assert repeated["steps"][-1]["normal_force_N"] == pytest.approx(summary["steps"][-1]["normal_force_N"], rel=1e-12)


def test_fields_open_in_pyvista_and_agree_with_the_contact_table(tmp_path: Path) -> None:
    import numpy as np
    import pyvista
    from scipy.spatial import KDTree

    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, SOLID)), "--out", str(out), "--no-figures"]) == 0
    grid = pyvista.read(out / "fields.vtu")
    assert set(grid.point_data) >= {"displacement", "strain", "stress", "pressure", "shear_x", "shear_z", "status"}
    assert grid["strain"].shape == grid["stress"].shape == (grid.n_points, 6)
    points = table(out / "contact.csv")
    pressure = np.array([float(p["pressure_MPa"]) for p in points])
    where = [grid.find_closest_point([float(p[f"{axis}_mm"]) for axis in "xyz"]) for p in points]
    assert np.allclose(grid["pressure"][where], pressure, rtol=1e-6)
    # between them, at the middles of edges, no spots: as many again and more carry what their ends do
    assert np.count_nonzero(grid["pressure"]) > 2 * np.count_nonzero(pressure)
    assert grid["pressure"].max() <= 1.000001 * pressure.max()
    held = grid.points[:, 1] == 0.0
    assert not grid["displacement"][held].any()
    # the whole finger is mirrored from a quarter: the component normal to the mirror plane is odd, the others are even
    for axis in (0, 2):
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        apart, image = KDTree(grid.points).query(grid.points * sign)
        assert apart.max() < 1e-6
        assert np.allclose(grid["displacement"][image], grid["displacement"] * sign, rtol=0.0, atol=1e-12)
    assert np.allclose(grid.bounds[0:2], [-5.0, 5.0], atol=1e-6)
    # pressed by 0.5 mm: no vertex above the plane; mid-edge nodes by no more than the sagitta h^2 / 8 R, twice
    assert (grid.points + grid["displacement"])[:, 1].max() <= 4.5 + 2 * 0.4**2 / (8 * 5.0)


def test_interruption_keeps_every_finished_step(tmp_path: Path) -> None:
    scene = written(tmp_path, changed(SECTION, steps=10000))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "finger3d", "press", str(scene), "--out", str(out)]
    # its lines go nowhere: a pipe that nobody reads is full after some 750 of them, and stops it
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        history = out / "history.csv"
        deadline = time.monotonic() + 60
        while not (history.exists() and len(table(history)) >= 3):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        os.kill(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.count("\n") == 1
    assert "Traceback" not in err
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"].startswith("incomplete")
    assert len(summary["steps"]) == len(table(out / "history.csv")) >= 3
    assert all(s["outcome"] == "converged" for s in summary["steps"])


def test_a_new_run_leaves_no_number_of_an_old_one(tmp_path: Path) -> None:
    out = tmp_path / "out"
    scene = written(tmp_path, SECTION)
    assert main(["press", str(scene), "--out", str(out)]) == 0
    assert main(["press", str(scene), "--out", str(out), "--no-figures", "--set", "press.steps=2"]) == 0
    assert not (out / "finger.png").exists()
    assert len(table(out / "history.csv")) == 2


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != ".finger3d.lock"}


def test_a_press_that_writes_nothing_removes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = written(tmp_path, HALF_CYLINDER), tmp_path / "out"
    words = ["press", str(scene), "--out", str(out), "--no-error"]
    assert main(words) == 0
    before = contents(out)
    assert {"summary.json", "report.html", "fields.vtu"} <= set(before)
    capsys.readouterr()
    assert main([*words, "--set", "press.depth_mm=1e-6"]) == 3  # less than the mesh resolves
    assert contents(out) == before
    # a press of one step takes their place, and leaves none of the pictures that it does not draw
    assert main([*words, "--set", "press.steps=1", "--no-figures"]) == 0
    after = contents(out)
    assert "report.html" not in after
    assert "finger.png" not in after
    assert len(json.loads(after["summary.json"])["steps"]) == 1


def test_an_interrupted_press_counts_no_step_of_an_earlier_one(tmp_path, monkeypatch, capsys) -> None:
    scene, out = written(tmp_path, HALF_CYLINDER), tmp_path / "out"
    words = ["press", str(scene), "--out", str(out), "--no-error", "--no-figures"]
    assert main(words) == 0
    before = contents(out)

    def interrupted(*arguments: object, **settings: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("finger3d.mechanics.march.solve.march", interrupted)
    capsys.readouterr()
    assert main(words) == 130
    assert "no increment was finished" in capsys.readouterr().err
    assert contents(out) == before


@pytest.mark.parametrize("name", ["report.html", "scene.toml", "contact.csv"])
def test_a_file_that_no_press_has_written_is_not_replaced(name: str, tmp_path: Path, capsys) -> None:
    scene, out = written(tmp_path, HALF_CYLINDER), tmp_path / "out"
    out.mkdir()
    (out / name).write_text("mine", encoding="utf-8")
    assert main(["press", str(scene), "--out", str(out), "--no-error"]) == 2
    assert name in capsys.readouterr().err.splitlines()[-1]
    assert contents(out) == {name: b"mine"}
