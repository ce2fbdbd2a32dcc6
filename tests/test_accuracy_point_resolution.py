"""What the contact points resolve of lengths and of friction."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.estimate import estimate, main_numbers, press_numbers
from finger3d.accuracy.point_resolution import PointResolution
from finger3d.accuracy.richardson import mesh_error
from finger3d.contact.friction import OPEN, STICK, Coulomb
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Plane
from tests.models import block, half_cylinder, run, swept_fig9


def test_a_length_is_never_better_than_its_ends_are_resolved() -> None:
    same, name = {"contact_half_length_mm": 3.0}, "contact_half_length_mm"
    own, other = (PointResolution(h, h / 2.0, least={name: 0.2 * h}) for h in (0.2, 0.4))
    assert mesh_error(same, same, 2.0, (own, other)) == {name: pytest.approx(0.04)}
    # what the companion's points leave open is no change
    assert mesh_error(same, {name: 3.08}, 2.0, (own, other)) == {name: pytest.approx(0.04)}


@pytest.mark.parametrize(("mu", "least"), [(0.25, 0.375 * 0.25), (0.0, 0.0)])
@pytest.mark.parametrize("size", [3.0, 2.5])
def test_a_contact_no_longer_than_the_spacing_tells_nothing_of_friction(size: float, mu: float, least: float) -> None:
    # on the plane of symmetry it has none, on the companion either; with friction on, "0 +- 0" would be a lie
    model = replace(half_cylinder(3.0), mesh=MeshOptions(size, 5.0 * size / 3.0, "swept"), legs=(Leg(0.6, steps=10),))
    problem, frames = run(replace(model, friction=Coulomb(mu)))
    told, found = main_numbers(problem, frames[-1]), estimate(problem, frames)
    assert told["friction_sum_N"] == pytest.approx(0.0, abs=1e-12)
    # with edges of 0.1 mm it is 0.114 of the force, within two bars
    assert found.discretisation["friction_sum_N"] == pytest.approx(least * told["normal_force_N"], abs=1e-12)


def test_a_stick_zone_one_row_wide_is_not_resolved() -> None:
    # Fig. 9 at 2 mm: the points that stick are a single row at z = 0; at 0.75 mm, 10 increments, the stick length is
    # 62.1 mm and the area 171.5 mm2
    problem, frames = run(swept_fig9(2.0, mu=0.25, nu=0.49))
    told, found = main_numbers(problem, frames[-1]), estimate(problem, frames).discretisation
    points, sticks = problem.points, frames[-1].state.status == STICK
    assert (points.points[sticks, 2] == 0.0).all()
    assert abs(2.0 * told["stick_half_length_mm"] - 62.1) <= 2.0 * 2.0 * found["stick_half_length_mm"]
    assert abs(told["stick_area_mm2"] - 171.5) <= 2.0 * found["stick_area_mm2"]
    # little is known of a zone that thin, and of its length less than of its points
    assert found["stick_half_length_mm"] >= 0.4 * told["stick_half_length_mm"]
    assert found["stick_area_mm2"] >= 0.3 * told["stick_area_mm2"]
    # contact is eleven rows wide and resolved: known to less than half the spacing of 1.96 mm
    assert found["contact_half_length_mm"] < 0.5 * 1.96


def test_the_length_of_a_contact_with_one_point_is_known_to_what_the_point_stands_for() -> None:
    # edges as long as the finger is high; on a fine mesh the half-length of contact is 2.43 mm
    model = replace(half_cylinder(3.0), mesh=MeshOptions(3.0, 5.0, "swept"))
    problem, frames = run(model)
    told, found = main_numbers(problem, frames[-1]), PointResolution.of(problem, frames[-1])
    bar = found.least["contact_half_length_mm"]
    assert abs(told["contact_half_length_mm"] - 2.43) <= 2.0 * bar
    assert 0.04 * math.pi * 5.0 <= bar <= 0.25 * math.pi * 5.0


def test_the_contact_length_at_the_end_has_the_resolution_of_the_points_there() -> None:
    problem, frames = run(swept_fig9(4.0))
    found = estimate(problem, frames, numbers=press_numbers).discretisation["contact_half_length_end_mm"]
    x, nearest = problem.points.end_line()
    touching = np.sort(x[frames[-1].state.status[nearest] != OPEN])
    following = np.sort(x)[np.searchsorted(np.sort(x), touching[-1]) + 1]
    # on a mesh of 0.5 mm at the edge of contact it is 36.098 mm, a tenth of the spacing less than here
    told = press_numbers(problem, frames[-1])["contact_half_length_end_mm"]
    assert abs(told - 36.098) <= 2.0 * found
    assert 0.05 * (following - touching[-1]) <= found <= 0.25 * (following - touching[-1])


@pytest.mark.parametrize(("size", "release"), [(0.25, 0.02), (0.5, 0.05), (0.8, 0.1)])
def test_friction_that_few_points_keep_after_a_release_is_known_to_a_share_of_its_limit(
    size: float, release: float
) -> None:
    """Against edges of 0.02 mm."""
    legs = (Leg(0.3, steps=10), Leg(release, steps=10))
    model = replace(half_cylinder(3.0), domain="plane-strain", friction=Coulomb(0.3), legs=legs)
    found, bars = [], []
    for edge in (0.02, size):
        problem, frames = run(replace(model, mesh=MeshOptions(edge, 1.0, "swept")))
        found.append(main_numbers(problem, frames[-1]))
        bars.append(estimate(problem, frames).discretisation["friction_sum_N"])
    assert abs(found[1]["friction_sum_N"] - found[0]["friction_sum_N"]) <= 2.0 * bars[1]
    assert bars[1] <= 0.3 * found[1]["normal_force_N"]  # its limit
    assert bars[0] < 0.1 * bars[1]


def test_the_area_of_a_face_that_touches_as_a_whole_is_known_to_its_rim() -> None:
    finger = block(object=Plane(), domain="plane-strain", legs=(Leg(0.2, steps=1),))
    problem, frames = run(finger)
    told, found = main_numbers(problem, frames[-1]), estimate(problem, frames).discretisation
    assert 0.0 < found["contact_area_mm2"] < 0.1 * told["contact_area_mm2"]
