"""Presses: their record, their files, and fingers from files."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from finger3d.cli import main
from finger3d.geometry.imported import imported
from finger3d.scene import load
from tests.bodies import step_of
from tests.scenes import BLOCK, HALF_CYLINDER, changed, solid, written

SECTION = changed(HALF_CYLINDER, steps=5, size_mm=0.2)

BAR = ["--set", "object.shape=cylinder", "--set", "object.radius_mm=20.0"]
"""Under a bar the increments of a section leave an error."""


def test_steps_auto_reports_its_estimate(tmp_path: Path) -> None:
    out = tmp_path / "out"
    scene = written(tmp_path, changed(SECTION, steps="auto"))
    assert main(["press", str(scene), "--out", str(out), "--no-figures", *BAR]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    estimate = summary["step_estimate"]
    assert estimate["met"]
    assert len(summary["steps"]) == estimate["steps"] >= 20
    assert max(estimate[k] for k in ("normal_force", "friction_sum", "gauges")) <= estimate["tolerance"] == 0.01
    assert estimate["dissipation"] <= estimate["dissipation_tolerance"] == 0.05
    # the runs that chose them are the error bar, no other is made; earlier runs count, too
    bars, of_last_two = summary["error_estimate"]["steps"], estimate["friction_sum"]
    least = of_last_two * summary["steps"][-1]["friction_sum_N"]
    assert least * (1.0 - 1e-9) <= bars["friction_sum_N"] < 10.0 * least
    assert {"external_work_mJ", "dissipation_mJ"} <= set(bars)


def test_the_papers_rule_takes_a_fixed_number_of_increments(tmp_path: Path) -> None:
    scene = written(tmp_path, changed(SECTION, steps="auto"))
    keys = ["--set", "contact.rule=paper", "--set", "friction.mu=0.05", "--no-figures", "--no-error"]
    main(["press", str(scene), "--out", str(tmp_path / "out"), *keys])
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["step_estimate"] is None
    assert len(summary["steps"]) == 10


def test_effects_and_warnings_are_told(tmp_path: Path) -> None:
    text = SECTION + '[effects.kinetic_friction]\nratio = 0.5\nbranch = "paper"\n'
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, text)), "--out", str(out), "--no-figures"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["effects"] == ["kinetic_friction"]
    assert any("stuck" in w for w in summary["warnings"])


def test_uniqueness_is_reported_and_warned_of(tmp_path: Path) -> None:
    found = {}
    for mu in ("0.25", "1000.0"):
        out = tmp_path / mu
        main(
            ["press", str(written(tmp_path, SECTION)), "--out", str(out), "--no-figures", "--set", f"friction.mu={mu}"]
        )
        found[mu] = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    ratio = found["1000.0"]["uniqueness"]["largest_coupling"] / found["0.25"]["uniqueness"]["largest_coupling"]
    assert ratio == pytest.approx(4000.0, rel=1e-9)
    assert not found["0.25"]["warnings"]
    assert any("states" in w for w in found["1000.0"]["warnings"])


@pytest.mark.parametrize(
    ("key", "where", "text"),
    [("press.depth_mm=3.0", "advice", "large deformation would change"), ("mesh.size_mm=0.9", "warnings", "touch")],
)
def test_a_scene_beyond_what_can_be_trusted_is_told(tmp_path: Path, key: str, where: str, text: str) -> None:
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, SECTION)), "--out", str(out), "--no-figures", "--set", key]) == 0
    assert any(text in line for line in json.loads((out / "summary.json").read_text(encoding="utf-8"))[where])


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_an_object_narrower_than_two_edges_is_warned_of_with_an_edge_length_that_resolves_it(
    tmp_path: Path, domain: str
) -> None:
    trimesh.creation.box((1.7, 3.0, 40.0)).export(tmp_path / "bar.stl")
    text = (
        changed(BLOCK, domain=domain, half_length_mm=4.0, width_mm=2.0) + '[object]\nshape = "mesh"\npath = "bar.stl"\n'
    )
    scene = written(tmp_path, text)

    def said(size: str) -> list[str]:
        command = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
        assert main([*command, "--set", "mesh.mesher=swept", "--set", f"mesh.size_mm={size}"]) == 0
        summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
        return [line for line in summary["warnings"] if " touch" in line]

    (line,) = said("1.0")
    assert not said(re.findall(r"mesh\.size_mm = ([\d.]+) has enough", line)[0])


def test_a_light_press_by_default_has_enough_points(tmp_path: Path) -> None:
    text = re.sub(r"\[mesh\][^[]*", "", changed(HALF_CYLINDER, steps=2, depth_mm=0.01))
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, text)), "--out", str(out), "--no-figures", "--no-error"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert not [line for line in summary["warnings"] if " touch" in line]


def test_a_deep_press_is_advised_of_large_deformation_unless_it_has_it(tmp_path: Path) -> None:
    settings = {"small": [], "large": ["--set", "effects.large_deformation={}"]}
    said = {}
    for name, more in settings.items():
        command = ["press", str(written(tmp_path, changed(SECTION, depth_mm=1.6))), "--out", str(tmp_path / name)]
        assert main([*command, "--no-figures", "--no-error", *more]) == 0
        advice = json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))["advice"]
        said[name] = [line for line in advice if "switch on [effects.large_deformation]" in line]
    assert len(said["small"]) == 1
    assert not said["large"]


SOLID = solid(SECTION, 0.4)
STEP_KEYS = set(
    """depth_mm slide_x_mm slide_z_mm time_s normal_force_N tangential_force_x_N tangential_force_z_N friction_sum_N
    outward_friction_x_N outward_friction_z_N contact_area_mm2 stick_area_mm2 stick_ratio_area
    stick_ratio_force slip_margin contact_half_length_mm
    stick_half_length_mm largest_penetration_mm force_x_N force_y_N force_z_N moment_x_Nmm moment_y_Nmm moment_z_Nmm
    turn_x_deg turn_y_deg turn_z_deg external_work_mJ dissipation_mJ gauges iterations residual outcome""".split()
)
CONTACT_COLUMNS = (
    "face x_mm y_mm z_mm area_mm2 normal_x normal_y normal_z pressure_MPa shear_x_MPa shear_y_MPa shear_z_MPa gap_mm "
    "slip_x_mm slip_y_mm slip_z_mm margin status".split()
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


def test_a_file_that_no_press_has_written_is_not_replaced(tmp_path: Path, capsys) -> None:
    scene, out, name = written(tmp_path, HALF_CYLINDER), tmp_path / "out", "contact.csv"
    out.mkdir()
    (out / name).write_text("mine", encoding="utf-8")
    assert main(["press", str(scene), "--out", str(out), "--no-error"]) == 2
    assert name in capsys.readouterr().err.splitlines()[-1]
    assert contents(out) == {name: b"mine"}


@pytest.fixture(scope="module")
def strange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fingers that no design here knows, drawn with plain build123d as STEP and STL, their bases not at y = 0."""
    from build123d import Box, Cylinder, Plane, Pos, RectangleRounded, Sphere, export_stl, fillet, loft

    folder = tmp_path_factory.mktemp("strange")

    def level(y: float) -> Plane:
        return Plane(origin=(0, y, 0), x_dir=(1, 0, 0), z_dir=(0, 1, 0))

    # A fingertip: lofted from the nail's side at y = 21 to a narrower top, crowned by a ball, its rim rounded.
    tip = loft([level(17) * RectangleRounded(20, 14, 4), level(29) * RectangleRounded(15, 10, 3)])
    tip = tip & Pos(0, 4, 0) * Sphere(22.0)
    crown = [e for e in tip.edges() if all(abs((e @ t - (0, 4, 0)).length - 22.0) < 1e-3 for t in (0, 0.5, 1))]
    assert crown
    ridged = Box(12, 4, 8) + [Pos(x, 2, 0) * Cylinder(0.7, 8) for x in (-4, -2, 0, 2, 4)]
    for name, body in (("tip", Pos(30, 4, -8) * fillet(crown, 1.5)), ("ridged", Pos(5, -3, 2) * ridged)):
        step_of(folder / f"{name}.step", body.solids()[0])
        export_stl(body.solids()[0], folder / f"{name}.stl", tolerance=2e-3, angular_tolerance=0.1)
    return folder


