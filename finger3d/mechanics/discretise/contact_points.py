"""Contact points of the whole finger, between which the zones of contact and stick end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, freeze_arrays
from finger3d.contact.state import ContactState
from finger3d.contact.zones import Zone, edges_of, zones
from finger3d.fem.mesh.simplex import CONTACT

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
    face : (m,) number in `finger3d.fem.mesh.simplex.FREE_FACES` of the face that each point belongs to
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

    def rim(self, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which points (m,) of a zone an edge joins with a point outside it."""
        i, j = self.edges.T
        out = np.zeros(len(inside), dtype=bool)
        out[i[inside[i] & ~inside[j]]] = True
        out[j[inside[j] & ~inside[i]]] = True
        return out

    def resolved(self, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which points (m,) of a zone lie where it is three points wide: inner ones and their neighbours."""
        inner = inside & ~self.rim(inside)
        i, j = self.edges.T
        out = inner.copy()
        out[i[inner[j] & inside[i]]] = True
        out[j[inner[i] & inside[j]]] = True
        return out

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
