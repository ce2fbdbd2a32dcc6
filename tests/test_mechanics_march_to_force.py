"""Where increments to a force begin: at the depth of small strain or of a power law, near a rough solution."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.equilibrium import by_power_law
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder
from tests.models import ended, small_section
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
