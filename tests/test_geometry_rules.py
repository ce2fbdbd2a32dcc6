"""Dimensions that do not fit together."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from tests.designs import make


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"half_length_mm": 101.0}, "half_length_mm = 101 .*radius_mm = 100"),
        ({"edge_height_mm": 120.0}, "edge_height_mm = 120 .*radius_mm = 100"),
    ],
)
def test_dimensions_that_do_not_fit_together_name_key_value_and_limit(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text):
        make("clipped_cylinder", **changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"skin_mm": 8.0}, r"skin_mm = 8: .*below 2 mm"),
        ({"half_length_mm": 10.0}, r"skin_mm = 1: .*half_length_mm .*radius_mm"),
        ({"edge_height_mm": 0.2, "skin_mm": 1.0}, r"skin_mm = 1: .*below 0\.1"),
        ({"core_height_mm": 0.0}, r"core_height_mm = 0, .*core_half_length_mm"),
        ({"core_half_length_mm": 0.0}, r"core_half_length_mm = 0, .*core_height_mm"),
        ({"core_half_length_mm": 8.5}, r"core_half_length_mm = 8\.5 .*at most 8 mm"),
        ({"core_height_mm": 10.9}, r"core_height_mm = 10\.9: .*below 10\.4"),
        ({"core_height_mm": 11.9, "skin_mm": 0.0}, r"core_height_mm = 11\.9: "),
    ],
)
def test_parts_that_overlap_are_refused_in_one_line(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text) as refused:
        make("fingertip", **changes)
    assert "\n" not in str(refused.value)


def test_a_skin_leaves_something_of_a_block() -> None:
    with pytest.raises(Finger3dError, match=r"block: skin_mm = 15: .*below 15 mm"):
        make("block", skin_mm=15.0)
