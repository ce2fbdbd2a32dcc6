"""Contact of a deformed surface: gaps as means over the deformed area, and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.mesh.simplex import in_symmetry_planes
from finger3d.fem.surface.traces import BoundarySurface, outward_normals
from finger3d.fem.tensors import bases_of, block_diagonal, unit_normals


@dataclass(frozen=True)
class _Area:
    """Deformed over initial area of a face at its samples, and its derivatives.

    Attributes
    ----------
    ratio, initial : (q,) the ratio, and the initial length or area of the facets' reference simplex
    moved, turned : d - 1 arrays (q, d), tangents of the deformed face, and the derivative of its area by each
    """

    face: BoundarySurface
    ratio: Float
    initial: Float
    moved: list[Float]
    turned: list[Float]

    @classmethod
    def of(cls, face: BoundarySurface, points: Float, u: Float) -> _Area:
        """Return the areas at displacements u (n, d) of the nodes."""
        rest, moved = ([slope @ x for slope in face.along] for x in (points, points + u))
        if u.shape[1] == 2:
            vector = moved[0]
            initial = np.linalg.norm(rest[0], axis=1)
        else:
            vector = np.cross(moved[0], moved[1])
            initial = np.linalg.norm(np.cross(rest[0], rest[1]), axis=1)
        length = np.linalg.norm(vector, axis=1)
        unit = vector / length[:, None]
        turned = [unit] if u.shape[1] == 2 else [np.cross(moved[1], unit), np.cross(unit, moved[0])]
        return cls(face, length / initial, initial, moved, turned)

    def change(self, u: Float) -> Float:
        """Return the change (q,) of the ratio with displacements u (n, d)."""
        total = sum(np.einsum("qk,qk->q", t, x @ u) for t, x in zip(self.turned, self.face.along, strict=True))
        return np.asarray(total / self.initial)

    def transposed(self, weights: Float) -> Float:
        """Return the sum (n, d) of the derivatives with weights (q,)."""
        scaled = (weights / self.initial)[:, None]
        return np.asarray(sum(x.T @ (scaled * t) for t, x in zip(self.turned, self.face.along, strict=True)))

    @cached_property
    def derivative(self) -> sp.csr_matrix:
        """Derivative (q, n d) of the ratio."""
        turned = np.concatenate(self.turned, axis=1) / self.initial[:, None]
        return sp.csr_matrix(block_diagonal(turned[:, None, :]) @ self.face.vector_slopes)

    def second_derivative(self, weights: Float) -> sp.csr_matrix:
        """Return the sum (n d, n d) of the second derivatives with weights (q,).

        The area is the length of a vector v of the tangents t: the tangent in 2D, the tangents' cross product in 3D.
        With C = dv/dt and e = v / |v| its second derivative by the tangents is ``C^T (I - e e^T) C / |v| + e v''``.
        """
        d, length = self.moved[0].shape[1], self.ratio * self.initial
        identity = np.eye(d)
        if d == 2:
            unit, by_tangents = self.turned[0], np.broadcast_to(identity, (len(length), d, d))
        else:
            one, other = self.moved
            unit = np.cross(one, other) / length[:, None]
            turns = np.cross(identity, other[:, None, :]), np.cross(one[:, None, :], identity)
            by_tangents = np.swapaxes(np.concatenate(turns, axis=1), 1, 2)
        across = identity - unit[:, :, None] * unit[:, None, :]
        second = np.swapaxes(by_tangents, 1, 2) @ across @ by_tangents / length[:, None, None]
        if d == 3:
            twist = np.cross(identity, unit[:, None, :])  # e . (a x b) = b^T twist a
            second[:, d:, :d] += twist
            second[:, :d, d:] += np.swapaxes(twist, 1, 2)
        second *= (weights / self.initial)[:, None, None]
        slopes = self.face.vector_slopes
        return sp.csr_matrix(slopes.T @ block_diagonal(second) @ slopes)


@dataclass(frozen=True)
class DeformedContact:
    """Contact of a deformed face.

    Attributes
    ----------
    gap : (c,) mm
    bases : (c, d, d) directions of the points
    samples_gap, samples_normal : (q,) mm, (q, d) gap and unit normal at the samples
    follows_area : whether the gap is the mean over the deformed area; beside an elastic object it is read along the
        common normal of both bodies
    """

    face: BoundarySurface
    gap: Float
    bases: Float
    samples_gap: Float
    samples_normal: Float
    area: _Area
    follows_area: bool

    @cached_property
    def _mean_area(self) -> Float:
        return np.asarray(self.face.average @ self.area.ratio)

    def displacements(self, u: Float) -> Float:
        """Return the displacements (c, d) of the points along their directions, from those (n, d) of the nodes."""
        face, area = self.face, self.area
        out: Float = np.einsum("ctk,ck->ct", self.bases, face.trace @ u)
        if self.follows_area:
            # d(mean gap) = mean of d(gap) and of (gap - mean gap) d(area)
            change = area.change(u)
            moved = np.einsum("qk,qk->q", self.samples_normal, face.interpolate @ u)
            weighted = face.average @ (area.ratio * moved + self.samples_gap * change)
            out[:, 0] = (weighted - self.gap * (face.average @ change)) / self._mean_area
        return out

    def nodal_forces(self, force: Float) -> Float:
        """Return the nodal forces (n, d) of forces (c, d) at the points, along their directions."""
        face, area = self.face, self.area
        tangential = force.copy()
        tangential[:, 0] = force[:, 0] * (not self.follows_area)
        out: Float = face.trace.T @ np.einsum("ctk,ct->ck", self.bases, tangential)
        if self.follows_area:
            per_area = force[:, 0] / self._mean_area
            pressure = face.average.T @ per_area
            out += face.interpolate.T @ ((pressure * area.ratio)[:, None] * self.samples_normal)
            out += area.transposed(self.samples_gap * pressure - face.average.T @ (per_area * self.gap))
        return out

    @cached_property
    def rows(self) -> sp.csr_matrix:
        """Rows (c d, n d) of `displacements`."""
        face, (c, d) = self.face, self.bases.shape[:2]
        bases = self.bases.copy()
        if self.follows_area:
            bases[:, 0] = 0.0
        rows = block_diagonal(bases) @ face.vector_trace
        if self.follows_area:
            weight = sp.diags_array(1.0 / self._mean_area) @ face.average
            deviation = weight @ sp.diags_array(self.samples_gap) - sp.diags_array(self.gap) @ weight
            normal = weight @ sp.diags_array(self.area.ratio) @ self._d_gap + deviation @ self.area.derivative
            rows = rows + sp.csr_array((np.ones(c), (d * np.arange(c), np.arange(c))), (c * d, c)) @ normal
        return sp.csr_matrix(rows)

    @cached_property
    def _d_gap(self) -> sp.csr_matrix:
        """Derivative (q, n d) of the gap at the samples."""
        return sp.csr_matrix(block_diagonal(self.samples_normal[:, None, :]) @ self.face.vector_interpolate)

    def geometric_stiffness(self, force: Float, curvature: Float | None = None) -> sp.csr_matrix:
        """Return the geometric stiffness (n d, n d) of normal forces (c,) N, which is subtracted from K.

        It is the second derivative of the gaps, weighted with the forces.  The pressure acts on the deformed area;
        otherwise it would push mid-edge nodes along the surface, and K would be indefinite at a few G.

        Parameters
        ----------
        curvature : (q, d, d) array, 1/mm, optional
            Second derivatives of the gap at the samples; zero unless given.
        """
        face = self.face
        spread = self.area.derivative
        per_area = sp.diags_array(force / self._mean_area)
        pressure = sp.diags_array(face.average.T @ per_area.diagonal())
        normal = self.rows[:: self.bases.shape[1]]
        half = self._d_gap.T @ pressure @ spread - normal.T @ per_area @ face.average @ spread
        uneven = self.samples_gap * pressure.diagonal() - face.average.T @ (per_area @ self.gap)
        total = half + half.T + self.area.second_derivative(uneven)
        if curvature is not None:
            weighted = (pressure.diagonal() * self.area.ratio)[:, None, None] * curvature
            total = total + face.vector_interpolate.T @ block_diagonal(weighted) @ face.vector_interpolate
        return sp.csr_matrix(total)


def deformed_contact(
    face: BoundarySurface,
    *,
    points: Float,
    displacement: Float,
    gap: Float,
    normal: Float,
    axes: tuple[str, ...],
    object_share: Float | None = None,
) -> DeformedContact:
    """Contact of a deformed face.

    Parameters
    ----------
    points, displacement : (n, d) arrays, mm
        Nodes of the mesh at rest, and their displacement.
    gap : (q,) array, mm
        Gap at the samples.
    normal : (q, d) array
        Unit normals into the body at the samples, along which the gap is measured.
    axes : tuple of str
        Normals of the symmetry planes, in which the normals of points on them lie.
    object_share : (c,) array, optional
        Share of an elastic object in the compliance of each point; the common normal turns from that of the object
        towards that of the body by this share.
    """
    area = _Area.of(face, points, displacement)
    total = face.average @ area.ratio
    mean_normal = (face.average @ (normal * area.ratio[:, None])) / total[:, None]
    if object_share is not None:
        body_normal = outward_normals(area.moved)
        body_normal = (face.average @ (body_normal * area.ratio[:, None])) / total[:, None]
        body_normal *= (np.linalg.norm(mean_normal, axis=1) / np.linalg.norm(body_normal, axis=1))[:, None]
        mean_normal = (1.0 - object_share[:, None]) * mean_normal - object_share[:, None] * body_normal
    mean_gap = (face.average @ (gap * area.ratio)) / total
    bases = bases_of(unit_normals(in_symmetry_planes(mean_normal, face.points, axes)))
    return DeformedContact(face, mean_gap, bases, gap, normal, area, object_share is None)
