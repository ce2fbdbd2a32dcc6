"""The values of validation/REFERENCES.md, computed again from their formulas.

Tolerances are half a unit of the last digit that the page gives, unless a comment says otherwise.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from validation import _spence, press_with_friction, viscous_sphere


def _eta(nu: float) -> float:
    return float(np.log(3.0 - 4.0 * nu) / (2.0 * np.pi))


def _stuck(t: float, nu: float) -> float:
    return float(np.cos(_eta(nu) * np.log((1.0 + t) / (1.0 - t))))


@pytest.mark.parametrize(
    ("nu", "mu", "stick"), [(0.0, 0.125, 0.00747), (0.3, 0.25, 0.59762), (0.0, 0.25, 0.17157), (0.3, 0.5, 0.96777)]
)
def test_stick_zone_without_coupling(nu: float, mu: float, stick: float) -> None:
    """2.1: K'(k)/K(k) = beta/mu."""
    ratio = ellipk(1.0 - stick**2) / ellipk(stick**2)
    slope = abs(ellipk(1.0 - (stick + 1e-6) ** 2) / ellipk((stick + 1e-6) ** 2) - ratio) / 1e-6
    assert ratio == pytest.approx(_spence.dundurs(nu) / mu, abs=1e-5 * slope)


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_press_of_a_cylinder_with_friction(nu: float) -> None:
    """2.1, mu = 0.25, and 2.5; `_spence.py` itself is exact to about 1e-4 of its values."""
    found = _spence.line(nu, 0.25)
    force, friction, dissipation = press_with_friction.INTEGRALS_LINE[nu]
    assert found.stick == pytest.approx(press_with_friction.C_OVER_A_LINE[nu, 0.25], abs=2e-5)
    assert found.force == pytest.approx(force, rel=1e-4)
    assert found.friction == pytest.approx(friction, rel=1e-3)
    assert found.dissipation == pytest.approx(dissipation, rel=2e-3)  # three digits are given
    if nu:
        assert np.abs(found.shear - press_with_friction.CURVE).max() < 2e-4
        slower = _spence.line(nu, 0.175)
        assert slower.stick == pytest.approx(0.263, abs=5e-4)
        assert slower.friction == pytest.approx(0.0773, abs=5e-5)


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_full_stick(nu: float) -> None:
    """2.3."""
    line = 1.0 / quad(lambda a: np.sin(a) * _stuck(np.sin(a), nu), 0.0, np.pi / 2.0, limit=400)[0]
    assert line == pytest.approx(press_with_friction.FULL_STICK_LINE[nu], abs=1e-6)

    def beyond(t: float) -> float:
        return float(quad(lambda w: w**2 / np.sqrt(1.0 - (t * w) ** 2), 0.0, 1.0)[0])  # w = 1/x

    grown = np.pi * _eta(nu)
    lifted = 0.5 - 2.0 / np.pi * np.cosh(grown) * quad(lambda t: _stuck(t, nu) * beyond(t), 0.0, 1.0, limit=200)[0]
    sphere = np.cosh(grown) * grown / np.sinh(grown) * np.sqrt(4.0 * lifted)
    assert sphere == pytest.approx(press_with_friction.FULL_STICK_SPHERE[nu], abs=1e-6)


@pytest.mark.parametrize(("time", "force"), viscous_sphere.TABLE.items())
def test_growing_contact_of_a_relaxing_body(time: float, force: float) -> None:
    """4.1."""
    assert viscous_sphere.lee_radok(time) == pytest.approx(force, abs=1e-7)


def test_published_benchmarks_follow_from_hertz() -> None:
    """6.2 and 6.4."""
    assert 20e3 / (1.0 - 0.3**2) * np.sqrt(2.0 * 4.0 / 50.0) / np.pi == pytest.approx(2798.3, abs=0.05)
    modulus = 1.0 / ((1.0 - 0.3**2) / 210e3 + (1.0 - 0.3**2) / 70e3)
    a = np.sqrt(4.0 * 35e3 * 50.0 / (np.pi * modulus))
    assert a == pytest.approx(6.2146, abs=5e-5)
    assert 2.0 * 35e3 / (np.pi * a) == pytest.approx(3585.36, abs=5e-3)
