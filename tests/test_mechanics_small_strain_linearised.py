"""Linearised increments: a correction solves the equations of the active set, and the adjoint is its transpose."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.mechanics.small_strain.linearised import LinearisedIncrement
from tests.models import block


def test_a_correction_annihilates_a_displacement_that_forces_of_the_active_set_cause() -> None:
    problem = build(block())
    step = next(march(problem))
    (_, before), (_, after) = step.parts[-2:]
    linear = LinearisedIncrement.of(problem, before.contact, after.contact)
    generator, size = np.random.default_rng(0), problem.surface.points.size
    unknowns = generator.normal(size=(len(linear.diagonal), 2))
    moved = problem.delassus.reshape(size, size) @ (linear.forces @ unknowns)
    assert linear.correction(moved, unknowns) == pytest.approx(unknowns, rel=1e-9)

    one, other = generator.normal(size=(2, size, 1))
    through = linear.forces @ linear.correction(one, np.zeros((len(linear.diagonal), 1)))
    assert float((through.T @ other)[0, 0]) == pytest.approx(float((one.T @ linear.adjoint(other))[0, 0]), rel=1e-9)


def test_without_contact_nothing_is_corrected() -> None:
    problem = build(block())
    rest = SmallStrain().start(problem).contact
    linear = LinearisedIncrement.of(problem, rest, rest)
    assert linear.correction(np.zeros((problem.surface.points.size, 1)), np.zeros((0, 1))).shape == (0, 1)
