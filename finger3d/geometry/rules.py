"""Checks of dimensions, made before CAD is called: from impossible dimensions CAD builds a wrong body, or hangs."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from finger3d._ranges import LARGEST_MM, SMALLEST_MM, at_most
from finger3d.errors import Finger3dError
from finger3d.geometry.section import Arc, Section, largest_core_mm, largest_layer_mm


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


def check_layer(design: str, outline: Section, skin_mm: float) -> None:
    """Raise a Finger3dError for a skin (mm) that does not end on the section's walls, or without walls on its base."""
    limit = largest_layer_mm(outline)
    if skin_mm and not skin_mm < limit:
        walls = outline.edge_height_mm > 0.0 and isinstance(outline.contact, Arc)
        end = "does not end on the walls" if walls else "reaches the base"
        allowed = f"0, or below {at_most(limit)} mm" if limit > SMALLEST_MM else "0, or half_length_mm below radius_mm"
        raise Finger3dError(f"{design}: skin_mm = {skin_mm:g}: the skin {end}; allowed: {allowed}")


def check_core(design: str, section: Section, half_length_mm: float, height_mm: float) -> None:
    """Raise a Finger3dError for a core (mm) with one dimension zero, or one that leaves the section below its skin."""
    if bool(half_length_mm) != bool(height_mm):
        zero, other = ("core_height_mm", "core_half_length_mm")[:: 1 if half_length_mm else -1]
        raise Finger3dError(f"{design}: {zero} = 0, but {other} is not; allowed: both 0, or neither")
    if not half_length_mm:
        return
    longest = section.inner.half_length_mm
    if half_length_mm > longest:
        raise Finger3dError(
            f"{design}: core_half_length_mm = {half_length_mm:g} is too long; allowed: at most {at_most(longest)} mm"
        )
    limit = largest_core_mm(section, half_length_mm)
    if not height_mm < limit:
        what = "runs into the skin" if section.layer else "reaches the contact face"
        allowed = f"below {at_most(limit)} mm for core_half_length_mm = {half_length_mm:g}"
        raise Finger3dError(f"{design}: core_height_mm = {height_mm:g}: the core {what}; allowed: {allowed}")
