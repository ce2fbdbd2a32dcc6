"""Stick ratios, slip margins and slip events, against Coulomb's law for a flat contact and Mindlin's for a ball."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.accuracy.estimate import estimate
from finger3d.contact.friction import SLIP, STICK, Coulomb
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, contact_table, measure, slip_events
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.mechanics.readings import Taxel
from finger3d.objects import Plane, Sphere
from tests.held_cases import MU, PRESS, N, held
from tests.models import block
from validation import _halfplane

MU_LOW = 0.03


def test_the_margin_of_a_flat_contact_is_that_of_coulombs_law() -> None:
    problem = build(block(object=Plane(), legs=(PRESS, held(0.03, 0.02))))
    *_, last = march(problem)
    found = measure(problem.points, last)
    assert found["slip_margin"] == pytest.approx(1.0 - np.hypot(0.03, 0.02) / (MU * N), rel=1e-7)
    assert 0.0 < found["stick_ratio_area"] <= 1.0


def test_nothing_sticks_and_no_margin_is_left_once_the_whole_contact_slips() -> None:
    problem = build(block(object=Plane(), legs=(PRESS, Leg(PRESS.depth_mm, steps=2, slide_x_mm=2.0))))
    *_, last = march(problem)
    found = measure(problem.points, last)
    assert (found["slip_margin"], found["stick_ratio_area"], found["stick_ratio_force"]) == (0.0, 0.0, 0.0)
    assert not np.any(contact_table(problem.points, last)["margin"])


def test_the_margin_of_a_point_is_what_is_left_of_its_friction() -> None:
    problem = build(block(object=Sphere(radius_mm=4.0), legs=(Leg(0.3, steps=3),), friction=Coulomb(MU_LOW)))
    *_, last = march(problem)
    table, status = contact_table(problem.points, last), last.state.status
    shear = np.sqrt(sum(table[f"shear_{axis}_MPa"] ** 2 for axis in "xyz"))
    sticks = status == STICK
    expected = 1.0 - shear[sticks] / (MU_LOW * table["pressure_MPa"][sticks])
    assert table["margin"][sticks] == pytest.approx(expected, rel=1e-9)
    assert not table["margin"][~sticks].any()
    assert sticks.any()
    assert (status == SLIP).any()
    normal = last.state.force[:, 0]
    assert measure(problem.points, last)["stick_ratio_force"] == pytest.approx(normal[sticks].sum() / normal.sum())


def test_the_stick_ratio_of_a_line_contact_follows_its_margin() -> None:
    """c / a = (1 - Q / (mu P))^(1/2) of a cylinder that is pressed, then slid (Cattaneo 1938), within a point."""
    depth = float(_halfplane.depth(1.0, _halfplane.DEPTH_OF_BLOCK))
    problem = _halfplane.line(0.5, 20, (Leg(depth, steps=4), Leg(depth, slide_x_mm=0.5 * MU * depth, steps=2)))
    *_, last = march(replace(problem, model=replace(problem.model, friction=Coulomb(MU))))
    found = measure(problem.points, last)
    assert 0.2 < found["slip_margin"] < 0.8
    assert found["stick_ratio_area"] == pytest.approx(found["slip_margin"] ** 0.5, abs=1.0 / 20.0)


def _events(problem: Problem) -> dict[str, Any]:
    return _with_errors(problem, list(march(problem)), {})


def _with_errors(problem: Problem, steps: list[StepResult], errors: dict[str, float]) -> dict[str, Any]:
    margin = [measure(problem.points, step)["slip_margin"] for step in steps]
    return slip_events(problem.points, steps, margin, problem.model.readings, errors)


def _slid_ball(steps: int) -> dict[str, Any]:
    legs = (Leg(0.2, steps=4), Leg(0.2, steps=steps, slide_x_mm=0.4))
    taxel = Taxel("t1", 0.0, 0.0, 1.0, 1.0)
    return _events(build(block(object=Sphere(radius_mm=4.0), legs=legs, friction=Coulomb(MU), taxels=(taxel,))))


def test_a_ball_that_slides_slips_at_its_rim_then_in_the_middle_then_as_a_whole() -> None:
    coarse, fine = _slid_ball(8), _slid_ball(32)
    for found in (coarse, fine):
        rim, middle = found["first_slip"]["whole"], found["first_slip"]["taxel_t1"]
        assert rim["slide_x_mm"] < middle["slide_x_mm"] <= found["gross_slip"]["slide_x_mm"]
        assert abs(middle["x_mm"]) <= 0.5
        assert found["slip_margins"] == {"whole": 0.0, "taxel_t1": 0.0, "contact": 0.0}
    increment = 0.4 / 8
    assert coarse["gross_slip"]["slide_x_mm"] == pytest.approx(fine["gross_slip"]["slide_x_mm"], abs=0.5 * increment)
    middles = [found["first_slip"]["taxel_t1"]["slide_x_mm"] for found in (coarse, fine)]
    assert middles[0] == pytest.approx(middles[1], abs=0.5 * increment)


def test_the_error_of_gross_slip_is_that_of_mesh_and_increments() -> None:
    """A mesh of half the edges and increments of a third give an event within two bars, which are less than 0.1 mm."""

    def slid(size: float, times: int) -> Problem:
        legs = (Leg(0.2, steps=4 * times), Leg(0.2, steps=8 * times, slide_x_mm=0.4))
        mesh = MeshOptions(size, 1.5 * size, "swept")
        return build(block(object=Sphere(radius_mm=4.0), legs=legs, friction=Coulomb(MU), mesh=mesh))

    problem, fine = slid(0.6, 1), slid(0.3, 3)
    steps = list(march(problem))
    found = _with_errors(problem, steps, estimate(problem, steps).slip)["gross_slip"]
    assert found["error"].keys() == {"slide_x_mm"}
    assert 0.5 * 0.4 / 8 <= found["error"]["slide_x_mm"] <= 0.1
    missed = abs(found["slide_x_mm"] - _events(fine)["gross_slip"]["slide_x_mm"])
    assert missed <= 2.0 * found["error"]["slide_x_mm"]


def test_under_a_force_beyond_the_limit_gross_slip_is_the_last_pose_that_held() -> None:
    problem = build(block(object=Plane(), legs=(PRESS, held(1.5 * MU * N, 0.0, steps=3))))
    *held_steps, failed = march(problem)
    assert failed.outcome is Outcome.SLIPS
    found = _events(problem)
    assert found["gross_slip"]["step"] == len(held_steps) + 1
    assert found["gross_slip"]["slide_x_mm"] == held_steps[-1].target.slide_x_mm > 0.0


def test_nothing_slips_without_friction_or_without_a_motion_along_the_surface() -> None:
    slide = (Leg(0.1, steps=2), Leg(0.1, steps=2, slide_x_mm=0.2))
    smooth = _events(build(block(object=Plane(), legs=slide, friction=Coulomb(0.0))))
    assert (set(smooth["first_slip"].values()), smooth["gross_slip"]) == ({None}, None)
    assert _events(build(block(object=Plane(), legs=slide[:1], friction=Coulomb(MU_LOW))))["gross_slip"] is None
