"""Contact states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP
from finger3d.contact.state import ContactState, next_state, pressure
from finger3d.fem.tensors import bases_of


def test_slip_adds_up_while_a_point_touches_and_displacement_always() -> None:
    rest = ContactState.at_rest(np.ones(2), 2)
    moved, force = np.array([[0.0, 0.1], [0.2, 0.3]]), np.array([[1.0, 0.5], [0.0, 0.0]])
    status = np.array([SLIP, OPEN], dtype=np.int8)
    after = next_state(next_state(rest, force, moved, status), force, moved, status)
    assert after.tangential_displacement[:, 0] == pytest.approx([0.2, 0.6])
    assert after.accumulated_slip[:, 0] == pytest.approx([0.2, 0.0])
    assert after.gap == pytest.approx([0.0, 0.2])


def test_forces_are_turned_into_the_scene_by_the_directions_of_their_points() -> None:
    normal = np.array([[0.0, -1.0, 0.0], [0.6, -0.8, 0.0]])
    state = replace(
        ContactState.at_rest(np.zeros(2), 3), force=np.array([[1.0, 2.0, 3.0], [5.0, 0.0, 0.0]]), bases=bases_of(normal)
    )
    assert state.scene_force == pytest.approx(np.array([[2.0, -1.0, 3.0], [3.0, -4.0, 0.0]]))
    assert state.of_points(np.array([1])).scene_force == pytest.approx(np.array([[3.0, -4.0, 0.0]]))
    with pytest.raises(ValueError, match="directions"):
        _ = ContactState.at_rest(np.zeros(2), 3).scene_force


def test_pressure_is_unknown_without_an_area() -> None:
    force = np.array([[2.0, 1.0], [3.0, 0.0]])
    assert pressure(force, np.array([4.0, 0.5])) == pytest.approx([0.5, 6.0])
    assert np.isnan(pressure(force, None)).all()
