"""Friction laws: coefficients that depend on status and on pressure, and the rules that solve with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import SLIP, Coulomb, FrictionLaw, TwoCoefficients
from finger3d.contact.law import ContactLaw
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.errors import Finger3dError, Outcome
from tests.contact_cases import half_plane, violation


@dataclass(frozen=True)
class Saturating(FrictionLaw):
    """mu(p) = mu / (1 + p / p0): the shear strength of the interface limits friction at high pressure."""

    p0_MPa: float

    def coefficients(self, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        return self.mu / (1.0 + np.maximum(pressure, 0.0) / self.p0_MPa)

    def updated(self, mu: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        return self.coefficients(status, pressure)


def test_a_point_slips_at_the_coefficient_of_its_own_pressure() -> None:
    compliance = np.eye(2).reshape(1, 2, 1, 2)  # one point on two unit springs, 1 N on 0.5 mm2
    free = np.array([[-1.0, -0.6]])
    state = ContactState.at_rest(np.zeros(1), 2)
    found = solve_increment(
        ContactProblem.of(state, free, compliance, ContactLaw(Saturating(0.9, 2.0)), 1.0, area=np.array([0.5]))
    )
    assert found.outcome.ok
    assert found.state.status[0] == SLIP
    assert found.state.force[0] == pytest.approx([1.0, 0.9 / (1.0 + 2.0 / 2.0)], abs=1e-12)


@pytest.mark.parametrize("guessed", [False, True])
def test_pressure_dependent_coefficients_agree_with_the_pressures_found(guessed: bool) -> None:
    compliance, gap, area = half_plane(41, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 41) ** 2, np.full(41, 0.05)
    law, state = Saturating(0.8, 0.3), ContactState.at_rest(gap, 2)
    for depth, slide in ((0.2, 0.0), (0.4, 0.0), (0.4, 0.05), (0.4, 0.5)):
        free = np.column_stack([gap - depth, np.full(41, -slide)])
        guess = np.full((41, 2), 0.01) if guessed else None
        found = solve_increment(ContactProblem.of(state, free, compliance, ContactLaw(law), 1.0, area=area), guess)
        assert found.outcome.ok
        mu = law.coefficients(found.state.status, found.state.force[:, 0] / area)
        assert np.ptp(mu[found.state.force[:, 0] > 0.0]) > 0.1
        assert violation(state, found.state, free, compliance, mu) <= 1e-8
        state = found.state
    assert (state.status == SLIP).any()


def test_coefficients_that_never_agree_are_reported() -> None:
    class Alternating(Coulomb):
        def updated(self, mu: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
            return 0.7 - mu

    state = ContactState.at_rest(np.zeros(1), 2)
    found = solve_increment(
        ContactProblem.of(
            state, np.array([[-1.0, -0.6]]), np.eye(2).reshape(1, 2, 1, 2), ContactLaw(Alternating(0.3)), 1.0
        )
    )
    assert found.outcome is Outcome.NO_CONVERGENCE
    assert found.state is state


@pytest.mark.parametrize("law", [Coulomb(0.3), TwoCoefficients(0.3, 0.5, "keep"), Saturating(0.3, 1.0)])
def test_with_mu_changes_nothing_else(law: FrictionLaw) -> None:
    assert law.with_mu(0.5) == type(law)(**(vars(law) | {"mu": 0.5}))
    assert law.largest == 0.3
    for value in (-1.0, float("nan"), True):
        with pytest.raises(Finger3dError, match="mu"):
            law.with_mu(value)
