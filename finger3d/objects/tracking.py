"""Signed distances of moving points, evaluated again only where they may have become small."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.objects.placed import PlacedObject, in_section
from finger3d.objects.triangulated import MeshObject


class DistanceTracker:
    """Signed distances of the same points at one place after another.

    A distance changes by no more than the point moves relative to the object.  Points that stay farther than a bound
    keep the distance and gradient of their last evaluation, continued linearly; before the first, those of the box
    around the object.
    """

    def __init__(self) -> None:
        """Start without known distances."""
        self._at: Float | None = None
        self._value = self._gradient = np.zeros(0)
        self._known = np.zeros(0, dtype=bool)

    def distance(self, placed: PlacedObject, points: Float, within_mm: float) -> tuple[Float, Float]:
        """Return the signed distance (n,) of points (n, d), 2D ones in the section z = 0, and its gradient (n, d).

        Both are exact for points within `within_mm` of the object.
        """
        if not isinstance(placed.object, MeshObject):  # a formula is as quick as a comparison
            return placed.distance(points)
        own = placed.to_own(points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))]))
        if self._at is None or len(self._at) != len(own):
            self._at = own.copy()
            self._value, self._gradient = _box_distance(placed.object.triangles, own)
            self._known = np.zeros(len(own), dtype=bool)
        moved = own - self._at
        changed = moved.any(axis=1) | ~self._known
        due = np.flatnonzero((self._value - np.linalg.norm(moved, axis=1) <= within_mm) & changed)
        if len(due):
            self._at[due] = own[due]
            self._value[due], self._gradient[due] = placed.object.distance(own[due])
            self._known[due] = True
            moved[due] = 0.0
        value = self._value + np.einsum("ni,ni->n", self._gradient, moved)
        gradient = placed.to_scene_direction(self._gradient)
        return (value, gradient) if points.shape[1] == 3 else in_section(value, gradient)


def _box_distance(triangles: Triangles, points: Float) -> tuple[Float, Float]:
    """Return the distance (n,) of points (n, 3) from the box around triangles, 0 inside, and its gradient (n, 3)."""
    out = points - np.clip(points, triangles.low, triangles.high)
    value = np.linalg.norm(out, axis=1)
    gradient = np.where((value > 0.0)[:, None], out / np.where(value > 0.0, value, 1.0)[:, None], [0.0, -1.0, 0.0])
    return value, gradient
