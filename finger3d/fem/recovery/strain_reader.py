"""Strain of a displacement field at any points of a body, inside the cells that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.fem.mesh.locate import locate
from finger3d.fem.mesh.simplex import Mesh, axis_numbers


@dataclass(frozen=True)
class StrainReader:
    """Reads the strain of a displacement field at points of a mesh, those in mirror images included.

    Attributes
    ----------
    inside : (p,) whether a point lies in the body
    cells : (m,) the cells that hold the points inside
    gradients : (m, k, d) of the shape functions there, 1/mm
    turn : (m, d) signs of the mirror image
    """

    mesh: Mesh
    inside: NDArray[np.bool_]
    cells: Int
    gradients: Float
    turn: Float

    @classmethod
    def at(cls, mesh: Mesh, points: Float, axes: tuple[str, ...]) -> StrainReader:
        """Find the cells of points (p, d)."""
        d = mesh.dim
        turn = np.ones_like(points)
        for i in axis_numbers(axes):
            turn[:, i] = np.where(points[:, i] < 0.0, -1.0, 1.0)
        cells, bary = locate(mesh, points * turn)
        inside = cells >= 0
        nodes = mesh.points[mesh.cells[cells[inside]]]
        reference = mesh.element.gradient(bary[inside])
        jacobian = np.einsum("ekD,ekd->eDd", nodes, reference)
        return cls(mesh, inside, cells[inside], reference @ np.linalg.inv(jacobian), turn[inside][:, :d])

    def strain(self, u: Float) -> Float:
        """Return the in-plane strain (p, 3), components xx, yy, xy, of displacements (n, d); NaN outside the body."""
        return self._in_plane(self._gradient(u))

    def green_lagrange(self, u: Float) -> Float:
        """Return the in-plane Green-Lagrange strain (p, 3), components xx, yy, xy; NaN outside the body."""
        gradient = self._gradient(u)
        return self._in_plane(gradient + 0.5 * gradient.transpose(0, 2, 1) @ gradient)

    def _gradient(self, u: Float) -> Float:
        """Return the displacement gradient (m, d, d), du_i / dX_j, at the points inside."""
        gradient = np.einsum("eki,ekj->eij", u[self.mesh.cells[self.cells]], self.gradients)
        return np.asarray(gradient * self.turn[:, :, None] * self.turn[:, None, :])

    def _in_plane(self, tensor: Float) -> Float:
        """Return the components xx, yy and the mean of xy and yx of tensors (m, d, d) at all points (p, 3)."""
        out = np.full((len(self.inside), 3), np.nan)
        out[self.inside] = np.stack(
            [tensor[:, 0, 0], tensor[:, 1, 1], 0.5 * (tensor[:, 0, 1] + tensor[:, 1, 0])], axis=1
        )
        return out
