"""Gaps and contact directions of the finger's points, from the signed distance of the object in its pose.

The distance phi is sampled at the quadrature points x of the finger's surface, which move with the contact points, and
averaged with their hat functions.  With the mean gradient N of a point, its normal is n = N / |N|, and its gap::

    g = mean(phi(x)) / |N| + n . (U - mean(u(x)))

U is the displacement of the contact point, the weighted mean of the surface's, and u(x) its linear interpolation; the
second term makes the gap of a plane exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, freeze_arrays
from finger3d.fem.mesh.simplex import CONTACT, in_symmetry_planes
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.fem.tensors import LEAST_SLOPE, bases_of, turned_towards, unit_normals
from finger3d.objects import vertical_frame

Distance = Callable[[Float], tuple[Float, Float]]

MARGIN = 0.3
"""Largest rigid gap of candidate points, in depths of the press; whether it suffices is checked after the solution."""

_FACING = -0.1
"""Product of the normals of object and finger below which the two surfaces face each other."""


@dataclass(frozen=True)
class ContactGeometry:
    """Contact of displaced points with an object in a pose.

    Attributes
    ----------
    distance : (c,) mm, mean signed distance
    slope : (c,) length of its mean gradient; below 1 where normals differ within a hat
    offset : (c, d) mm, displacement of the contact points less the mean of that of the samples
    bases : (c, d, d) normal into the finger, then tangents
    """

    distance: Float
    slope: Float
    offset: Float
    bases: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def dim(self) -> int:
        """2 for a section, 3 for a solid."""
        return int(self.bases.shape[-1])

    @property
    def gap(self) -> Float:
        """Gaps (c,) mm, negative for penetration."""
        out: Float = self.distance / np.maximum(self.slope, LEAST_SLOPE)
        out += np.einsum("ck,ck->c", self.bases[:, 0], self.offset)
        return out

    @property
    def gradient(self) -> Float:
        """Mean gradients (c, d) of the distance."""
        return np.asarray(self.slope[:, None] * self.bases[:, 0])

    def angles(self, other: ContactGeometry) -> Float:
        """Return the angles (c,) rad between the normals and those of another geometry."""
        return np.asarray(
            2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(self.bases[:, 0] - other.bases[:, 0], axis=1), 1.0))
        )

    def holding(self, held: NDArray[np.bool_], other: ContactGeometry) -> ContactGeometry:
        """Return this geometry with the gradients and directions of another one at some points (c,)."""
        if not held.any():
            return self
        bases = np.where(held[:, None, None], other.bases, self.bases)
        return replace(self, bases=bases, slope=np.where(held, other.slope, self.slope))

    @property
    def from_reference(self) -> Float:
        """Rotations (c, d, d) from the directions of an upright object to those of each point."""
        return self.bases @ vertical_frame(self.dim).T


def may_touch(surface: BoundarySurface, normal: Float, finite_strain: bool = False) -> NDArray[np.bool_]:
    """Return which points (c,) can touch an object with normals (c, d) there.

    Those of the contact face can.  On other faces the surfaces must face each other, or an object above the finger
    would count as touching its walls; at finite strain, walls turn with the deformation and may touch it as well.
    """
    if finite_strain:
        return np.ones(len(surface.nodes), dtype=np.bool_)
    facing = np.einsum("ck,ck->c", normal, surface.normals) < _FACING
    return np.asarray(facing | (surface.face == CONTACT))


def contact_geometry(
    distance: Distance,
    surface: BoundarySurface,
    displacement: Float | None = None,
    axes: tuple[str, ...] = (),
    object_share: Float | None = None,
) -> ContactGeometry:
    """Return gaps and directions of a surface's points.

    Parameters
    ----------
    distance : function of points (n, d)
        Signed distance (n,) mm from the object, and its gradient (n, d).
    displacement : (c, d) mm, of the contact points; none unless given
    axes : symmetry planes, in which the normals of points on them lie
    object_share : (c,)
        Share of an elastic object in the compliance of each point; none is rigid.  Its surface turns towards that of
        the finger by this share: two mirror images meet in a plane.
    """
    moved = np.zeros_like(surface.samples) if displacement is None else surface.interpolation @ displacement
    means = np.asarray(surface.average @ np.column_stack([*distance(surface.samples + moved), moved]))
    d = surface.points.shape[1]
    mean = in_symmetry_planes(means[:, 1 : 1 + d], surface.points, axes)
    length = np.linalg.norm(mean, axis=1)
    if object_share is not None:
        mean = turned_towards(mean, in_symmetry_planes(surface.normals, surface.points, axes), object_share)
    normal = unit_normals(mean)
    offset = np.zeros_like(normal) if displacement is None else displacement - means[:, 1 + d :]
    return ContactGeometry(means[:, 0], length, offset, bases_of(normal, surface.normals))
