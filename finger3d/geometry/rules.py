"""Rules on dimensions, checked before any CAD is called: CAD answers impossible ones with a wrong body, or hangs."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from finger3d._ranges import LARGEST_MM, SMALLEST_MM, at_most
from finger3d.errors import Finger3dError


def check_dimensions(design: Any, *, zero_allowed: tuple[str, ...] = ()) -> None:
    """Refuse a dimension of a design that is no finite number within 1e-2..1e4 mm (or exactly 0 where allowed)."""
    for field in dataclasses.fields(design):
        value = getattr(design, field.name)
        zero = field.name in zero_allowed
        allowed = f"{'0 or ' if zero else ''}{SMALLEST_MM:g} to {LARGEST_MM:g} mm"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Finger3dError(f"{design.name}: {field.name} = {value!r} is not a number; allowed: {allowed}")
        if zero and value == 0:
            continue
        if not math.isfinite(value) or not SMALLEST_MM <= value <= LARGEST_MM:
            raise Finger3dError(f"{design.name}: {field.name} = {value:g} is out of range; allowed: {allowed}")


def check_at_most(design: Any, key: str, other: str) -> None:
    """Refuse a design whose dimension `key` is larger than its dimension `other`."""
    value, limit = getattr(design, key), getattr(design, other)
    if value > limit:
        raise Finger3dError(
            f"{design.name}: {key} = {value:g} is too large; allowed: at most {other} = {at_most(limit)}"
        )
