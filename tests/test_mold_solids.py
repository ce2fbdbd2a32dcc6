"""Solids and features of molds."""

from __future__ import annotations

import math

import pytest

from finger3d.errors import Finger3dError
from finger3d.mold.solids import Feature, between, common, cone, cylinder, hexagon, one, part


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
def test_solids_start_at_their_point_and_run_along_their_axis(axis) -> None:
    sign, i = (-1.0 if axis.startswith("-") else 1.0), "xyz".index(axis[-1])
    for solid in (
        cylinder((1.0, 2.0, 3.0), 2.0, 5.0, axis),
        cone((1.0, 2.0, 3.0), 2.0, 1.0, 5.0, axis),
        hexagon((1.0, 2.0, 3.0), 2.0, 5.0, axis),
    ):
        box = solid.bounding_box()
        low, high = [*box.min][i], [*box.max][i]
        start, end = (low, high) if sign > 0 else (high, low)
        assert start == pytest.approx((1.0, 2.0, 3.0)[i], abs=1e-6)
        assert end - start == pytest.approx(5.0 * sign, abs=1e-6)


def test_volumes() -> None:
    assert cone((0, 0, 0), 4.0, 2.0, 3.0, "y").volume == pytest.approx(math.pi * (4.0 + 2.0 + 1.0))
    assert hexagon((0, 0, 0), 2.0, 1.0, "z").volume == pytest.approx(2.0 * math.sqrt(3.0))
    assert common(between((0, 0, 0), (2, 2, 2)), between((1, 1, 1), (3, 3, 3))) == pytest.approx(1.0)
    assert common(between((0, 0, 0), (1, 1, 1)), between((2, 2, 2), (3, 3, 3))) == 0.0


def test_pieces_are_refused() -> None:
    with pytest.raises(Finger3dError, match="lid.*2 pieces"):
        one(between((0, 0, 0), (1, 1, 1)) + between((2, 2, 2), (3, 3, 3)), "lid")


def test_a_part_has_what_features_add_and_lacks_what_they_cut() -> None:
    """Cuts come last, and other parts' features do nothing."""
    a, b = between((1, 0, 0), (3, 1, 1)), between((2, 0, 0), (4, 1, 1))
    features = [Feature(cut={"lid": [b]}), Feature(add={"lid": [a]}, cut={"half_a": [a]})]
    made = part("lid", between((0, 0, 0), (1, 1, 1)), features, "lid_skin")
    assert made.volume == pytest.approx(2.0)
    assert part("half_b", b, features, "half_b").volume == pytest.approx(2.0)
