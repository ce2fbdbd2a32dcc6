"""Contact of a deformed surface: gaps as means over the deformed area, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.directions import bases_of
from finger3d.fem.simplex import axis_numbers
from finger3d.fem.traces import BoundarySurface, outward_normals


@dataclass(frozen=True)
class DeformedContact:
    """Contact of a deformed face.

    Attributes
    ----------
    gap : (c,) mm
    rows : (c d, n d) displacement of every point along its directions
    bases : (c, d, d)
    area_ratio : (q,) deformed over initial area at the face's samples
    d_gap, d_area_ratio : (q, n d) derivatives of the gap and of `area_ratio` at the samples
    gap_at_samples : (q,) mm, gap at the samples
    d2_area_ratio : (q,) weights -> (n d, n d), the weighted sum of the second derivatives of `area_ratio`
    """

    gap: Float
    rows: sp.csr_matrix
    bases: Float
    area_ratio: Float
    d_gap: sp.csr_matrix
    d_area_ratio: sp.csr_matrix
    gap_at_samples: Float
    d2_area_ratio: Callable[[Float], sp.csr_matrix]

    def geometric_stiffness(self, face: BoundarySurface, force: Float, curvature: Float | None = None) -> sp.csr_matrix:
        """Second derivative (n d, n d) of the gaps under normal forces (c,) N; what contact takes from K.

        The pressure acts on the deformed area, without which the surface's own pressure would push its middle nodes
        along it: from pressures of a few G on, K would lose its definiteness there.

        Parameters
        ----------
        curvature : (q, d, d) array, 1/mm, optional
            Second derivatives of the gap at the samples; zero unless given.
        """
        per_area = sp.diags_array(force / (face.average @ self.area_ratio))
        pressure = sp.diags_array(face.average.T @ per_area.diagonal())
        normal = self.rows[:: self.bases.shape[1]]
        half = self.d_gap.T @ pressure @ self.d_area_ratio - normal.T @ per_area @ face.average @ self.d_area_ratio
        uneven = self.gap_at_samples * pressure.diagonal() - face.average.T @ (per_area @ self.gap)
        total = half + half.T + self.d2_area_ratio(uneven)
        if curvature is not None:
            weighted = (pressure.diagonal() * self.area_ratio)[:, None, None] * curvature
            values = face.interpolate
            for i, j in np.ndindex(*curvature.shape[1:]):
                unit = np.zeros(curvature.shape[1:])
                unit[i, j] = 1.0
                total = total + sp.kron(values.T @ sp.diags_array(weighted[:, i, j]) @ values, unit)
        return sp.csr_matrix(total)


def deformed_contact(
    face: BoundarySurface,
    *,
    points: Float,
    displacement: Float,
    gap: Float,
    normal: Float,
    axes: tuple[str, ...],
    share: Float | None = None,
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
    share : (c,) array, optional
        Share of an elastic object in the compliance of each point; the common normal turns from that of the object
        towards that of the body by this share.
    """
    d = displacement.shape[1]
    area_ratio, d_area_ratio, d2_area_ratio = _area_ratio(face, points, displacement)
    area = face.average @ area_ratio
    mean_normal = (face.average @ (normal * area_ratio[:, None])) / area[:, None]
    if share is not None:
        own = outward_normals([slope @ (points + displacement) for slope in face.along])
        own = (face.average @ (own * area_ratio[:, None])) / area[:, None]
        own *= (np.linalg.norm(mean_normal, axis=1) / np.linalg.norm(own, axis=1))[:, None]
        mean_normal = (1.0 - share[:, None]) * mean_normal - share[:, None] * own
    mean_gap = (face.average @ (gap * area_ratio)) / area
    for k in axis_numbers(axes):
        mean_normal[face.points[:, k] == 0.0, k] = 0.0
    bases = bases_of(mean_normal / np.linalg.norm(mean_normal, axis=1)[:, None])
    d_gap = _rows([sp.diags_array(normal[:, k]) @ face.interpolate for k in range(d)])
    # d(mean gap) = mean of d(gap) and of (gap - mean gap) d(area)
    weight = sp.diags_array(1.0 / area) @ face.average
    deviation = weight @ sp.diags_array(gap) - sp.diags_array(mean_gap) @ weight
    blocks = [_rows([sp.diags_array(bases[:, t, k]) @ face.trace for k in range(d)]) for t in range(d)]
    if share is None:
        blocks[0] = weight @ sp.diags_array(area_ratio) @ d_gap + deviation @ d_area_ratio
    rows = sp.vstack(blocks, format="csr")[np.arange(len(mean_gap) * d).reshape(d, -1).T.ravel()]
    return DeformedContact(
        gap=mean_gap,
        rows=sp.csr_matrix(rows),
        bases=bases,
        area_ratio=area_ratio,
        d_gap=d_gap,
        d_area_ratio=d_area_ratio,
        gap_at_samples=gap,
        d2_area_ratio=d2_area_ratio,
    )


