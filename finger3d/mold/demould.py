"""Undercuts of a cast body, which decide whether the halves of the mold can be removed from it.

An undercut is a place where the half cannot move along the opening direction without pressing into the body; its depth
is the distance by which the half's material protrudes, across the opening direction, into the shadow of the body above
it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.mold.body import Body
from finger3d.mold.options import MoldOptions
from finger3d.mold.regions import manifold, triangles

if TYPE_CHECKING:
    from manifold3d import CrossSection


_ON_PLANE_MM = 1e-6  # distance at which a face lies on a plane
_LEAST_UNDERCUT_MM = 0.04  # largest chord tolerance of the printers: triangles of a smooth body have as much
_LEVELS = 24  # heights of a half at which its undercut is measured
_DEPTH_TOLERANCE = 1e-3  # of the depth, relative


@dataclass(frozen=True)
class Undercut:
    """Depth of a body's deepest undercut, mm, 0 without one; which half is locked, and near which point."""

    depth_mm: float
    where: str


def check_opening(finger: Body, options: MoldOptions, may_turn: bool) -> Undercut:
    """Return the deepest undercut.

    Parameters
    ----------
    may_turn : whether halves that open along the other axis can be advised

    Raises
    ------
    Finger3dError
        If the body has an undercut deeper than `options.undercut_mm`, and than a printer resolves.
    """
    opening = undercut(finger, options.split, options.split_mm)
    if opening.depth_mm <= max(options.undercut_mm, _LEAST_UNDERCUT_MM):
        return opening
    other = "x" if options.split == "z" else "z"
    free = (may_turn or other == "z") and undercut(finger, other, 0.0).depth_mm <= _LEAST_UNDERCUT_MM
    advice = f"--split {other} would do" if free else "a mold of two halves cannot be taken off; change the body"
    raise Finger3dError(
        f"--split {options.split} --split-mm {options.split_mm:g}: {opening.where}, an undercut of "
        f"{opening.depth_mm:.2g} mm; {advice}, or --undercut-mm {_rounded_up(opening.depth_mm)} if the silicone "
        "can be stretched over it"
    )


def _rounded_up(depth: float) -> str:
    step = 10.0 ** (np.floor(np.log10(depth)) - 1.0)
    return f"{np.ceil(depth / step) * step:.3g}"


def undercut(finger: Body, split: str, at_mm: float) -> Undercut:
    """Return the deepest undercut of a body whose halves open along the axis `split`, from the plane at `at_mm`."""
    axis = 0 if split == "x" else 2
    deepest = Undercut(0.0, "")
    for sign in (1.0, -1.0):
        half = _half(finger.surface, axis, sign, at_mm)
        depth = undercut_depth(half, axis, sign)
        if depth > max(deepest.depth_mm, _LEAST_UNDERCUT_MM):
            walls = ~_cuts(half, axis, at_mm)
            point = half.corners[walls][int(np.argmin(sign * half.normals[walls, axis]))].mean(axis=0)
            place = ", ".join(f"{c:.4g}" for c in point)
            side = f"{'+' if sign > 0 else '-'}{split}"
            deepest = Undercut(depth, f"the half on the {side} side is locked by the body near ({place}) mm")
    return deepest


def _half(surface: Triangles, axis: int, sign: float, at_mm: float) -> Triangles:
    normal = [0.0, 0.0, 0.0]
    normal[axis] = sign
    return triangles(manifold(surface).trim_by_plane(tuple(normal), sign * at_mm))


def _cuts(half: Triangles, axis: int, at_mm: float) -> NDArray[np.bool_]:
    """Return the mask (m,) of the triangles on the split plane or on the base, which no half touches."""
    corners = half.corners
    on_split = (np.abs(corners[:, :, axis] - at_mm) < _ON_PLANE_MM).all(axis=1)
    on_base = (np.abs(corners[:, :, 1]) < _ON_PLANE_MM).all(axis=1)
    found: NDArray[np.bool_] = np.asarray(on_split | on_base)
    return found


def undercut_depth(half: Triangles, axis: int, sign: float) -> float:
    """Return the depth (mm) of the deepest undercut of the part of a body inside one half.

    At each height the shadow S is the outline of all that lies above, and U = S without the section the material of
    the half that is locked below. The depth is the largest distance of a point of U from the outline of S.
    """
    from manifold3d import CrossSection, FillRule

    order = {0: [1, 2, 0], 1: [2, 0, 1], 2: [0, 1, 2]}[axis]
    turned = Triangles(half.points[:, order] * [1.0, 1.0, sign], half.faces if sign > 0 else half.faces[:, ::-1])
    body = manifold(turned)
    low, high = float(turned.low[2]), float(turned.high[2])
    deepest = 0.0
    for height in np.linspace(low, high, _LEVELS + 1)[:-1] + 1e-6 * (high - low):
        above = body.trim_by_plane((0.0, 0.0, 1.0), float(height))
        shadow = CrossSection(above.project().to_polygons(), FillRule.Positive)
        locked = shadow - body.slice(float(height))
        if locked.is_empty():
            continue
        deepest = max(deepest, _reach(shadow, locked, deepest))
    return deepest


def _reach(shadow: CrossSection, locked: CrossSection, least: float) -> float:
    """Return the largest distance of the points of a region from the outline of another that holds it, mm."""

    def reaches(distance: float) -> bool:
        return float((shadow.offset(-distance) ^ locked).area()) > 1e-9 * float(shadow.area())

    if not reaches(max(least, 1e-6)):
        return least
    x0, y0, x1, y1 = shadow.bounds()
    low, high = max(least, 1e-6), 0.5 * float(max(x1 - x0, y1 - y0)) + 1e-6
    while high - low > _DEPTH_TOLERANCE * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reaches(middle) else (low, middle)
    return high
