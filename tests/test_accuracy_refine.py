"""Meshes refined to an error, and at the border of stick."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.accuracy.estimate import estimate, main_numbers, press_numbers
from finger3d.accuracy.refine import Refinement, Round, refine_mesh, stick_borders, with_refined_borders
from finger3d.cli import main
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarser
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.scene import load, scene_of
from tests.logs import Log
from tests.models import half_cylinder, swept_fig9
from tests.scenes import written

SCENE = """
[finger]
geometry = "half_cylinder"
radius_mm = 5.0
width_mm = 4.0
[material]
E_MPa = 1.0
nu = 0.45
[friction]
mu = 0.25
[press]
depth_mm = 1.0
steps = 5
[model]
domain = "plane-strain"
[mesh]
tolerance = 0.03
"""
OPTIONS = MeshOptions(1.0, 4.0, "swept")


def section(size: float) -> Model:
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    return Model(
        design, Isotropic(1.0, 0.45), MeshOptions(size, 4.0 * size, "swept"), (Leg(1.0, steps=5),),
        friction=Coulomb(0.25), domain="plane-strain",
    )  # fmt: skip


def last(problem: Problem) -> StepResult:
    return list(march(problem))[-1]


def test_it_refines_until_the_estimate_is_met_and_says_every_round() -> None:
    said = Log()
    found = refine_mesh(section(1.0), 2e-3, report=said)
    assert found.met
    assert found.stopped == "met"
    assert found.warning == ""
    assert len(said.lines) == len(found.rounds) > 1
    assert found.rounds[0].error > 2e-3 >= found.rounds[-1].error
    assert found.rounds[-1].dofs > found.rounds[0].dofs
    assert found.problem is not None
    assert found.problem.body.stiffness.upper.shape[0] == found.rounds[-1].dofs
    # and it is true, within twice the tolerance
    truth = build(replace(section(0.4), mesh=MeshOptions(0.02, 0.1, "swept")))
    force = [-f.state.force[:, 0].sum() for p in (found.problem, truth) for f in [list(march(p))[-1]]]
    assert force[0] == pytest.approx(force[1], rel=2 * 2e-3)


@pytest.mark.parametrize("by_depth", [True, False])
def test_a_mesh_that_is_finer_than_the_tolerance_asks_for_is_made_coarser(by_depth: bool) -> None:
    model = section(0.1) if by_depth else replace(section(0.15), legs=(Leg(1.0, steps=3, force_N=0.5),))
    found = refine_mesh(model, 0.02)
    assert found.met
    assert found.stopped == "met"
    assert found.best.dofs < 0.7 * found.rounds[0].dofs
    assert (found.mesh.size_mm, found.mesh.base_size_mm) == (found.best.size_mm, found.best.base_size_mm)
    assert found.best.number == ("normal_force_N" if by_depth else "depth_mm")  # under a force the depth is the unknown
    # and the error is below the tolerance
    coarse, fine = (build(replace(model, mesh=mesh)) for mesh in (found.mesh, MeshOptions(0.04, 0.2, "swept")))
    ends = [list(march(p))[-1] for p in (coarse, fine)]
    numbers = [e.target.depth_mm * -e.meshed_state.contact.scene_force[:, 1].sum() for e in ends]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02)


def test_a_mesh_that_just_meets_the_tolerance_is_kept() -> None:
    error = refine_mesh(section(0.4), 1e-4, max_seconds=0.0).rounds[0].error
    found = refine_mesh(section(0.4), 2.0 * error)
    assert len(found.rounds) == 1
    assert found.mesh == section(0.4).mesh


def test_edges_at_a_gauge_become_shorter_for_its_strain_only() -> None:
    model = replace(section(0.5), gauges=(Gauge("g", 1.5, 3.5, angle=0.5),))
    found = {goal: refine_mesh(model, 1e-3, goal=goal).mesh.gauge_refinement for goal in ("gauge_g", "normal_force_N")}
    assert found["gauge_g"] > 1.0
    assert found["normal_force_N"] == 1.0


@pytest.mark.parametrize(
    ("goal", "tolerance"),
    [("stick_area_mm2", 0.01), ("all", 0.02)],
)
def test_every_headline_number_is_a_goal(goal: str, tolerance: float) -> None:
    model = section(0.5)
    found = refine_mesh(model, tolerance, goal=goal)
    assert found.met
    assert found.problem is not None
    told = press_numbers(found.problem, last(found.problem))
    fine = build(section(0.04))
    exact = press_numbers(fine, last(fine))
    names = [name for name in exact if "force_x" not in name and "moment" not in name] if goal == "all" else [goal]
    for name in names:  # those left out are zero by symmetry
        scale = exact["contact_half_length_mm"] if "length" in name else exact[name]
        assert abs(told[name] - exact[name]) <= 2.0 * tolerance * abs(scale) + 1e-12, name


@pytest.mark.parametrize(
    ("goal", "changes", "refused"),
    [
        ("stick_area_mm2", [], False),
        ("all", [], False),
        ("moment_x_Nmm", [], True),  # of a section
        ("contact_half_length_end_mm", [], True),
        ("contact_half_length_end_mm", ["model.domain=solid"], False),
        ("depth_mm", [], True),  # it is given
        ("gauge_g", [], True),
    ],
)
def test_a_goal_that_the_press_has_not_is_refused_by_its_name(
    goal: str, changes: list[str], refused: bool, tmp_path: Path
) -> None:
    path = written(tmp_path, SCENE)
    keys = [f"mesh.goal={goal}", *changes]
    if not refused:
        assert load(path, keys).tables.mesh.goal == goal
        return
    with pytest.raises(Finger3dError, match=f'mesh.goal = "{goal}": no number of this press; must be one of ') as found:
        load(path, keys)
    assert "stick_half_length_mm" in str(found.value)


def test_the_time_stops_it_with_the_best_so_far() -> None:
    found = refine_mesh(section(0.4), 1e-4, max_seconds=0.0)
    assert len(found.rounds) == 1
    assert not found.met
    assert found.warning.startswith("mesh.tolerance = 0.0001")
    assert f"{found.rounds[0].error:.2g}" in found.warning


def test_too_large_a_mesh_stops_it_with_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    # a machine of so little memory that the second round is refused by the forecast
    model = section(0.08)
    cells = len(build(model).mesh.cells)
    # 4.1 unknowns a triangle at 2 kB, 80 % of memory may be used (finger3d/meshing/limits.py)
    enough = int(2 * cells * 4.1 * 2e3 / 0.8)
    monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda: (enough, enough))
    found = refine_mesh(model, 1e-6)
    assert found.rounds
    assert found.stopped.count("mesh.size_mm = ")
    assert "allowed" in found.warning


def test_the_best_round_need_not_be_the_last() -> None:
    rounds = (Round(1.0, 4.0, 100, 0.02, "normal_force_N", 1.0), Round(0.5, 4.0, 400, 0.03, "friction_sum_N", 2.0))
    found = Refinement(0.01, OPTIONS, rounds, "8 rounds")
    assert found.best is rounds[0]
    assert "0.02 in normal_force_N" in found.warning
    assert found.as_dict()["rounds"][1]["dofs"] == 400


@pytest.mark.parametrize(
    ("domain", "mesher", "tolerance"),
    [
        ("plane-strain", "swept", 0.05),
        pytest.param("solid", "ftetwild", 0.3, marks=pytest.mark.slow),
    ],
)
def test_press_with_a_tolerance(tmp_path: Path, domain: str, mesher: str, tolerance: float) -> None:
    scene = tmp_path / "scene.toml"
    text = SCENE.replace("plane-strain", domain).replace("0.03", f'{tolerance}\nmesher = "{mesher}"')
    scene.write_text(text, encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    refinement = summary["refinement"]
    assert refinement["met"]
    assert refinement["tolerance"] == tolerance
    last = min((r for r in refinement["rounds"] if r["error"] <= tolerance), key=lambda r: float(r["dofs"]))
    assert last["error"] <= tolerance
    assert summary["mesh"]["dofs"] == last["dofs"]
    assert summary["outcome"] == "converged"
    assert last["number"] == "normal_force_N"
    # the scene as run loads, and has the sizes found
    again = load(tmp_path / "out" / "scene.toml")
    assert again.tables.mesh.tolerance is None
    assert (again.mesh.size_mm, again.mesh.base_size_mm) == (last["size_mm"], last["base_size_mm"])


def test_the_warning_reaches_the_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("0.03", "1e-4\nmax_seconds = 0.01"), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["refinement"]["stopped"] == "max_seconds = 0.01"
    assert any("mesh.tolerance = 0.0001" in w for w in summary["warnings"])
    assert "mesh.tolerance = 0.0001" in capsys.readouterr().out


def test_compare_wants_sizes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    assert main(["compare", str(scene), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "mesh.tolerance = 0.03" in error
    assert len(error.splitlines()) == 1


STICK_MM2 = 180.4
"""Area of stick on Fig. 9 (nu = 0.49, mu = 0.25, 20 increments) with edges of 0.25 mm at its border."""


def refined(model: Model, factor: float) -> tuple[Problem, Problem, Log]:
    said, finer = Log(), replace(model, mesh=replace(model.mesh, stick_refinement=factor))
    return build(finer), with_refined_borders(finer, said), said


@pytest.mark.slow
def test_the_area_of_a_thin_stick_zone_becomes_known() -> None:
    model = replace(swept_fig9(2.0, mu=0.25, nu=0.49), legs=(Leg(10.0, steps=20),))
    before, after, said = refined(model, 3.0)
    assert [line for line in said.lines if "border of stick" in line] == [
        "border of stick: edges of 1 mm",
        "border of stick: edges of 0.667 mm",
    ]
    found = []
    for problem in (before, after):
        steps = list(march(problem))
        bar = estimate(problem, steps).discretisation["stick_area_mm2"]
        found.append((main_numbers(problem, steps[-1])["stick_area_mm2"], bar))
    (coarse, unknown), (fine, bar) = found
    assert abs(coarse - STICK_MM2) <= 2.0 * unknown
    assert unknown > 2.0 * bar
    assert abs(fine - STICK_MM2) <= min(2.0 * bar, 0.05 * STICK_MM2)
    assert bar <= 0.12 * fine
    # the body has hardly more unknowns than twice as many; edges of 0.667 mm everywhere would take ten times as many
    assert after.size.dofs < 2.5 * before.size.dofs


@pytest.mark.parametrize(("mu", "gauge_refinement"), [(0.0, 1.0), (5.0, 2.0)])
def test_without_a_border_of_stick_the_mesh_stays(mu: float, gauge_refinement: float) -> None:
    plain = half_cylinder(0.4)
    mesh = replace(plain.mesh, gauge_refinement=gauge_refinement)
    before, after, said = refined(replace(plain, friction=Coulomb(mu), mesh=mesh), 4.0)
    assert np.array_equal(after.mesh.points, before.mesh.points)
    assert after.model == before.model
    assert not [line for line in said.lines if "border of stick" in line]


def test_borders_of_a_section_lie_in_its_mesh_and_are_those_at_the_ends_of_legs() -> None:
    legs = (Leg(0.5, steps=5), Leg(1.0, steps=5))
    problem, after, _ = refined(replace(half_cylinder(0.3), friction=Coulomb(0.2), legs=legs), 2.0)
    borders = after.model.mesh.borders
    assert borders is not None
    steps = list(march(problem))
    places = stick_borders(problem, [steps[4], steps[9]])
    np.testing.assert_array_equal(borders.places, places)
    assert len(places) == 2
    assert (places[:, 0] >= 0.0).all()
    # a companion is coarser there, too
    assert coarser(after.model).mesh.borders.size == pytest.approx(2.0 * borders.size)  # type: ignore[union-attr]
    edges = np.diff(np.unique(after.points.points[:, 0]))
    assert edges.min() == pytest.approx(0.15, rel=0.35)


FIG9 = {
    "finger": {
        "geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
        "width_mm": 20.0,
    },
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "friction": {"mu": 0.25},
    "press": {"depth_mm": 5.0},
    "gauge": [{"name": "g", "x_mm": 30.0, "y_mm": 40.0}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "refinement"),
    [
        ({}, 3.5),
        ({"mesh": {"stick_refinement": 1.0}}, 1.0),
        ({"mesh": {"size_mm": 2.0}}, 1.0),
        ({"mesh": {"tolerance": 0.02}}, 1.0),
        ({"friction": {"mu": 0.0}}, 1.0),
        ({"press": {"force_N": 20.0}}, 1.0),
        ({"model": {"domain": "plane-strain"}}, 1.0),
        ({"effects": {"large_deformation": {}}}, 1.0),
    ],
)
def test_the_default_refines_solids_without_sizes(changes: dict[str, object], refinement: float) -> None:
    assert scene_of({**FIG9, **changes}).mesh.stick_refinement == refinement


def test_the_default_can_be_run_again_from_what_is_written() -> None:
    scene = scene_of(FIG9)
    assert scene.as_dict()["mesh"]["stick_refinement"] == 3.5
    assert scene_of(scene.as_dict()).mesh == scene.mesh
