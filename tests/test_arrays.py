"""Arrays of frozen dataclasses cannot be written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.state import ContactState
from tests.meshes import grid


def test_arrays_and_arrays_in_mappings_are_read_only() -> None:
    mesh = grid((2, 2))
    with pytest.raises(ValueError, match="read-only"):
        mesh.points[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.facets["x-"][0] = 0
    with pytest.raises(ValueError, match="read-only"):
        replace(mesh, points=mesh.points + 1.0).points[0] = 1.0


def test_the_array_that_was_passed_stays_writable() -> None:
    gap = np.ones(3)
    state = ContactState.at_rest(gap, 2)
    gap[0] = 2.0
    assert state.gap[0] == 2.0
