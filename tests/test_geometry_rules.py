"""Dimensions that do not fit together."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from tests.designs import make


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"half_length_mm": 101.0}, "half_length_mm = 101 is too large; allowed: at most radius_mm = 100"),
        ({"edge_height_mm": 120.0}, "edge_height_mm = 120 is too large; allowed: at most radius_mm = 100"),
    ],
)
def test_dimensions_that_do_not_fit_together_name_key_value_and_limit(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text):
        make("clipped_cylinder", **changes)
