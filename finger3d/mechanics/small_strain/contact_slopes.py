"""Contact at the end of an increment, and its derivatives by the displacements of the contact points.

They follow from means of distance, gradient and displacement over the samples of the surface.  The means are linear in
values at the samples, whose derivatives are central differences, as those of the conditions of each point are by its
own displacement and means.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.state import ContactState
from finger3d.fem.tensors import block_diagonal
from finger3d.mechanics.discretise.contact_geometry import ContactGeometry, contact_means, geometry_of_means
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import Increment
from finger3d.mechanics.small_strain.linearised import upright
from finger3d.objects import vertical_frame

_STEP = 3e-6
"""Displacement of points, over the depth, by which central differences are taken."""


@dataclass(frozen=True)
class ContactEnd:
    """End of an increment at displacements (c, d) mm of its points, with means (c, 1 + 2 d) over the samples."""

    increment: Increment
    displacement: Float
    means: Float

    @classmethod
    def of(cls, increment: Increment, displacement: Float) -> ContactEnd:
        """Return the end of an increment."""
        problem, place = increment.problem, _expansion_point(increment, displacement)
        means = contact_means(problem.placed(increment.move.end).distance, problem.surface, place)
        return cls(increment, displacement, means)

    @cached_property
    def geometry(self) -> ContactGeometry:
        """Gaps and directions of the points."""
        problem = self.increment.problem
        share = problem.system.object_share
        return geometry_of_means(self.means, problem.surface, self._expansion_point, problem.axes, share)

    @property
    def _expansion_point(self) -> Float:
        return _expansion_point(self.increment, self.displacement)

    def beside(self, increment: Increment) -> ContactEnd:
        """Return the end of another increment at the same displacements; the means are taken anew if they differ."""
        is_same = increment.move.end == self.increment.move.end
        if is_same and are_placed_alike(increment.problem, self.increment.problem):
            return replace(self, increment=increment)
        return ContactEnd.of(increment, self.displacement)

    def moved(self, displacement: Float, means: Float) -> ContactEnd:
        """Return the end with displacements and means that differ by (c, d) and (c, 1 + 2 d)."""
        return replace(self, displacement=self.displacement + displacement, means=self.means + means)

    def conditions(self, contact: ContactState) -> Float:
        """Return gap and slip (mm), and the forces (N) of a state if they turn to the end's directions, (c, 2 d).

        Both are in the directions of an upright object.
        """
        relative = self.increment.relative(self.geometry, self._expansion_point, self.displacement)
        turned = np.einsum("ca,cak->ck", contact.force, self.geometry.bases) @ vertical_frame(self.geometry.dim).T
        return np.column_stack([upright(contact, relative), turned])

    def state(self, contact: ContactState, force: Float) -> State[Float]:
        """Return the state with contact forces that differ by (c, d) from those of another."""
        changed = replace(contact, force=contact.force + force)
        return self.increment.reached(self.geometry, self._expansion_point, self.displacement, changed, None)

    def slopes(self, contact: ContactState) -> tuple[Any, Any]:
        """Return the derivatives of `conditions` and of the means, (c 2 d, c d) and (c (1 + 2 d), c d) sparse."""
        (c, d), problem = self.displacement.shape, self.increment.problem
        is_flat, surface = problem.model.object.is_flat, problem.surface
        step, m = _STEP * problem.model.largest_depth_mm, self.means.shape[1]
        changes = step * np.eye(d if is_flat else d + m, d + m)

        def conditions(change: Float) -> Float:
            return self.moved(*np.hsplit(np.tile(change, (c, 1)), [d])).conditions(contact)

        own = np.stack([(conditions(by) - conditions(-by)) / (2.0 * step) for by in changes], axis=2)
        of_conditions, of_means = block_diagonal(own[:, :, :d]), sp.csr_array((c * m, c * d))
        if not is_flat:
            distance, samples = problem.placed(self.increment.move.end).distance, surface.samples
            samples = samples + surface.interpolation @ self.displacement
            found = [[np.column_stack(distance(samples + t * by)) for t in (-1.0, 1.0)] for by in changes[:d, :d]]
            by_place = np.stack([(high - low) / (2.0 * step) for low, high in found], axis=2)
            by_place = np.concatenate([by_place, np.broadcast_to(np.eye(d), (len(samples), d, d))], axis=1)
            average, interpolation = sp.kron(surface.average, np.eye(m)), sp.kron(surface.interpolation, np.eye(d))
            of_means = average.tocsr() @ (block_diagonal(by_place) @ interpolation.tocsr())
            of_conditions = of_conditions + block_diagonal(own[:, :, d:]) @ of_means
        return of_conditions, of_means


def are_placed_alike(one: Problem, other: Problem) -> bool:
    """Whether two problems have the same contact points, and the same object at first touch."""
    is_same = one.surface is other.surface and one.system.first_contact_mm == other.system.first_contact_mm
    return is_same and one.model.object == other.model.object


def _expansion_point(increment: Increment, displacement: Float) -> Float:
    """Return where gaps are linearised, as in the solution of the increment, whose geometry is linear if flat."""
    return np.zeros_like(displacement) if increment.problem.model.object.is_flat else displacement
