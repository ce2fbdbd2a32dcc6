"""Derivatives of the contact at the end of an increment by the displacements of the points."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.model import Leg
from finger3d.mechanics.small_strain.contact_slopes import ContactEnd
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.mechanics.small_strain.linear_contact import Increment, LinearBody
from finger3d.objects import Cylinder, DistanceTracker, Move, ObjectPose
from tests.models import block, run, small_section

CURVED = {
    "section": small_section(
        object=Cylinder(radius_mm=3.0, axis="z", x_mm=0.5), symmetry=(), legs=(Leg(0.4, steps=1),)
    ),
    "solid": block(symmetry=(), legs=(Leg(0.3, steps=1),)),
}


@pytest.mark.parametrize("name", CURVED)
def test_slopes_are_those_of_any_displacement(name: str) -> None:
    problem, (step,) = run(CURVED[name])
    contact, place = step.meshed_state.contact, step.meshed_state.body
    body = LinearBody(problem.delassus, np.zeros_like(place))
    move = Move(problem.origin, ObjectPose(0.3, slide_x_mm=0.05))
    own = ContactEnd.of(Increment(problem, SmallStrain().start(problem), move, body, DistanceTracker()), place)
    of_conditions, of_means = own.slopes(contact)
    change = np.random.default_rng(1).normal(size=place.shape)
    low, high = (ContactEnd.of(own.increment, place + t * change) for t in (-1e-6, 1e-6))
    wanted = (high.conditions(contact) - low.conditions(contact)) / 2e-6
    found = (of_conditions @ change.ravel()).reshape(wanted.shape)
    assert found == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())
    # the same by the slopes of the means
    t = 1e-6
    moved = own.moved(t * change, t * (of_means @ change.ravel()).reshape(len(change), -1))
    assert moved.conditions(contact) == pytest.approx(high.conditions(contact), abs=1e-10)