def pressed(file: Path, scene: Path, obj: str, depth: float, sizes: tuple[float, float]) -> tuple[Any, list[Any]]:
    """The problem and the frames of a finger from a file."""
    from finger3d.mechanics.discretise.build import build
    from finger3d.mechanics.march.solve import march

    scene.write_text(
        f'[finger]\ngeometry = "{file}"\n[material]\nE_MPa = 0.5\nnu = 0.45\n[object]\n{obj}\n[friction]\nmu = 0.4\n'
        f"[press]\ndepth_mm = {depth}\nsteps = 4\n[mesh]\nsize_mm = {sizes[0]}\nbase_size_mm = {sizes[1]}\n",
        encoding="utf-8",
    )
    problem = build(load(scene).model())
    frames = list(march(problem))
    assert all(f.outcome.ok and f.residual <= 1e-8 for f in frames)
    return problem, frames


BALL = 'shape = "sphere"\nradius_mm = 15.0'


@pytest.mark.slow
def test_a_finger_drawn_outside_can_be_pressed(strange: Path, tmp_path: Path) -> None:
    """Lofted sides, a crown and its rounded rim run into each other smoothly: such meshes were hard to snap."""
    problem, frames = pressed(strange / "tip.step", tmp_path / "scene.toml", BALL, 0.8, (1.2, 3.0))
    force = [float(f.state.force[:, 0].sum()) for f in frames]
    assert (np.diff(force, prepend=0.0) > 0.0).all()
    body = imported(strange / "tip.step")
    assert problem.body.report.volume_mm3 == pytest.approx(body.volume_mm3, rel=2e-3)
    assert (problem.mesh.points[np.unique(problem.mesh.facets["base"]), 1] == 0.0).all()
    surface = problem.mesh.points[np.unique(np.vstack(list(problem.mesh.facets.values())))]
    inside = np.zeros(len(surface), dtype=bool)
    for axis, label in ((0, "symmetry_x"), (2, "symmetry_z")):
        assert label in problem.mesh.facets
        inside |= surface[:, axis] == 0.0
    # the triangles are within 5e-5 of the size, but for what the mesher makes of 0.2 rad
    assert np.abs(body.surface.signed_distance(surface[~inside])[0]).max() < 5e-4 * body.surface.size


