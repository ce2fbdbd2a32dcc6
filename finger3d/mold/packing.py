"""Parts as they lie on the bed of a printer, and their places on one bed or several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.mold.shell import Shell

GAP_MM = 6.0
"""Distance between parts on the bed."""

_OUTER_FACE_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_LYING = {
    "half_a": np.diag([-1.0, 1.0, -1.0]),
    "half_b": np.eye(3),
    "plug_a": np.diag([-1.0, 1.0, -1.0]),
    "plug_b": np.eye(3),
    "button": np.eye(3),
    "coupon": np.eye(3),
}
"""Rotation of parts onto the bed, their outer face down and z up; the other parts belong to the lid."""


def as_printed(parts: Mapping[str, Shell]) -> dict[str, Shell]:
    """Return the parts as they lie on the bed, each with its lowest corner at the origin."""
    lying = {name: part.moved(_LYING.get(_kind(name), _OUTER_FACE_DOWN), np.zeros(3)) for name, part in parts.items()}
    return {name: part.moved(np.eye(3), -part.surface.low) for name, part in lying.items()}


def _kind(name: str) -> str:
    if name.startswith("plug"):
        return f"plug_{name[-1]}"
    return name if name in _LYING else name.split("_")[0]


@dataclass(frozen=True)
class Bed:
    """Parts on one bed: `placed` in their places, `extent` (3,) their size together, mm, and whether they fit."""

    placed: dict[str, Shell]
    extent: Float
    fits: bool


def beds(printed: Mapping[str, Shell], bed_mm: tuple[float, float, float]) -> list[Bed]:
    """Return the parts on as many beds as they need, side by side; a part too large lies alone on a bed.

    Parameters
    ----------
    printed : parts as they lie, see :func:`as_printed`
    bed_mm : length, width and height of the printer
    """
    left = dict(sorted(printed.items(), key=lambda item: -float(item[1].extent[0] * item[1].extent[1])))
    packed = []
    while left:
        chosen = _pack(left, bed_mm)
        fits = bool(chosen)
        if not fits:
            name, part = next(iter(left.items()))
            chosen = {name: part}
        for name in chosen:
            del left[name]
        high = np.max([part.surface.high for part in chosen.values()], axis=0)
        low = np.min([part.surface.low for part in chosen.values()], axis=0)
        fits = fits and bool(high[2] <= bed_mm[2])
        if fits:
            middle = np.array([*(0.5 * (np.array(bed_mm[:2]) - high[:2] - low[:2])), 0.0])
            chosen = {name: part.moved(np.eye(3), middle) for name, part in chosen.items()}
        packed.append(Bed(chosen, high - low, fits))
    return packed


def _pack(parts: Mapping[str, Shell], bed_mm: tuple[float, float, float]) -> dict[str, Shell]:
    """Return the parts that fit on one bed, in their places, the largest first."""
    from trimesh.path.packing import rectangles_single

    size = np.array([bed_mm[0], bed_mm[1]]) + GAP_MM  # the last gap may lie outside
    tried = {
        name: part
        for name, part in parts.items()
        if (np.sort(part.extent[:2]) <= np.sort(bed_mm[:2])).all() and part.extent[2] <= bed_mm[2]
    }
    if not tried:
        return {}
    extents = np.array([part.extent[:2] for part in tried.values()]) + GAP_MM
    bounds, consumed = rectangles_single(extents, size=size)
    names = [name for name, taken in zip(tried, consumed, strict=True) if taken]
    placed = {}
    for name, (low, high) in zip(names, bounds, strict=True):
        part = tried[name]
        if abs((high - low - GAP_MM)[0] - part.extent[0]) > 1e-6:
            part = part.moved(_TURNED, np.zeros(3))
            part = part.moved(np.eye(3), -part.surface.low)
        placed[name] = part.moved(np.eye(3), np.array([low[0], low[1], 0.0]))
    return placed
