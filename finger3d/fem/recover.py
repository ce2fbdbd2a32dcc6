"""Fields from unknowns: displacement, strain and stress at the nodes."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.assembly import Stiffness
from finger3d.fem.elements import quadrature
from finger3d.fem.material import LinearElasticity, Material
from finger3d.fem.simplex import Mesh

_CELLS_AT_ONCE = 4096  # bounds the memory of their gradients


def displacement(mesh: Mesh, unknowns: Float) -> Float:
    """Displacements (n, d) mm from all unknowns (N,)."""
    return unknowns[: mesh.points.size].reshape(mesh.points.shape)


def pressure(mesh: Mesh, stiffness: Stiffness, unknowns: Float) -> Float:
    """Nodal pressure (n,) MPa of the mixed form, linear over each cell."""
    return nodal_pressure(mesh, stiffness.pressure_scale * unknowns[mesh.points.size :])


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
    corners = mesh.points[mesh.cells[:, : d + 1]]
    volume = np.abs(np.linalg.det(np.diff(corners, axis=1)))
    weights = np.broadcast_to(volume[:, None], mesh.cells.shape)
    total, weight = np.zeros((n, *values.shape[1:])), np.zeros(n)
    np.add.at(total, mesh.cells, local * weights.reshape(*weights.shape, *[1] * (values.ndim - 1)))
    np.add.at(weight, mesh.cells, weights)
    return total / weight.reshape(-1, *[1] * (values.ndim - 1))


def nodal_strain(mesh: Mesh, u: Float) -> Float:
    """Linear strain (n, d, d) at the nodes."""
    slope = nodal_gradient(mesh, u)
    return 0.5 * (slope + np.swapaxes(slope, 1, 2))


def stress(strain: Float, elastic: LinearElasticity, p: Float | None = None) -> Float:
    """Stress (n, d, d) MPa from strain, with the pressure `p` (n,) MPa of the mixed form."""
    out = elastic.stress(strain)
    return out if p is None else out + p[:, None, None] * np.eye(strain.shape[-1])


def across(strain: Float, sigma: Float, material: Material, plane_strain: bool) -> tuple[Float, Float]:
    """Strain and stress (n, 3, 3) of a section (n, 2, 2), with what plane strain or plane stress implies across it."""
    e, s = np.zeros((len(strain), 3, 3)), np.zeros((len(strain), 3, 3))
    e[:, :2, :2], s[:, :2, :2] = strain, sigma
    e[:, 2, 2], s[:, 2, 2] = material.across(strain, sigma, plane_strain)
    return e, s
