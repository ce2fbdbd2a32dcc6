"""State of a press."""

from __future__ import annotations

import pytest

from tests.models import half_cylinder, run


def test_arrays_of_a_state_cannot_be_changed() -> None:
    _, steps = run(half_cylinder(1.0, steps=1))
    with pytest.raises(ValueError, match="read-only"):
        steps[-1].meshed_state.body[0] = 0.0