def _rows(parts: Sequence[sp.csr_matrix]) -> sp.csr_matrix:
    """Rows (m, n d) on displacements from rows (m, n) on each of their components."""
    d, n = len(parts), parts[0].shape[1]
    return sp.csr_matrix(sp.hstack(parts, format="csr")[:, np.arange(n * d).reshape(d, n).T.ravel()])


def _area_ratio(
    face: BoundarySurface, points: Float, u: Float
) -> tuple[Float, sp.csr_matrix, Callable[[Float], sp.csr_matrix]]:
    """Deformed over initial area (q,) at the samples, its derivative (q, n d), and weighted sums of its second one."""
    d = u.shape[1]
    rest, moved = ([slope @ x for slope in face.along] for x in (points, points + u))
    if d == 2:
        vector, initial = moved[0], np.linalg.norm(rest[0], axis=1)
    else:
        vector, initial = np.cross(*moved), np.linalg.norm(np.cross(*rest), axis=1)
    length = np.linalg.norm(vector, axis=1)
    unit = vector / length[:, None]
    turned = [unit] if d == 2 else [np.cross(moved[1], unit), np.cross(unit, moved[0])]
    scaled = [sp.diags_array(1.0 / initial) @ slope for slope in face.along]
    spread = _rows([sum(sp.diags_array(t[:, k]) @ x for t, x in zip(turned, scaled, strict=True)) for k in range(d)])

    def weighted_second(weights: Float) -> sp.csr_matrix:
        parts = [_change(face, moved, i) for i in range(d)]
        stretched = sp.diags_array(weights / (length * initial))
        total = sum(part.T @ stretched @ part for part in parts)
        total = total - spread.T @ sp.diags_array(weights * initial / length) @ spread
        if d == 3:
            cross = sp.diags_array(weights / initial)
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                along = cross @ sp.diags_array(unit[:, i])
                first, second = ([_component(x, axis) for axis in (j, k)] for x in face.along)
                half = first[0].T @ along @ second[1] - first[1].T @ along @ second[0]
                total = total + half + half.T
        return sp.csr_matrix(total)

    return length / initial, spread, weighted_second


def _component(rows: sp.csr_matrix, axis: int) -> sp.csr_matrix:
    """Rows (q, 3 n) on one component of displacements from rows (q, n)."""
    return sp.csr_matrix(sp.kron(rows, np.eye(3)[[axis]], format="csr"))


def _change(face: BoundarySurface, moved: list[Float], i: int) -> sp.csr_matrix:
    """Derivative (q, n d) of component i of the tangent in 2D, of the tangents' cross product in 3D."""
    d = moved[0].shape[1]
    if d == 2:
        return sp.csr_matrix(sp.kron(face.along[0], np.eye(2)[[i]], format="csr"))
    j, k = (i + 1) % 3, (i + 2) % 3
    first, second = moved
    return sp.csr_matrix(
        sp.diags_array(second[:, k]) @ _component(face.along[0], j)
        - sp.diags_array(second[:, j]) @ _component(face.along[0], k)
        + sp.diags_array(first[:, j]) @ _component(face.along[1], k)
        - sp.diags_array(first[:, k]) @ _component(face.along[1], j)
    )