@pytest.mark.slow
def test_a_finger_drawn_outside_presses_alike_from_step_and_stl(strange: Path, tmp_path: Path) -> None:
    """Meshes of the body and of its facets agree within two error bars of their difference, which is below 3 %."""
    from finger3d.accuracy.estimate import estimate
    from finger3d.mechanics.history import measure

    force, bars = {}, {}
    for kind in ("step", "stl"):
        scene = tmp_path / f"{kind}.toml"
        problem, frames = pressed(strange / f"ridged.{kind}", scene, 'shape = "plane"', 0.25, (0.3, 1.2))
        force[kind] = measure(problem.points, frames[-1])["normal_force_N"]
        bars[kind] = estimate(problem, frames).discretisation["normal_force_N"]
    bar = math.hypot(*bars.values())
    assert abs(force["stl"] - force["step"]) <= 2.0 * bar
    assert bar < 0.03 * force["step"]


@pytest.mark.slow
def test_a_twisted_column_has_the_torque_of_its_polar_moment(tmp_path: Path) -> None:
    """Held without slip, a round column twists by u = theta y / h (z, 0, -x), which quadratic cells hold exactly."""
    from build123d import Cylinder, Rot

    from finger3d.contact.friction import Coulomb
    from finger3d.fem.laws.material import Isotropic
    from finger3d.mechanics.model import Leg, MeshOptions, Model
    from tests.models import run

    column = imported(step_of(tmp_path / "column.step", (Rot(90, 0, 0) * Cylinder(4.0, 10.0)).solids()[0]))
    twist, shear = 0.02, 0.5
    legs = (Leg(0.01, steps=1), Leg(0.01, steps=1, turn_y=twist))
    model = Model(column, Isotropic(2.0 * shear, 0.0), MeshOptions(2.5, 2.5), legs, friction=Coulomb(100.0))
    _, frames = run(model)
    polar = 0.5 * np.pi * 4.0**4
    assert frames[-1].moment[1] == pytest.approx(shear * polar * twist / 10.0, rel=1e-3)
