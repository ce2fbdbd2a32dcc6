"""Rules of stick and slip."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import SLIP, STICK, Coulomb, TwoCoefficients
from finger3d.contact.law import ContactLaw
from finger3d.contact.rules import RULES, STEP_DEPENDENT_RULES, RuleName, maeno_active_set
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.errors import Outcome
from tests.contact_cases import half_plane, random_compliance, violation


def test_only_starting_all_stuck_depends_on_the_steps() -> None:
    assert TwoCoefficients(0.3, 0.5, "paper").depends_on_steps
    assert not TwoCoefficients(0.3, 0.5, "keep").depends_on_steps
    assert not Coulomb(0.3).depends_on_steps
    keep, paper = (TwoCoefficients(0.4, 0.5, b) for b in ("keep", "paper"))
    status, pressure = np.array([SLIP, STICK], dtype=np.int8), np.ones(2)
    assert keep.coefficients(status, pressure) == pytest.approx([0.2, 0.4])
    assert paper.coefficients(status, pressure) == pytest.approx([0.4, 0.4])


@pytest.mark.parametrize("name", RULES)
def test_every_rule_settles_a_normal_press(name: RuleName) -> None:
    gap = np.linspace(-1.0, 1.0, 21) ** 2
    free = np.column_stack([gap - 0.3, np.zeros(21)])
    found = RULES[name](
        ContactProblem.of(ContactState.at_rest(gap, 2), free, half_plane(21, 2, 0.0), ContactLaw(Coulomb(0.3)), 1.0)
    )
    assert found.outcome.ok


def test_rules_are_those_that_a_scene_may_name() -> None:
    assert set(RULES) == set(get_args(RuleName))
    assert set(RULES) > STEP_DEPENDENT_RULES


def test_where_it_settles_it_agrees_with_the_projection() -> None:
    compliance, gap = half_plane(21, 2, 0.2), np.linspace(-1, 1, 21) ** 2
    a = b = ContactState.at_rest(gap, 2)
    for depth in np.linspace(0.05, 0.5, 10):
        free = np.column_stack([gap - depth, np.zeros(21)])
        literal = maeno_active_set(ContactProblem.of(a, free, compliance, ContactLaw(Coulomb(0.25)), depth))
        assert literal.outcome is Outcome.CONVERGED
        assert literal.method == "paper"
        a, b = (
            literal.state,
            solve_increment(ContactProblem.of(b, free, compliance, ContactLaw(Coulomb(0.25)), depth)).state,
        )
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force).max() < 1e-12


def test_a_cycle_is_reported_and_never_called_converged() -> None:
    rng = np.random.default_rng(3)
    outcomes = set()
    for _ in range(200):
        compliance = random_compliance(rng, 6, 2)
        state = ContactState.at_rest(np.zeros(6), 2)
        for _ in range(3):
            free = rng.normal(size=(6, 2))
            found = maeno_active_set(ContactProblem.of(state, free, compliance, ContactLaw(Coulomb(0.8)), 1.0))
            outcomes.add(found.outcome)
            if not found.outcome.ok:
                assert found.residual > 1e-8
                break
            assert violation(state, found.state, free, compliance, 0.8) <= 1e-8
            state = found.state
    assert outcomes == {Outcome.CONVERGED, Outcome.CYCLED, Outcome.WRONG_WAY}
