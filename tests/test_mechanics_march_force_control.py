"""Force control: the depth follows from the force, whatever the effects; forces out of reach are refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from finger3d.analyses.pressed_body import PressedBody
from finger3d.cli import main
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.increment import FiniteIncrement
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.force_control import at_depth_reached, forecast_depth
from finger3d.mechanics.march.parts import solved_in_turn
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model, contact_path
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.results.state import State
from finger3d.objects import Cylinder, Move, Plane
from finger3d.scene import load
from tests.logs import Log
from tests.models import block, fig9


def ends(model: Model) -> list[dict[str, float]]:
    problem = build(model)
    steps = list(march(problem))
    assert all(step.outcome.ok for step in steps)
    return [measure(problem.points, step) for step in steps]


def test_the_same_forces_are_reached_at_the_same_depths() -> None:
    by_depth = ends(block(legs=(Leg(0.3, steps=3),)))
    legs = tuple(Leg(0.3, steps=1, force_N=step["normal_force_N"]) for step in by_depth)
    by_force = ends(block(legs=legs))
    for a, b in zip(by_depth, by_force, strict=True):
        assert b["depth_mm"] == pytest.approx(a["depth_mm"], rel=1e-8)
        assert b["friction_sum_N"] == pytest.approx(a["friction_sum_N"], rel=1e-6)


def test_increments_are_equal_in_force_on_the_way_up_and_down_and_constant_in_a_slide() -> None:
    legs = (
        Leg(0.2, steps=4, force_N=0.2),
        Leg(0.2, slide_x_mm=0.3, steps=3, force_N=0.2),
        Leg(0.1, slide_x_mm=0.3, steps=2, force_N=0.1),
    )
    forces = [step["normal_force_N"] for step in ends(block(legs=legs))]
    assert forces == pytest.approx([0.05, 0.1, 0.15, 0.2, 0.2, 0.2, 0.2, 0.15, 0.1], rel=1e-8)


@pytest.mark.parametrize("effect", [LargeDeformation(), Viscosity(((0.4, 1.0),))], ids=["large", "viscous"])
def test_a_force_is_reached_with_an_effect(effect: LargeDeformation | Viscosity) -> None:
    legs = (Leg(0.2, steps=2, force_N=0.2, duration_s=1.0), Leg(0.2, steps=2, force_N=0.2, duration_s=3.0))
    found = ends(effect.apply(block(legs=legs, domain="plane-strain")))
    assert [step["normal_force_N"] for step in found] == pytest.approx([0.1, 0.2, 0.2, 0.2], rel=1e-6)
    creeps = found[3]["depth_mm"] - found[1]["depth_mm"]
    assert creeps > 0.01 if isinstance(effect, Viscosity) else abs(creeps) < 1e-6


def test_a_force_beyond_the_height_ends_the_press_with_the_largest_that_was_found() -> None:
    said = Log()
    last = list(march(build(block(legs=(Leg(1.0, steps=1, force_N=1e6),))), report=said))[-1]
    assert said.lines
    assert all(re.match(r"[0-9.e+]+ N wanted, ", line) for line in said.lines)
    assert last.outcome is Outcome.FORCE_NOT_REACHED
    assert "1e+06 N asked; the largest force is" in last.detail


def test_a_turn_under_a_constant_force_lifts_the_object_above_first_touch() -> None:
    legs = (Leg(0.2, steps=1, force_N=0.5), Leg(0.2, steps=2, force_N=0.5, turn_z=math.radians(10.0)))
    found = ends(block(legs=legs, domain="plane-strain", object=Plane()))
    assert [step["normal_force_N"] for step in found] == pytest.approx([0.5] * 3, rel=1e-6)
    assert found[-1]["depth_mm"] < 0.0


@pytest.mark.parametrize("large", [False, True])
def test_a_force_under_the_papers_rule_is_reached_or_ends_the_press(large: bool) -> None:
    model = replace(block(legs=(Leg(0.2, steps=1, force_N=5.0),), domain="plane-strain"), rule="paper")
    model = LargeDeformation().apply(model) if large else model
    last = list(march(build(model)))[-1]
    assert not last.outcome.is_cycle
    if last.outcome.ok:
        assert measure(build(model).points, last)["normal_force_N"] == pytest.approx(5.0, rel=1e-6)


@pytest.mark.parametrize("forecast_mm", [0.5, 1.8])
@pytest.mark.parametrize(
    ("domain", "steps", "ratio"),
    [("plane-strain", 1, 2), ("plane-strain", 3, 2), ("plane-strain", 5, 2), ("solid", 3, 2), ("solid", 5, 2)],
)
def test_a_press_by_force_at_large_deformation_is_the_press_through_its_poses_at_twice_the_cost(
    domain: Domain, steps: int, ratio: float, forecast_mm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, iterations = build(LargeDeformation().apply(block(legs=(Leg(1.0, steps=5),), domain=domain))), [0]
    formulation, advance = formulation_of(problem.model), FiniteIncrement._advance

    def counted(*arguments: Any) -> Any:
        iterations[0] += 1
        return advance(*arguments)

    monkeypatch.setattr(FiniteIncrement, "_advance", counted)

    def pressed(*legs: Leg) -> tuple[int, list[StepResult]]:
        workspace, before = formulation.workspace(), iterations[0]
        found = list(march(replace(problem, model=replace(problem.model, legs=legs)), workspace=workspace))
        assert all(step.outcome.ok for step in found)
        cost = iterations[0] - before + 5 * workspace.factorizations  # a factor takes as long as five iterations
        return cost, found

    wanted = measure(problem.points, pressed(Leg(1.0, steps=5))[1][-1])["normal_force_N"]
    cost, by_force = pressed(Leg(forecast_mm, steps=steps, force_N=wanted))
    least, by_depth = pressed(*(Leg(step.target.depth_mm, steps=1) for step in by_force))
    assert cost <= ratio * least
    parts = [part for step in by_force for part in step.parts]
    moves = [Move(start, end) for start, end in pairwise([problem.origin, *(pose for pose, _ in parts)])]
    state, workspace = formulation.start(problem), formulation.workspace()
    through, again = solved_in_turn(problem, workspace, state, moves, 0)
    assert through.outcome.ok
    for (_, found), part in zip(parts, again, strict=True):  # to the residual of 5e-9 of the forces
        assert _normal_force(problem, found) == pytest.approx(_normal_force(problem, part.after), rel=1e-8)
        friction, expected = (np.linalg.norm(state.contact.force[:, 1:], axis=1).sum() for state in (found, part.after))
        assert friction == pytest.approx(expected, rel=1e-6)
    first = [_normal_force(problem, state) for _, state in by_force[0].parts]
    assert first == pytest.approx(np.multiply((1 / 16, 1 / 4, 1), wanted / steps), rel=1e-7)
    # a first increment to a depth is cut at other depths: forces differ by no more than the error of the increments
    forces = [[measure(problem.points, step)["normal_force_N"] for step in found] for found in (by_force, by_depth)]
    assert forces[0] == pytest.approx(forces[1], rel=5e-3)


def test_a_forecast_is_good_to_a_factor_of_two() -> None:
    model = fig9(domain="plane-strain")
    found = ends(replace(model, legs=(Leg(5.0, steps=1),)))[0]
    design, material = model.design, model.material.isotropic("a test")
    forecast = forecast_depth(model.contact_path, material, found["normal_force_N"], design.height_mm, design.width_mm)
    assert 2.5 < forecast < 10.0


@pytest.mark.parametrize("x_mm", [0.0, 1.3, 3.0])
@pytest.mark.parametrize("depth", [0.003, 0.3])
def test_the_forecast_of_a_line_contact_is_good_wherever_it_is(x_mm: float, depth: float) -> None:
    block = designs()["block"](half_length_mm=60.0, height_mm=60.0, width_mm=1.0)
    material, radius = Isotropic(1.0, 0.5), 50.0
    # Johnson 1985, eq. (5.56): the centre of the loaded face relative to a depth of 60 mm, plane strain
    modulus = material.E_MPa / (1.0 - material.nu**2)

    def depth_of(force: float) -> float:
        a = math.sqrt(4.0 * force * radius / (math.pi * modulus))
        return force / (math.pi * modulus) * (2.0 * math.log(2.0 * 60.0 / a) - material.nu / (1.0 - material.nu))

    force = brentq(lambda force: depth_of(force) - depth, 1e-9, 10.0)
    way = contact_path(block, Cylinder(x_mm, radius_mm=radius), (), "plane-strain")
    assert forecast_depth(way, material, force, 60.0, 1.0) == pytest.approx(depth, rel=0.25)


def test_an_object_that_rolls_under_a_light_force_stays_on_the_finger() -> None:
    # the roll lifts the axis's foot by 100 (1 - cos 1.5 degrees) = 0.034 mm, more than the depth of 0.0028 mm
    obj, force = Cylinder(3.0, radius_mm=100.0), 1e-3
    legs = (Leg(1e-3, steps=2, force_N=force), Leg(1e-3, steps=2, force_N=force, turn_z=math.radians(1.5)))
    model = block(object=obj, legs=legs, domain="plane-strain", mesh=MeshOptions(0.2, 1.5, "swept"))
    body = PressedBody(model)
    (*_, rolled) = body.steps()
    assert measure(body.problem.points, rolled)["normal_force_N"] == pytest.approx(force, rel=1e-6)


def test_a_forecast_that_was_too_small_is_replaced() -> None:
    legs = (Leg(1.0, force_N=2.0), Leg(0.0))
    assert at_depth_reached(legs, 1.05) is None
    deeper = at_depth_reached(legs, 2.0)
    assert deeper is not None
    assert [leg.depth_mm for leg in deeper] == [2.0, 0.0]
    assert at_depth_reached((Leg(1.0),), 2.0) is None


SCENE = """
[finger]
geometry = "half_cylinder"
radius_mm = 5.0
width_mm = 2.0
[material]
E_MPa = 1.0
nu = 0.3
[press]
force_N = 0.5
steps = 2
[model]
domain = "plane-strain"
"""


def test_a_scene_gives_either_a_depth_or_a_force(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    scene = load(path)
    assert scene.legs[0].force_N == 0.5
    assert load_again(scene.to_toml(), tmp_path) == scene
    with pytest.raises(Finger3dError, match="force_N"):
        load(path, ["press.depth_mm=0.1", "press.force_N=0.5"])
    path.write_text(SCENE.replace("force_N = 0.5\n", ""))
    with pytest.raises(Finger3dError, match="press.depth_mm .*force_N"):
        load(path)


def load_again(text: str, folder: Path) -> object:
    (folder / "again.toml").write_text(text)
    return load(folder / "again.toml")


SMALL = "--set", "effects.auto=false", "--set", "press.steps=1"


def test_a_press_by_force_tells_the_depth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    assert main(["press", str(path), "--out", str(tmp_path / "out"), "--no-figures", "--no-error", *SMALL]) == 0
    assert "0.5 N" in capsys.readouterr().out
    assert main(["press", str(path), "--out", str(tmp_path / "far"), "--set", "press.force_N=1e4", *SMALL]) == 3
    error = capsys.readouterr().err
    assert "10000 N asked; the largest force is" in error
    summary = json.loads((tmp_path / "far" / "summary.json").read_text())
    assert "prescribed force is not reached" in summary["outcome"]


def test_a_force_for_which_an_inclined_plane_would_reach_the_base_is_an_outcome(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plane touches a quarter of the circle: at the edge of the base it is r (sqrt 2 - 1) = 2.07 mm above it."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE + '[object]\nshape = "plane"\nturn_z_deg = 45.0\n[mesh]\nsize_mm = 0.5\n')
    assert main(["press", str(path), "--out", str(tmp_path / "far"), "--set", "press.force_N=30", *SMALL]) == 3
    error = capsys.readouterr().err
    largest = re.search(r"30 N asked; the largest force is .* N, at a depth of (.*) mm", error)
    assert largest is not None
    assert float(largest[1]) == pytest.approx(0.99 * 5.0 * (math.sqrt(2.0) - 1.0), rel=0.02)
    assert main(["press", str(path), "--out", str(tmp_path / "deep"), "--set", "press.depth_mm=2.2", *SMALL]) == 2
    assert "incline it less" in capsys.readouterr().err


def _normal_force(problem: Problem, state: State[Any]) -> float:
    return -float(problem.world_force(state.contact)[:, 1].sum())
