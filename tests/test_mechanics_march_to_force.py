"""Where increments to a force begin: at the depth of small strain or of a power law, near a rough solution."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.parts import Substep
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.to_force import (
    by_power_law,
    expected_depth,
    forces_on,
    is_near,
    normal_force,
)
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, Move, ObjectPose
from tests.models import block, ended, small_section
from tests.viscous_cases import TWO


@pytest.mark.parametrize("power", [0.5, 2.0 / 3.0, 1.0])  # a cylinder, a ball, and a flat punch
def test_the_depth_follows_the_power_law_of_the_last_increment(power: float) -> None:
    (d0, d1, d2), (f0, f1, f2) = (tuple(f**power for f in (1.0, 2.0, 7.0))), (1.0, 2.0, 7.0)
    assert by_power_law((d0, f0), (d1, f1), f2) == pytest.approx(d2, rel=1e-14)
    assert by_power_law((d2, f2), (d1, f1), f0) == pytest.approx(d0, rel=1e-14)


def test_without_a_power_the_depth_is_that_of_a_ball_or_one_stride_on() -> None:
    assert by_power_law((0.0, 0.0), (1.0, 1.0), 8.0) == pytest.approx(4.0)
    assert by_power_law((0.9, 1.0), (1.0, 1.0), 1.0) == 1.0
    assert by_power_law((0.9, 1.0), (1.0, 1.01), 2.02) == 2.0  # no softer than a punch
    assert by_power_law((0.5, 2.0), (-0.25, 1.0), 2.0) == -1.0


def test_a_body_at_rest_is_expected_at_the_depth_of_small_strain() -> None:
    problem, last = ended(block(legs=(Leg(0.3, steps=1),), friction=Coulomb(0.0)))
    force = measure(problem.points, last)["normal_force_N"]
    large = replace(problem, model=LargeDeformation().apply(problem.model))
    for forecast_mm in (0.05, 0.3, 1.5):
        move = Move(ObjectPose(0.0), ObjectPose(forecast_mm))
        # two increments by power laws, of which the second has the power between the two: an estimate
        assert expected_depth(large, None, move, (0.0, force), 1.0) == pytest.approx(0.3, rel=0.1)
        assert expected_depth(problem, None, move, (0.0, force), 1.0) == forecast_mm


def test_a_later_depth_is_that_of_the_power_law() -> None:
    problem, last = ended(block(legs=(Leg(0.1, steps=1),)))
    (_, before), (pose, after) = last.parts[-2:]
    part = Substep(before, after, Move(last.parts[-2][0], pose))
    now = normal_force(problem, after)
    assert forces_on(problem, after) == pytest.approx([now, 0.0, 0.0], abs=1e-12)
    assert expected_depth(problem, part, Move(pose, ObjectPose(0.3)), (now, 2.0 * now), 1.0) == pytest.approx(
        by_power_law((0.025, normal_force(problem, before)), (0.1, now), 2.0 * now), rel=1e-14
    )


def test_a_relaxing_body_has_the_force_at_the_depth_where_it_is_reached() -> None:
    # the rough solution of the second leg is found in halves, and the increment takes all of its time
    first = Leg(0.3, steps=2, duration_s=1.0)
    model = small_section(
        symmetry=(), hyperelastic_law=NeoHooke(1.0), object=Cylinder(radius_mm=3.0, axis="z"),
        material=Isotropic(1.0, 0.49), relaxation=Relaxation(TWO, False),
        legs=(first, Leg(0.3, force_N=0.5, steps=2, duration_s=0.3)),
    )  # fmt: skip
    *_, under_force, _ = march(build(model))
    depth = under_force.target.depth_mm
    problem, last = ended(replace(model, legs=(first, Leg(depth, steps=1, duration_s=0.15))))
    pair = (measure(problem.points, step) for step in (under_force, last))
    one, other = (entry["normal_force_N"] for entry in pair)
    assert one == pytest.approx(other, rel=1e-6)


def test_an_iteration_to_a_force_begins_within_a_factor_of_five() -> None:
    assert [is_near(force, 10.0) for force in (1.9, 2.1, 49.0, 51.0, float("nan"))] == [False, True, True, False, False]
