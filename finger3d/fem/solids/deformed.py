"""Fields of a deformed body at its nodes, and the stretch along a direction."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.locate import cells_at
from finger3d.fem.mesh.simplex import Mesh, MeshPart
from finger3d.fem.recovery.recover import averaged, displacement, nodal_gradient, nodal_pressure
from finger3d.fem.solids.hyperelastic import TotalLagrangian
from finger3d.fem.tensors import determinant


def stretch(mesh: Mesh, u: Float, point: Float, direction: Float) -> float:
    """Relative elongation |F d| - 1 at `point` (d,) along the unit `direction` (d,), mean over cells that hold it."""
    elongations = []
    for cell, bary in cells_at(mesh, point):
        nodes = mesh.cells[cell]
        slope = u[nodes].T @ mesh.element.physical_gradients(mesh.points[nodes][None], bary[None])[0][0, 0]
        elongations.append(np.linalg.norm(direction + slope @ direction) - 1.0)
    return float(np.mean(elongations))


def nodal_fields(body: TotalLagrangian, x: Float) -> tuple[Float, Float, Float]:
    """Return deformation gradient, Green-Lagrange strain and elastic Cauchy stress (n, 3, 3) at the nodes.

    They follow from the volume-weighted mean of the displacement gradient at every node.  At a node where it is folded
    over they are those of a quadrature point beside it.
    """
    points = len(quadrature(body.mesh.dim, 2)[0])
    u = displacement(body.mesh, x)
    vertex_pressure = body.pressure_scale * x[body.mesh.points.size :]

    def of_part(part: MeshPart) -> tuple[Float, Float]:
        first = part.cells[0] * points  # one point stands for all of a part
        material = body.material.of_points(slice(first, first + 1))
        f = material.deformation(_sound_gradient(part.mesh, u[part.nodes]))
        p = nodal_pressure(part.mesh, vertex_pressure[part.corners]) if material.mixed else None
        return f, material.stress(f, p) @ np.swapaxes(f, 1, 2) / determinant(f)[:, None, None]

    f, cauchy = averaged(body.mesh, of_part)
    return f, 0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(3)), cauchy


def _sound_gradient(mesh: Mesh, u: Float) -> Float:
    """Displacement gradient (n, d, d) at the nodes, where it is folded over that of a quadrature point beside it."""
    slope = nodal_gradient(mesh, u)
    folded = np.linalg.det(slope + np.eye(mesh.dim)) <= 0.0
    if folded.any():
        bary, _ = quadrature(mesh.dim, 2)
        nearest = (mesh.element.nodes @ bary.T).argmax(axis=1)
        cells, local = np.nonzero(folded[mesh.cells])
        for q in np.unique(nearest[local]):
            one, nodes = cells[nearest[local] == q], local[nearest[local] == q]
            gradients, _ = mesh.element.physical_gradients(mesh.points[mesh.cells[one]], bary[q : q + 1])
            slope[mesh.cells[one, nodes]] = np.einsum("eki,ekj->eij", u[mesh.cells[one]], gradients[:, 0])
    return slope
