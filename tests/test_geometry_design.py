"""Designs: dimensions that are checked, and their upper surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import labelled_faces
from tests.designs import GOOD, make


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 1e-3, 2e4, "5", True])
def test_every_dimension_refuses_what_is_no_length(name: str, value: Any) -> None:
    for key in GOOD[name]:
        with pytest.raises(Finger3dError) as refused:
            make(name, **{key: value})
        message = str(refused.value)
        assert key in message
        assert "allowed" in message
        assert "\n" not in message


MAY_BE_ZERO = {"edge_height_mm", "skin_mm"}


def test_zero_is_allowed_for_the_edge_height_and_for_parts_only() -> None:
    assert make("clipped_cylinder", edge_height_mm=0.0).height_mm == pytest.approx(100.0 - math.sqrt(7500.0))
    for name, dimensions in GOOD.items():
        for key in set(dimensions) - MAY_BE_ZERO:
            with pytest.raises(Finger3dError, match=key):
                make(name, **{key: 0.0})


@pytest.mark.parametrize("name", GOOD)
def test_top_lies_on_the_cad_surface_and_is_nan_beyond_it(name: str) -> None:
    from build123d import Vector

    design = make(name)
    contact = next(f for f in labelled_faces(design.solid()) if f.label == "contact")
    x = np.linspace(-0.6, 0.6, 5) * design.half_length_mm
    z = np.linspace(-0.3, 0.25, 5) * design.width_mm
    for point in zip(x, design.top(x, z), z, strict=True):
        assert contact.distance_to(Vector(*map(float, point))) < 1e-9
    far = 1.01 * design.half_length_mm
    beyond = design.top(np.array([far, -far, 0.0, 0.0]), np.array([0.0, 0.0, 0.51, -0.51]) * design.width_mm)
    assert np.isnan(beyond).all()
    rim = design.top(np.array([design.half_length_mm, -design.half_length_mm]), np.zeros(2))
    assert np.isfinite(rim).all()


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
