"""Contact at the end of an increment, and its derivatives by the displacements of the contact points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int
from finger3d.contact.state import ContactState
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.mechanics.discretise.contact_geometry import ContactGeometry
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import Increment
from finger3d.mechanics.small_strain.linearised import upright
from finger3d.objects import vertical_frame

_STEP = 3e-6
"""Displacement of points, over the depth, by which central differences are taken."""


@dataclass(frozen=True)
class ContactEnd:
    """End of an increment at displacements (c, d) mm of its points."""

    increment: Increment
    geometry: ContactGeometry
    displacement: Float

    @classmethod
    def of(cls, increment: Increment, displacement: Float) -> ContactEnd:
        """Return the end of an increment."""
        return cls(increment, increment.geometry(_expansion_point(increment, displacement), np.inf), displacement)

    def beside(self, increment: Increment) -> ContactEnd:
        """Return the end of another increment at the same displacements; the geometry is evaluated if it differs."""
        (one, other), end = (each.problem for each in (self.increment, increment)), increment.move.end
        is_same = other.surface is one.surface and other.system.object_share is one.system.object_share
        is_same = is_same and other.system.first_contact_mm == one.system.first_contact_mm
        if is_same and other.model.object == one.model.object and end == self.increment.move.end:
            return replace(self, increment=increment)
        return ContactEnd.of(increment, self.displacement)

    def moved(self, displacement: Float, geometry: Float) -> ContactEnd:
        """Return the end with displacements and geometry that differ by (c, d) and (c, m); see `slopes`."""
        c, d = displacement.shape
        array = _as_array(self.geometry) + geometry
        changed = ContactGeometry(array[:, 0], array[:, 1], array[:, 2 : 2 + d], array[:, 2 + d :].reshape(c, d, d))
        return replace(self, geometry=changed, displacement=self.displacement + displacement)

    def conditions(self, contact: ContactState) -> Float:
        """Return gap and slip (mm), and the forces (N) of a state if they turn to the end's directions, (c, 2 d).

        Both are in the directions of an upright object.
        """
        expansion_point = _expansion_point(self.increment, self.displacement)
        relative = self.increment.relative(self.geometry, expansion_point, self.displacement)
        turned = np.einsum("ca,cak->ck", contact.force, self.geometry.bases) @ vertical_frame(self.geometry.dim).T
        return np.column_stack([upright(contact, relative), turned])

    def state(self, contact: ContactState, force: Float) -> State[Float]:
        """Return the state with contact forces that differ by (c, d) from those of another."""
        expansion_point = _expansion_point(self.increment, self.displacement)
        changed = replace(contact, force=contact.force + force)
        return self.increment.reached(self.geometry, expansion_point, self.displacement, changed, None)

    def slopes(self, contact: ContactState, influence: tuple[sp.csr_matrix, Int]) -> tuple[Any, Any]:
        """Return the derivatives of `conditions` and of the geometry, (c 2 d, c d) and (c m, c d) sparse.

        Points that influence no point in common are displaced at once; see `influence_of`.
        """
        (c, d), (influences, groups) = self.displacement.shape, influence
        step, rows, columns, values = _STEP * self.increment.problem.model.largest_depth_mm, [], [], []
        for group in range(int(groups.max()) + 1):
            points = np.flatnonzero(groups == group)
            near = influences[:, points].tocoo()
            for k in range(d):
                change = np.zeros((c, d))
                change[points, k] = step
                low, high = (ContactEnd.of(self.increment, self.displacement + t * change) for t in (-1.0, 1.0))
                both = [np.column_stack([end.conditions(contact), _as_array(end.geometry)]) for end in (low, high)]
                values.append((both[1] - both[0])[near.row] / (2.0 * step))
                rows.append(near.row)
                columns.append(d * points[near.col] + k)
        row, column, value = np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

        def matrix(entries: Float) -> sp.csr_matrix:
            width = entries.shape[1]
            places = (width * row[:, None] + np.arange(width)).ravel(), np.repeat(column, width)
            return sp.csr_matrix((entries.ravel(), places), shape=(c * width, c * d))

        return matrix(value[:, : 2 * d]), matrix(value[:, 2 * d :])


def influence_of(surface: BoundarySurface, is_flat: bool) -> tuple[sp.csr_matrix, Int]:
    """Return by the displacements of which points (c, c) the geometry of each point changes, and groups (c,) of points.

    Those of a group influence no point in common.  Under a flat object a point influences itself only.
    """
    count = len(surface.nodes)
    influences = sp.identity(count, format="csr") if is_flat else surface.influence
    beside = (influences.T @ influences).tocsr()
    groups = np.full(count, -1)
    for point in range(count):
        taken = groups[beside.indices[beside.indptr[point] : beside.indptr[point + 1]]]
        groups[point] = next(group for group in range(count) if group not in taken)
    return influences, groups


def _as_array(geometry: ContactGeometry) -> Float:
    """Return distance, slope, offset and bases of points, (c, m)."""
    bases = geometry.bases.reshape(len(geometry.bases), -1)
    return np.column_stack([geometry.distance, geometry.slope, geometry.offset, bases])


def _expansion_point(increment: Increment, displacement: Float) -> Float:
    """Return where gaps are linearised, as in the solution of the increment, whose geometry is linear if flat."""
    return np.zeros_like(displacement) if increment.problem.model.object.is_flat else displacement
