"""Fields from unknowns: displacement, strain and stress at the nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d.fem.assembly import Elasticity, Stiffness
from finger3d.fem.elements import physical_gradients
from finger3d.fem.simplex import EDGES, Mesh

Float = NDArray[np.float64]


def displacement(mesh: Mesh, unknowns: Float) -> Float:
    """Displacements (n, d) mm from all unknowns (N,)."""
    return unknowns[: mesh.points.size].reshape(mesh.points.shape)


def pressure(mesh: Mesh, stiffness: Stiffness, unknowns: Float) -> Float:
    """Nodal p = lam div(u) (n,) MPa of the mixed form, linear over each cell."""
    p = np.zeros(len(mesh.points))
    p[stiffness.pressure_vertices] = stiffness.pressure_scale * unknowns[mesh.points.size :]
    corners = mesh.cells[:, EDGES[mesh.dim]]
    p[mesh.cells[:, mesh.dim + 1 :]] = p[corners].mean(axis=2)
    return p


def nodal_strain(mesh: Mesh, u: Float) -> Float:
    """Strain (n, d, d) at the nodes: mean over the cells that share them, weighted by their volume."""
    n, d = mesh.points.shape
    k = mesh.cells.shape[1]
    corners = np.eye(d + 1)
    bary = np.vstack([corners, corners[EDGES[d]].mean(axis=1)]) if mesh.is_quadratic else corners
    total, weight = np.zeros((n, d, d)), np.zeros(n)
    for start in range(0, len(mesh.cells), 4096):
        cells = mesh.cells[start : start + 4096]
        gradients, det = physical_gradients(mesh.points[cells], bary, mesh.is_quadratic)
        slope = np.einsum("ekj,eqki->eqij", u[cells], gradients, optimize=True)
        volume = np.broadcast_to(det.mean(axis=1)[:, None], (len(cells), k))
        np.add.at(total, cells, 0.5 * (slope + np.swapaxes(slope, 2, 3)) * volume[:, :, None, None])
        np.add.at(weight, cells, volume)
    return total / weight[:, None, None]


def stress(strain: Float, elastic: Elasticity, p: Float | None = None) -> Float:
    """Stress (n, d, d) MPa from strain; with `p` (n,) MPa of the mixed form in place of lam tr(strain)."""
    d = strain.shape[-1]
    spherical = elastic.lame * np.trace(strain, axis1=1, axis2=2) if p is None else p
    return 2.0 * elastic.shear * strain + spherical[:, None, None] * np.eye(d)


def across(strain: Float, sigma: Float, modulus: float, nu: float, plane_strain: bool) -> tuple[Float, Float]:
    """Strain and stress (n, 3, 3) of a section (n, 2, 2), with what plane strain or plane stress implies across it."""
    e, s = np.zeros((len(strain), 3, 3)), np.zeros((len(strain), 3, 3))
    e[:, :2, :2], s[:, :2, :2] = strain, sigma
    in_plane = np.trace(sigma, axis1=1, axis2=2)
    if plane_strain:
        s[:, 2, 2] = nu * in_plane
    else:
        e[:, 2, 2] = -nu / modulus * in_plane
    return e, s
