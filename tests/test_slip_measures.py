"""Stick ratios and slip margins, against Coulomb's law for a flat contact and Mindlin's for a ball."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import SLIP, STICK, Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import contact_table, measure
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
