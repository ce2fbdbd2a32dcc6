"""Kinetic friction."""

from __future__ import annotations

import numpy as np
import pytest


def test_a_point_that_slips_keeps_the_kinetic_limit_until_it_sticks() -> None:
    from finger3d.contact.conditions import ContactProblem
    from finger3d.contact.friction import SLIP, STICK, TwoCoefficients
    from finger3d.contact.law import ContactLaw
    from finger3d.contact.solve import solve_increment
    from finger3d.contact.state import ContactState

    compliance = np.eye(2).reshape(1, 2, 1, 2)  # one point on two unit springs
    law = ContactLaw(TwoCoefficients(0.5, 0.6, "keep"))
    state = ContactState.at_rest(np.array([0.0]), 2)
    wanted = [(0.2, STICK, 0.2), (0.6, SLIP, 0.3), (0.7, SLIP, 0.3), (0.6, STICK, 0.2), (0.3, STICK, -0.1)]
    for slide, status, friction in wanted:
        state = solve_increment(ContactProblem.of(state, np.array([[-1.0, -slide]]), compliance, law, 1.0)).state
        assert state.status[0] == status
        assert state.force[0, 1] == pytest.approx(friction, abs=1e-12)
    # after it stuck the static limit counts again
    state = solve_increment(ContactProblem.of(state, np.array([[-1.0, 0.1]]), compliance, law, 1.0)).state
    assert (state.status[0], state.force[0, 1]) == (STICK, pytest.approx(-0.5, abs=1e-9))
