"""Checks of dimensions, made before CAD is called: CAD builds a wrong body of impossible dimensions, or hangs."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from finger3d._ranges import LARGEST_MM, SMALLEST_MM, at_most
from finger3d.errors import Finger3dError


def check_dimensions(design: str, dimensions: Mapping[str, object], may_be_zero: Collection[str] = ()) -> None:
    """Raise a Finger3dError unless every dimension is a number from 1e-2 to 1e4 mm, or 0 where that is allowed."""
    for key, value in dimensions.items():
        zero = key in may_be_zero
        allowed = f"{'0 or ' if zero else ''}{SMALLEST_MM:g} to {LARGEST_MM:g} mm"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Finger3dError(f"{design}: {key} = {value!r} is not a number; allowed: {allowed}")
        if zero and value == 0:
            continue
        if not math.isfinite(value) or not SMALLEST_MM <= value <= LARGEST_MM:
            raise Finger3dError(f"{design}: {key} = {value:g} is out of range; allowed: {allowed}")


def check_at_most(design: str, dimensions: Mapping[str, float], key: str, other: str) -> None:
    """Raise a Finger3dError if the dimension `key` is larger than the dimension `other`."""
    value, limit = dimensions[key], dimensions[other]
    if value > limit:
        raise Finger3dError(f"{design}: {key} = {value:g} is too large; allowed: at most {other} = {at_most(limit)}")
