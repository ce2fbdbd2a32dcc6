"""Rules of stick and slip."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import SLIP, STICK, Coulomb, TwoCoefficients
from finger3d.contact.law import ContactLaw
from finger3d.contact.rules import RULES, STEP_DEPENDENT_RULES, RuleName
from finger3d.contact.state import ContactState
from tests.contact_cases import half_plane


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
