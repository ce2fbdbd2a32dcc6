"""Both derivatives at a kink: against one-sided differences of presses that end as a point changes its status."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.fem.laws import NeoHooke
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.sensitivity import derivatives, tangents
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.results.history import table_row
from finger3d.mechanics.small_strain.relaxation import Relaxation
from finger3d.mechanics.small_strain.variations import VariedBody
from finger3d.objects import Cylinder, Plane
from tests.differences import STEP, parameters, with_leg
from tests.models import small_section
from tests.test_mechanics_small_strain_increment_tangents import SOLID

NUMBERS = ("normal_force_N", "friction_sum_N", "tangential_force_x_N", "gauge_g", "external_work_mJ", "dissipation_mJ")
PRESS = (Leg(0.3, steps=1),)
HOLD = (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.0, steps=1))
TILTED = {"symmetry": (), "friction": Coulomb(0.1), "object": Plane(tilt=0.02)}
SECTION = small_section(legs=HOLD, **TILTED)
HELD = {
    "path": SECTION,
    "viscous": replace(
        SECTION,
        legs=tuple(replace(leg, steps=2, duration_s=1.0) for leg in HOLD),
        relaxation=Relaxation(((0.5, 1.0),), True),
    ),
    "bar": replace(SECTION, object=Cylinder(radius_mm=3.0, axis="z")),
    "solid": replace(SOLID, legs=HOLD, **TILTED),
    "large deformation": replace(SECTION, hyperelastic_law=NeoHooke(1.0)),
}


def assert_both_are_one_sided_differences(problem: Problem, names: Sequence[str]) -> int:
    """Compare derivatives by parameters outside the body; return how many differ on both sides."""
    model, kinks = problem.model, 0
    ways = parameters(model) | {"slide 1": with_leg(model, len(model.legs) - 1, "slide_x_mm")}
    exact = model.object.is_flat and not model.finite_strain
    # presses are solved to round-off, or to 5e-9, which a longer step divides, as the term of third order allows
    h, close = (1e-6, 1e-6) if exact else (3e-4, 1e-5)
    body = VariedBody(problem)
    variations = [body.variation(ways[name](-STEP), ways[name](STEP), STEP) for name in names]
    *_, (step, *both) = tangents(problem, variations)
    assert both[0] is not both[1]
    here = table_row(problem.points, step)
    for way, sides in zip((-1, 1), both, strict=True):
        for name, slopes in zip(names, derivatives(step, variations, sides, way), strict=True):
            one, two = (pressed(problem, ways[name](way * t)) for t in (h, 2.0 * h))
            for number in NUMBERS:
                difference = way * (4.0 * one[number] - two[number] - 3.0 * here[number]) / (2.0 * h)  # second order
                assert slopes[number] == pytest.approx(difference, rel=close, abs=close), (way, name, number)
    for k in range(len(names)):
        low, high = (derivatives(step, variations, sides)[k]["normal_force_N"] for sides in both)
        kinks += abs(high - low) > 1e-3
    return kinks


def pressed(problem: Problem, model: Model) -> dict[str, float]:
    """Numbers at the end of a press of the same body with another friction, path or relaxation."""
    changed = replace(problem.model, friction=model.friction, legs=model.legs, relaxation=model.relaxation)
    other = replace(problem, model=changed)
    *_, last = march(other)
    return table_row(problem.points, last)


@pytest.mark.parametrize(
    "case", ["path", "viscous", *(pytest.param(n, marks=pytest.mark.slow) for n in list(HELD)[2:])]
)
def test_after_a_hold_points_slip_on_or_back(case: str) -> None:
    problem = build(HELD[case])
    names = ["mu", "goal 0", "goal 1", "slide 1", *(["g 0", "duration 1"] if case == "viscous" else [])]
    assert assert_both_are_one_sided_differences(problem, names) == 3


@pytest.mark.parametrize("change", [(STICK, SLIP), (OPEN, STICK)], ids=["slips", "touches"])
def test_a_path_that_ends_at_an_event(change: tuple[int, int]) -> None:
    model = small_section(legs=PRESS, **TILTED)
    problem = build(model)
    events = next(march(problem)).path.events
    found = next(
        before.share
        for before, after in zip(events[1:], events[2:], strict=False)
        if np.any((before.state.status == change[0]) & (after.state.status == change[1]))
    )
    at_event = replace(problem, model=replace(model, legs=(Leg(0.3 * found, steps=1),)))
    assert assert_both_are_one_sided_differences(at_event, ("mu", "goal 0")) >= 1


def test_between_events_there_is_no_kink() -> None:
    model = replace(SECTION, legs=PRESS)
    problem, way = build(model), parameters(model)["mu"]
    *_, (_, falling, growing) = tangents(problem, [VariedBody(problem).variation(way(-STEP), way(STEP), STEP)])
    assert falling is growing
