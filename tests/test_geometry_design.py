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
