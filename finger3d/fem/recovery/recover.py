"""Fields from unknowns: displacement, strain and stress at the nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh, MeshPart, signed_volumes

Across = Callable[[Float, Float], tuple[Float, Float]]

_CELLS_AT_ONCE = 4096  # bounds the memory of their gradients


def displacement(mesh: Mesh, unknowns: Float) -> Float:
    """Displacements (n, d) mm from all unknowns (N,)."""
    return unknowns[: mesh.points.size].reshape(mesh.points.shape)


def averaged(mesh: Mesh, of_part: Callable[[MeshPart], tuple[Float, ...]]) -> tuple[Float, ...]:
    """Nodal fields (n, ...) of a body of several parts, at interfaces the mean of the parts weighted by volume.

    Parameters
    ----------
    of_part : returns the fields (n', ...) at the nodes of one part
    """
    parts = mesh.by_part
    if len(parts) == 1:
        return of_part(parts[0])
    weight = np.zeros((len(parts), len(mesh.points)))
    for row, part in zip(weight, parts, strict=True):
        volume = np.abs(signed_volumes(part.mesh))
        np.add.at(row, part.nodes[part.mesh.cells], volume[:, None])
    weight /= weight.sum(axis=0)
    total: list[Float] = []
    for row, part in zip(weight, parts, strict=True):
        fields = of_part(part)
        total = total or [np.zeros((len(mesh.points), *field.shape[1:])) for field in fields]
        for sum_, field in zip(total, fields, strict=True):
            sum_[part.nodes] += row[part.nodes].reshape(-1, *[1] * (field.ndim - 1)) * field
    return tuple(total)


def strain_and_stress(
    mesh: Mesh,
    unknowns: Float,
    laws: Sequence[Elasticity],
    pressure_scale: float,
    across: Sequence[Across] | None = None,
) -> tuple[Float, Float]:
    """Linear strain and stress (MPa) at the nodes.

    Parameters
    ----------
    unknowns : (N,) displacements, then pressures in units of `pressure_scale` (MPa) in the mixed form
    laws : of the parts by their number
    across : of a section, returns strain and stress (n,) across it from those in its plane, for every part

    Returns
    -------
    strain, stress : (n, d, d), or (n, 3, 3) with `across`
    """
    u = displacement(mesh, unknowns)
    vertex_pressure = pressure_scale * unknowns[mesh.points.size :]

    def of_part(part: MeshPart) -> tuple[Float, Float]:
        law = laws[part.number]
        strain = nodal_strain(part.mesh, u[part.nodes])
        sigma = law.stress(strain)
        if law.mixed:
            p = nodal_pressure(part.mesh, vertex_pressure[part.corners])
            sigma = sigma + p[:, None, None] * np.eye(mesh.dim)
        if across is None:
            return strain, sigma
        return whole(strain, sigma, *across[part.number](strain, sigma))

    strain, sigma = averaged(mesh, of_part)
    return strain, sigma


def nodal_pressure(mesh: Mesh, at_vertices: Float) -> Float:
    """Values (n,) at all nodes of a field that is linear over each cell, from those at the vertices, ascending."""
    p = np.zeros(len(mesh.points))
    p[mesh.vertices] = at_vertices
    p[mesh.cells[:, mesh.dim + 1 :]] = p[mesh.cells[:, mesh.element.edges]].mean(axis=2)
    return p


def nodal_gradient(mesh: Mesh, u: Float) -> Float:
    """Displacement gradient (n, d, d) at the nodes, row the component: volume-weighted mean over the adjacent cells."""
    n, d = mesh.points.shape
    k = mesh.cells.shape[1]
    total, weight = np.zeros((n, d, d)), np.zeros(n)
    for start in range(0, len(mesh.cells), _CELLS_AT_ONCE):
        cells = mesh.cells[start : start + _CELLS_AT_ONCE]
        gradients, det = mesh.element.physical_gradients(mesh.points[cells], mesh.element.nodes)
        slope = np.einsum("eki,eqkj->eqij", u[cells], gradients, optimize=True)
        volume = np.broadcast_to(det.mean(axis=1)[:, None], (len(cells), k))
        np.add.at(total, cells, slope * volume[:, :, None, None])
        np.add.at(weight, cells, volume)
    return total / weight[:, None, None]


def extrapolated(mesh: Mesh, values: Float) -> Float:
    """Values (n, ...) at the nodes of a field known at the quadrature points (e q, ...), q = d + 1 in a cell.

    It is extrapolated linearly within each cell, and averaged over the cells at a node by volume.
    """
    n, d = mesh.points.shape
    bary, _ = quadrature(d, 2)
    to_nodes = mesh.element.nodes @ np.linalg.inv(bary)
    local = np.einsum("kq,eq...->ek...", to_nodes, values.reshape(len(mesh.cells), d + 1, *values.shape[1:]))
    weights = np.broadcast_to(np.abs(signed_volumes(mesh))[:, None], mesh.cells.shape)
    total, weight = np.zeros((n, *values.shape[1:])), np.zeros(n)
    np.add.at(total, mesh.cells, local * weights.reshape(*weights.shape, *[1] * (values.ndim - 1)))
    np.add.at(weight, mesh.cells, weights)
    return total / weight.reshape(-1, *[1] * (values.ndim - 1))


def nodal_strain(mesh: Mesh, u: Float) -> Float:
    """Linear strain (n, d, d) at the nodes."""
    slope = nodal_gradient(mesh, u)
    return 0.5 * (slope + np.swapaxes(slope, 1, 2))


def whole(strain: Float, sigma: Float, strain_across: Float, stress_across: Float) -> tuple[Float, Float]:
    """Strain and stress (n, 3, 3) of a section from those in its plane (n, 2, 2) and across it (n,)."""
    e, s = np.zeros((len(strain), 3, 3)), np.zeros((len(strain), 3, 3))
    e[:, :2, :2], s[:, :2, :2] = strain, sigma
    e[:, 2, 2], s[:, 2, 2] = strain_across, stress_across
    return e, s
