"""Contact of a deformed surface: gaps as means over the deformed area, and their derivatives.

With the mean gradient N of the distance over a point's hat, the gap of the point is the mean distance over the length
of N, and its normal is ``N / |N|``: a force on the point is then the resultant of the pressures on its hat, also where
the normals of the object differ there.  Derivatives of the gap leave out those of that length, whose effect is
proportional to the gap.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.mesh.simplex import in_symmetry_planes
from finger3d.fem.surface.traces import BoundarySurface, outward_normals
from finger3d.fem.tensors import LEAST_SLOPE, bases_of, block_diagonal, turned_towards, unit_normals


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

    def along(self, weights: Float) -> list[Float]:
        """Return the sums of the derivatives with weights (q,), along the d - 1 axes of the facets (q, d)."""
        scaled = (weights / self.initial)[:, None]
        return [scaled * one for one in self.turned]

    @cached_property
    def derivative(self) -> sp.csr_matrix:
        """Derivative (q, n d) of the ratio."""
        turned = np.concatenate(self.turned, axis=1) / self.initial[:, None]
        return sp.csr_matrix(block_diagonal(turned[:, None, :]) @ self.face.vector_slopes)

    @cached_property
    def normal_slopes(self) -> Float:
        """Derivative (q, d, (d - 1) d) of the area times its normal by the tangents."""
        d = self.moved[0].shape[1]
        if d == 2:
            return np.broadcast_to(np.array([[0.0, 1.0], [-1.0, 0.0]]), (len(self.ratio), d, d))
        one, other = self.moved
        turns = np.cross(np.eye(d), other[:, None, :]), np.cross(one[:, None, :], np.eye(d))
        return np.asarray(np.swapaxes(np.concatenate(turns, axis=1), 1, 2))

    def second_derivative(self, weights: Float) -> sp.csr_matrix:
        """Return the sum (n d, n d) of the second derivatives with weights (q,).

        The area is the length of its normal v.  With ``C = dv/dt`` by the tangents t, and ``e = v / |v|``, its second
        derivative by the tangents is ``C^T (I - e e^T) C / |v| + e v''``.
        """
        unit, slopes, d = outward_normals(self.moved), self.normal_slopes, self.moved[0].shape[1]
        second = np.swapaxes(slopes, 1, 2) @ _across(unit) @ slopes / (self.ratio * self.initial)[:, None, None]
        if d == 3:
            twist = np.cross(np.eye(d), unit[:, None, :])  # e . (a x b) = b^T twist a
            second[:, d:, :d] += twist
            second[:, :d, d:] += np.swapaxes(twist, 1, 2)
        second *= (weights / self.initial)[:, None, None]
        tangents = self.face.vector_slopes
        return sp.csr_matrix(tangents.T @ block_diagonal(second) @ tangents)


@dataclass(frozen=True)
class DeformedContact:
    """Contact of a deformed face.

    Attributes
    ----------
    gap : (c,) mm
    slope : (c,) length of the mean of the object's unit normals
    bases : (c, d, d) directions of the points
    samples_gap, samples_normal : (q,) mm, (q, d) gap and unit normal at the samples
    follows_area : whether forces are pressures on the deformed area, which a rigid object exerts; beside an elastic one
        they act along the common normal of both bodies
    turns : (c, d, d) derivative of the normal by the mean of the body's own normal over the deformed area
    """

    face: BoundarySurface
    gap: Float
    slope: Float
    bases: Float
    samples_gap: Float
    samples_normal: Float
    area: _Area
    follows_area: bool
    turns: Float

    @cached_property
    def _mean_area(self) -> Float:
        return np.asarray(self.face.average @ self.area.ratio)

    @cached_property
    def _slope_area(self) -> Float:
        """Sums (c,) over a hat are divided by these for a gap."""
        return self.slope * self._mean_area

    def nodal_forces(self, force: Float) -> Float:
        """Return the nodal forces (n, d) of forces (c, d) at the points, along their directions."""
        face, area = self.face, self.area
        tangential = force.copy()
        tangential[:, 0] = force[:, 0] * (not self.follows_area)
        at_points = np.einsum("ctk,ct->ck", self.bases, tangential)
        if not self.follows_area:
            return np.asarray(face.trace.T @ at_points)
        pressure, uneven = self._spread(force[:, 0] / self._slope_area)
        at_samples = (pressure * area.ratio)[:, None] * self.samples_normal
        return np.asarray(face.to_nodes @ np.concatenate([at_points, at_samples, *area.along(uneven)]))

    def _spread(self, per_area: Float) -> tuple[Float, Float]:
        """Return pressures (q,) and weights (q,) of the area's derivatives under forces per area (c,) at the points."""
        pressure, mean = (self.face.spread @ np.stack([per_area, per_area * self.slope * self.gap], axis=1)).T
        return pressure, self.samples_gap * pressure - mean

    @cached_property
    def rows(self) -> sp.csr_matrix:
        """Rows (c d, n d) along which the forces act: `nodal_forces` are those of the transpose."""
        face, (c, d) = self.face, self.bases.shape[:2]
        bases = self.bases.copy()
        if self.follows_area:
            bases[:, 0] = 0.0
        rows = block_diagonal(bases) @ face.vector_trace
        if self.follows_area:
            rows = rows + sp.csr_array((np.ones(c), (d * np.arange(c), np.arange(c))), (c * d, c)) @ self._d_point_gap
        return sp.csr_matrix(rows)

    @cached_property
    def _d_point_gap(self) -> sp.csr_matrix:
        """Derivative (c, n d) of the gap of the points."""
        weight = sp.diags_array(1.0 / self._slope_area) @ self.face.average
        deviation = weight @ sp.diags_array(self.samples_gap) - sp.diags_array(self.slope * self.gap) @ weight
        return sp.csr_matrix(weight @ sp.diags_array(self.area.ratio) @ self._d_gap + deviation @ self.area.derivative)

    def gap_rows(self, moved: Float) -> sp.csr_matrix:
        """Return the derivative (c, n d) of the gap beside an elastic object.

        Its material at the points has moved by (c, d), mm, which widens the gap along the common normal.  This turns
        with the body; the normal of the object is taken as constant.
        """
        face, d = self.face, self.bases.shape[2]
        mean = sp.kron(sp.diags_array(1.0 / self._mean_area) @ face.average, sp.eye_array(d))
        turned = block_diagonal(self.area.normal_slopes / self.area.initial[:, None, None]) @ face.vector_slopes
        widened = np.einsum("ck,ckl->cl", moved, self.turns)
        return sp.csr_matrix(self._d_point_gap + block_diagonal(widened[:, None, :]) @ (mean @ turned))

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
        at_samples, uneven = self._spread(force / self._slope_area)
        pressure = sp.diags_array(at_samples)
        normal = self.rows[:: self.bases.shape[1]]
        per_mean = sp.diags_array(force / self._mean_area)
        half = self._d_gap.T @ pressure @ spread - normal.T @ per_mean @ face.average @ spread
        total = half + half.T + self.area.second_derivative(uneven)
        if curvature is not None:
            weighted = (at_samples * self.area.ratio)[:, None, None] * curvature
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
    total = (face.average @ area.ratio)[:, None]

    def mean_of(normals: Float) -> Float:
        return in_symmetry_planes((face.average @ (normals * area.ratio[:, None])) / total, face.points, axes)

    mean = mean_of(normal)
    slope = np.linalg.norm(mean, axis=1)
    turns = np.zeros((*mean.shape, mean.shape[1]))
    if object_share is not None:
        own = mean_of(outward_normals(area.moved))
        size = np.linalg.norm(own, axis=1)
        turns = -(object_share * slope / size)[:, None, None] * _across(own / size[:, None])
        mean = turned_towards(mean, own, object_share)
    bases = bases_of(unit_normals(mean), face.normals)
    if object_share is not None:
        turns = _across(bases[:, 0]) @ turns / np.linalg.norm(mean, axis=1)[:, None, None]
    slope = np.maximum(slope, LEAST_SLOPE)
    point_gap = (face.average @ (gap * area.ratio)) / total[:, 0] / slope
    return DeformedContact(face, point_gap, slope, bases, gap, normal, area, object_share is None, turns)


def _across(unit: Float) -> Float:
    """Return the projections (c, d, d) onto the planes across unit vectors (c, d)."""
    return np.asarray(np.eye(unit.shape[1]) - unit[:, :, None] * unit[:, None, :])
