"""Two fingers that hold a free object: equilibrium, symmetry, slip, stiffness, work, and the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.press import least_grip
from finger3d.analyses.reduced import ReducedModel
from finger3d.app import LiveBody
from finger3d.cli import main
from finger3d.contact.friction import STICK
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.generalised import motions
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.grip import Grip
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.objects import vertical_frame
from finger3d.progress import QUIET
from finger3d.report.press import press_page
from finger3d.scene import Scene, scene_of

G = 9.80665e-3
"""Weight of a gram, N."""

DOME = {
    "geometry": "clipped_cylinder",
    "radius_mm": 20.0,
    "half_length_mm": 10.0,
    "edge_height_mm": 7.0,
    "width_mm": 8.0,
}
PAD = {"geometry": "block", "half_length_mm": 5.0, "height_mm": 6.0, "width_mm": 8.0}
BOX = {"shape": "box", "size_mm": (10.0, 6.0, 30.0)}


def scene(
    domain: str = "solid", finger: dict[str, Any] = DOME, thing: dict[str, Any] = BOX, mu: float = 0.5, **grip: Any
) -> Scene:
    tables = {
        "finger": finger, "material": {"E_MPa": 0.2, "nu": 0.45}, "object": thing, "friction": {"mu": mu},
        "grip": {"steps": 3} | grip, "model": {"domain": domain}, "mesh": {"size_mm": 1.0, "mesher": "swept"},
        "effects": {"auto": False},
    }  # fmt: skip
    return scene_of(tables)


def held(problem: Problem) -> list[StepResult]:
    steps = list(march(problem))
    assert all(step.outcome.ok for step in steps), steps[-1].failure
    return steps


@pytest.mark.parametrize(("domain", "large"), [("plane-strain", False), ("solid", False), ("plane-strain", True)])
def test_a_symmetric_grip_is_one_finger_on_its_own(domain: str, large: bool) -> None:
    given = scene(domain, closing_mm=0.8)
    given = given.with_effects(["large_deformation"]) if large else given
    both = build(given.model())
    alone = build(replace(given.model(), legs=(Leg(0.8, steps=3),), centre_of_mass_mm=None))
    same = 5e-9 if large else 1e-10  # at large deformation the residual at which increments end
    for grip, press in zip(held(both), held(alone), strict=True):
        assert grip.other is not None
        one, other, expected = (measure(both.points, step) for step in (grip, grip.other, press))
        for name in ("normal_force_N", "friction_sum_N", "external_work_mJ", "contact_area_mm2", "stick_area_mm2"):
            assert one[name] == pytest.approx(expected[name], rel=100 * same)
            assert other[name] == pytest.approx(one[name], rel=same, abs=same)


@pytest.mark.parametrize(
    ("domain", "thing", "large"),
    [
        ("solid", BOX, False),
        ("solid", {"shape": "sphere", "radius_mm": 5.0}, False),
        ("solid", {"shape": "cylinder", "radius_mm": 4.0, "axis": "x", "length_mm": 25.0}, False),
        ("plane-strain", {"shape": "cylinder", "radius_mm": 4.0}, False),
        ("plane-strain", BOX, True),
    ],
)
def test_the_object_is_in_equilibrium(domain: str, thing: dict[str, Any], large: bool) -> None:
    section = domain != "solid"
    load = {"load_N": (0.02, 0.01, 0.0 if section else 0.03), "load_Nmm": (0.0, 0.0, 0.05)}
    down = (-1.0, 0.0, 0.0) if section else (0.3, -0.2, -1.0)
    given = scene(domain, thing=thing, force_N=0.4, mass_g=5.0, down=down, **load)
    given = given.with_effects(["large_deformation"]) if large else given
    problem = build(given.model())
    last = held(problem)[-1]
    assert last.other is not None
    lower, upper = (measure(problem.points, step) for step in (last, last.other))
    weight = 5.0 * G * np.array(down) / np.linalg.norm(down) + load["load_N"]
    same = 1e-7 if large else 1e-9
    on_fingers = [lower["force_x_N"] + upper["force_x_N"], lower["force_y_N"] - upper["force_y_N"]]
    on_fingers += [] if section else [lower["force_z_N"] + upper["force_z_N"]]
    assert on_fingers == pytest.approx(weight[: len(on_fingers)], abs=same * 0.4)
    assert 0.5 * (lower["normal_force_N"] + upper["normal_force_N"]) == pytest.approx(0.4, rel=same)


def test_a_held_object_does_not_creep() -> None:
    rod = {"shape": "cylinder", "radius_mm": 4.0}
    given = scene("plane-strain", thing=rod, closing_mm=0.5, mass_g=4.0, down=(-1.0, 0.0, 0.0))
    problem = build(given.model())
    close, weight = problem.model.legs
    problem = replace(problem, model=replace(problem.model, legs=(close, weight, replace(weight, steps=1000))))
    steps = held(problem)
    first, last = steps[5], steps[-1]
    assert first.pose == last.pose
    assert (first.state.tangential_displacement == last.state.tangential_displacement).all()


@pytest.mark.parametrize(("share", "holds"), [(0.999, True), (1.001, False)])
def test_a_plate_slips_at_twice_mu_times_the_grip(share: float, holds: bool) -> None:
    steps = list(march(build(scene(force_N=1.0, mass_g=share * 2.0 * 0.5 * 1.0 / G).model())))
    assert steps[-1].outcome.ok == holds
    if not holds:
        assert "slides along -z" in steps[-1].detail


def test_an_off_centre_weight_tilts_a_stuck_plate_as_two_condensed_springs_do() -> None:
    plate = {"shape": "box", "size_mm": (30.0, 4.0, 30.0)}
    load = {"mass_g": 1.0, "centre_mm": (0.0, 0.0, 3.0), "down": (0.0, -1.0, 0.0)}
    problem = build(scene(finger=PAD, thing=plate, mu=100.0, closing_mm=0.02, **load).model())
    steps = held(problem)
    start, end = steps[2], steps[-1]
    assert start.pose is not None
    assert end.pose is not None
    assert (end.state.status == STICK).all()
    grip, numbers = Grip.of(problem).problem, (2, 3, 6)  # slide along z, turn about x, rise
    contact, fixed = grip.system, grip.surface.centroids
    moved = -motions(grip, start.pose, fixed, numbers)
    bases = np.broadcast_to(vertical_frame(3), (len(fixed), 3, 3))  # in which the operator is stored
    rigid = np.einsum("cak,ckj->caj", bases, moved).reshape(-1, 3)[contact.active_dofs]
    compliance = contact.delassus.reshape(fixed.size, fixed.size)[np.ix_(contact.active_dofs, contact.active_dofs)]
    stiffness = 2.0 ** len(problem.axes) * rigid.T @ np.linalg.solve(compliance, rigid)
    change = np.linalg.solve(stiffness, [0.0, 0.0, -G])
    was, found = (np.array([pose.slide_z_mm, pose.turn_x, pose.rise_mm]) for pose in (start.pose, end.pose))
    assert found - was == pytest.approx(change, rel=0.01, abs=0.01 * abs(change[1]))


def test_the_work_of_the_loads_is_that_on_the_fingers() -> None:
    """Of a ball that is turned and pulled between two pads; gaps are means over hats, of second order in the mesh."""
    ball = {"shape": "sphere", "radius_mm": 4.0}
    force, pull, moment, count = 0.3, 0.06, 0.2, 10
    grip = {"force_N": force, "load_N": (0.0, 0.0, pull), "load_Nmm": (moment, 0.0, 0.0), "steps": count}
    model = scene(finger=PAD, thing=ball, mu=0.3, **grip).model()
    steps = held(build(replace(model, mesh=replace(model.mesh, size_mm=0.5, base_size_mm=1.0))))
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    forces = share * [0.0, pull, moment] + [2.0 * force, 0.0, 0.0]
    poses = np.array([[s.pose.depth_mm, s.pose.slide_z_mm, s.pose.turn_x] for s in steps[count - 1 :] if s.pose])
    work = float(np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(poses, axis=0)))
    done = [step.external_work_mJ + step.other.external_work_mJ for step in steps if step.other]
    assert done[-1] - done[count - 1] == pytest.approx(work, rel=0.01)
    assert abs(poses[-1, 2]) > 0.01
    assert steps[-1].dissipation_mJ > steps[count - 1].dissipation_mJ


def test_the_least_grip_of_a_plate() -> None:
    problem = build(scene("plane-strain", closing_mm=0.8, mass_g=20.0, down=(-1.0, 0.0, 0.0)).model())
    assert least_grip(problem, 1.9, QUIET) == pytest.approx(0.5 * 20.0 * G / 0.5, rel=0.01)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"object": {"shape": "plane"}}, "two fingers hold a closed body"),
        ({"object": {"shape": "cylinder", "radius_mm": 4.0}}, "a cylinder with length_mm"),
        ({"press": {"depth_mm": 1.0}}, "must not stand beside"),
        ({"grip": {"force_N": 1.0, "closing_mm": 1.0}}, "either force_N or closing_mm"),
        ({"grip": {"force_N": 1.0, "mass_g": 1.0}, "model": {"domain": "plane-strain"}}, "grip.down"),
        ({"effects": {"viscosity": {"prony": [[0.3, 0.5]]}}}, "not with"),
    ],
)
def test_a_grip_that_cannot_be_is_refused(changed: dict[str, Any], said: str) -> None:
    tables = {"finger": DOME, "material": {"E_MPa": 0.2, "nu": 0.45}, "object": BOX, "grip": {"force_N": 1.0}} | changed
    with pytest.raises(Finger3dError, match=said):
        scene_of(tables)


def test_the_command_writes_both_fingers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "pinch.toml"
    path.write_text(scene(closing_mm=0.8, mass_g=20.0).to_toml(), encoding="utf-8")
    out = tmp_path / "out"
    assert main(["press", str(path), "--out", str(out), "--no-error", "--no-figures", "--least-grip"]) == 0
    said = capsys.readouterr().out
    assert "held" in said
    assert "upper finger" in said
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["held"] is True
    assert summary["least_grip_N"] == pytest.approx(20.0 * G, rel=0.01)
    assert [finger["finger"] for finger in summary["fingers"]] == ["lower", "upper"]
    assert summary["fingers"][0]["steps"] == summary["steps"]
    assert summary["object_pose"]["z_mm"] < 0.0
    page = press_page(out).write(out).read_text(encoding="utf-8")
    assert "closing_mm = 0.8" in page
    assert "Two fingers" in page
    rows = (out / "contact.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("finger,face")
    assert {row.partition(",")[0] for row in rows[1:]} == {"lower", "upper"}
    pressed = scene(closing_mm=0.8).to_toml().replace("[grip]", "[press]").replace("closing_mm", "depth_mm")
    plane = tmp_path / "plane.toml"
    plane.write_text(pressed, encoding="utf-8")
    assert main(["press", str(plane), "--out", str(out), "--least-grip"]) == 2


def test_two_fingers_have_neither_an_app_nor_a_reduced_model() -> None:
    given = scene("plane-strain", closing_mm=0.8)
    with pytest.raises(Finger3dError, match="not with"):
        LiveBody.of(given)
    with pytest.raises(Finger3dError, match="no reduced model"):
        ReducedModel.of(build(given.model()))
