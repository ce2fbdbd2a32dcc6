"""Contact points of the finger: their gaps and contact directions, and the zones of contact and stick between them.

The distance phi is sampled at the quadrature points x of the finger's surface, which move with the contact points, and
averaged with their hat functions.  With the mean gradient N of a point, its normal is n = N / |N|, and its gap::

    g = mean(phi(x)) / |N| + n . (U - mean(u(x)))

U is the displacement of the contact point, the weighted mean of the surface's, and u(x) its linear interpolation; the
second term makes the gap of a plane exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, freeze_arrays
from finger3d.contact.state import ContactState
from finger3d.contact.zones import Zone, edges_of, zones
from finger3d.fem.mesh import CONTACT, in_symmetry_planes
from finger3d.fem.surface import BoundarySurface
from finger3d.fem.tensors import LEAST_SLOPE, bases_of, turned_towards, unit_normals
from finger3d.objects import vertical_frame

_ON_LINE = 1e-9
"""Distance from the line z = 0, in half widths, below which a vertex lies on it: round-off of its coordinates."""

_AT_LOWEST = 1e-4
"""Distance (mm) from the object's lowest place within which a point is at it, on neither side: round-off of meshers,
and what a difference of a dimension or a pose moves it by."""


@dataclass(frozen=True)
class ContactPoints:
    """The contact points of the whole finger, mirrored halves included.

    Attributes
    ----------
    nodes : (m,) numbers in the whole mesh
    face : (m,) number in `finger3d.fem.mesh.FREE_FACES` of the face that each point belongs to
    points : (m, 3) mm at rest, z = 0 in a section
    area : (m,) mm2
    basis : (d, d), or (m, d, d) where each point has its own: normal into the finger, then tangents
    half_width_mm, band_mm : float
        Where no point lies on the line z = 0, figures show the points within `band_mm` of it.
    facets : (f, d)
        Points at the vertices of the facets of the surface mesh, where all of these are contact points.
    compliance : (m,) 1/MPa
        ``1 / E*`` of finger and object: ``(1 - nu^2) / E``, and ``1 / E`` in plane stress.
    """

    nodes: NDArray[np.int64]
    face: NDArray[np.int8]
    points: Float
    area: Float
    basis: Float
    half_width_mm: float
    band_mm: float
    facets: NDArray[np.int64]
    compliance: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def dim(self) -> int:
        """2 for a section, 3 for a solid."""
        return int(self.basis.shape[-1])

    @cached_property
    def edges(self) -> NDArray[np.int64]:
        """Pairs of points (e, 2) that an edge of the surface mesh joins."""
        return edges_of(self.facets)

    @cached_property
    def facet_area(self) -> Float:
        """Areas (f,) mm2 of the facets, which are taken as flat."""
        places = self.points[self.facets]
        arms = places[:, 1:] - places[:, :1]
        if self.dim == 2:
            return np.asarray(2.0 * self.half_width_mm * np.linalg.norm(arms[:, 0], axis=1))
        return np.asarray(0.5 * np.linalg.norm(np.cross(arms[:, 0], arms[:, 1]), axis=1))

    def zones(self, state: ContactState) -> tuple[Zone, Zone]:
        """Return the zones of contact and of stick in a state."""
        return zones(state, self.points, self.area, self.compliance, self.edges)

    def with_basis_of(self, state: ContactState) -> ContactPoints:
        """Return the points with the bases of a state, if these change during the motion."""
        return self if state.bases is None else replace(self, basis=state.bases)

    def middle_line(self) -> tuple[Float, NDArray[np.int64]]:
        """Return where the contact face meets the line z = 0: x (k,), mm, and the number (k,) of the nearest point.

        These are the vertices on the line and the intersections of edges with it, or all points of a section.
        """
        x, z = self.points[:, 0], self.points[:, 2]
        z = np.where(np.abs(z) <= _ON_LINE * self.half_width_mm, 0.0, z)
        upper = self.face == CONTACT
        on = np.flatnonzero((z == 0.0) & upper)
        across = (z[self.edges[:, 0]] * z[self.edges[:, 1]] < 0.0) & upper[self.edges[:, 0]]
        i, j = self.edges[across].T
        share = z[i] / (z[i] - z[j])
        crossing = x[i] + share * (x[j] - x[i])
        return np.concatenate([x[on], crossing]), np.concatenate([on, np.where(share <= 0.5, i, j)])

    def end_line(self) -> tuple[Float, NDArray[np.int64]]:
        """Return x (k,), mm, and the numbers (k,) of the points where the contact face ends, at half the width."""
        end = np.abs(self.points[:, 2] - self.half_width_mm) <= 1e-6 * self.half_width_mm
        nearest = np.flatnonzero(end & (self.face == CONTACT))
        return self.points[nearest, 0], nearest

    def sides_of(self, place: tuple[float, float]) -> Float:
        """Return on which sides (m, 2) of a place (x, z), mm, the points are: -1, 1, or 0 at the place."""
        apart = self.points[:, ::2] - place
        return np.where(np.abs(apart) > _AT_LOWEST, np.sign(apart), 0.0)

    def to_global(self, local: Float) -> Float:
        """Vectors (m, 3) in x, y, z from vectors (m, d) in the frame."""
        out = np.zeros((len(local), 3))
        own = self.basis if self.basis.ndim == 3 else self.basis[None]
        out[:, : self.dim] = np.einsum("ma,mak->mk", local, np.broadcast_to(own, (len(local), self.dim, self.dim)))
        return out

    def friction(self, force: Float) -> Float:
        """Tangential part (m, 3) of forces (m, d), in x, y, z."""
        tangential = force.copy()
        tangential[:, 0] = 0.0
        return self.to_global(tangential)


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
        chord = np.linalg.norm(self.bases[:, 0] - other.bases[:, 0], axis=1)
        return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)))

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
