"""Extents of contact and stick: between the points, where the traction would vanish."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.state import ContactState
from finger3d.mechanics.results.zones import ERROR_AT_ENDS, half_extents, zone_ends


def cattaneo(x: np.ndarray, half_length: float, stick: float, mu: float = 0.3) -> ContactState:
    """Hertz' pressure under the friction of Cattaneo's cylinder (Johnson 1985, Eqs. 3.39 and 7.28), sampled."""
    pressure = np.sqrt(np.maximum(1.0 - (x / half_length) ** 2, 0.0))
    relief = stick / half_length * np.sqrt(np.maximum(1.0 - (x / stick) ** 2, 0.0))
    status = np.where(pressure <= 0.0, OPEN, np.where(relief > 0.0, STICK, SLIP)).astype(np.int8)
    zero = np.zeros((len(x), 1))
    return ContactState(status, np.stack([pressure, mu * (pressure - relief)], axis=1), np.zeros(len(x)), zero, zero)


@pytest.mark.parametrize("shift", np.linspace(0.0, 0.9, 7))
def test_ends_are_known_better_than_the_points(shift: float) -> None:
    x = np.arange(-12.0, 12.0) + shift
    state = cattaneo(x, 8.3, 5.1)
    contact, stick = half_extents(x, np.arange(len(x)), state, np.ones(len(x)))
    # exact but for the mean with the middle between the points, a quarter of their distance
    assert contact == pytest.approx(8.3, abs=0.26)
    assert stick == pytest.approx(5.1, abs=0.26)
    assert 0.26 <= 2.0 * min(ERROR_AT_ENDS.values())


def test_the_order_of_the_points_does_not_matter() -> None:
    x = np.arange(-12.0, 12.0)
    state = cattaneo(x, 8.3, 5.1)
    mixed = np.random.default_rng(0).permutation(len(x))
    assert half_extents(x[mixed], mixed, state, np.ones(len(x))) == half_extents(
        x, np.arange(len(x)), state, np.ones(len(x))
    )


def test_a_zone_that_reaches_the_last_point_ends_there() -> None:
    x = np.arange(5.0)
    state = cattaneo(x - 2.0, 100.0, 50.0)
    assert zone_ends(x, np.arange(5), state, np.ones(5)) == ((0.0, 4.0), (0.0, 4.0))


def test_one_point_reaches_halfway_to_its_neighbours_and_none_nowhere() -> None:
    x = np.arange(5.0)
    one = cattaneo(x - 2.0, 0.5, 0.4)
    assert zone_ends(x, np.arange(5), one, np.ones(5)) == ((1.5, 2.5), (1.5, 2.5))
    assert half_extents(x, np.arange(5), cattaneo(x + 100.0, 1.0, 0.5), np.ones(5)) == (0.0, 0.0)
