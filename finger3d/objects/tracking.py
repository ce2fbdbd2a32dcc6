"""Signed distances of moving points, evaluated again only where they may have become small."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.objects.placed import PlacedObject, in_section
from finger3d.objects.triangulated import MeshObject


class DistanceTracker:
    """Signed distances of the same points at one place after another.

    A distance changes by no more than the point moves relative to the object.  Points that stay farther than a bound
    keep the distance and gradient of their last evaluation, continued linearly.
    """

    def __init__(self) -> None:
        """Know no distance."""
        self._at: Float | None = None
        self._value = self._gradient = np.zeros(0)

    def distance(self, placed: PlacedObject, points: Float, within_mm: float) -> tuple[Float, Float]:
        """Return the signed distance (n,) of points (n, d), 2D ones in the section z = 0, and its gradient (n, d).

        Both are exact for points nearer to the object than `within_mm`.
        """
        if not isinstance(placed.object, MeshObject):  # a formula is as quick as a comparison
            return placed.distance(points)
        own = placed.to_own(points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))]))
        if self._at is None or len(self._at) != len(own):
            self._at = own.copy()
            self._value, gradient = placed.object.distance(own)
            self._gradient = np.array(gradient)
        moved = own - self._at
        due = np.flatnonzero((self._value - np.linalg.norm(moved, axis=1) < within_mm) & moved.any(axis=1))
        if len(due):
            self._at[due] = own[due]
            self._value[due], self._gradient[due] = placed.object.distance(own[due])
            moved[due] = 0.0
        value = self._value + np.einsum("ni,ni->n", self._gradient, moved)
        gradient = placed.to_scene_direction(self._gradient)
        return (value, gradient) if points.shape[1] == 3 else in_section(value, gradient)
