"""Small structured meshes and loads that tests compare with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Element, Mesh, curved_volume, quadratic
from finger3d.fem.solvers.condense import is_installed
from finger3d.fem.surface import local_rows, strain_row, surface
from finger3d.objects import vertical_frame
from validation._common import box, shuffled
from validation._common import mapped as mapped

SOLVERS = ["superlu", *filter(is_installed, ("pardiso", "mumps"))]
"""Solvers of a condensation that are installed."""


def grid(counts: tuple[int, ...], shuffle: float = 0.0, seed: int = 0) -> Mesh:
    """Linear Kuhn mesh of the unit square or cube; interior nodes moved at random by `shuffle` of a cell."""
    return shuffled(box([np.linspace(0.0, 1.0, n + 1) for n in counts]), shuffle, seed)


def full(upper: sp.csr_matrix) -> sp.csr_matrix:
    """The symmetric matrix with this upper triangle."""
    return (upper + sp.triu(upper, 1).T).tocsr()


def held_cube(nu: float, dim: int = 3) -> tuple[Mesh, Stiffness, np.ndarray, sp.csr_matrix]:
    """A unit square or cube fixed at its base: mesh, stiffness, fixed unknowns, and rows of its top and of a strain."""
    mesh = quadratic(grid((3,) * dim, 0.2))
    held = np.unique(mesh.facets["y-"])
    fixed = (held[:, None] * dim + np.arange(dim)).ravel()
    top = surface(mesh, "y+")
    rows = sp.vstack([local_rows(top, vertical_frame(dim)), strain_row(mesh, np.full(dim, 0.4), np.eye(dim)[0])])
    return mesh, stiffness(mesh, Elasticity.of(1.0, nu)), fixed, sp.csr_matrix(rows)


def points_in(element: Element) -> np.ndarray:
    """Seven random points of an element, in barycentric coordinates."""
    return np.random.default_rng(1).dirichlet(np.ones(element.dim + 1), 7)


def interface(mesh: Mesh, first: int, second: int) -> np.ndarray:
    """Nodes (m,) that cells of two parts share."""
    return np.intersect1d(*(mesh.cells[mesh.part == number] for number in (first, second)))


def part_volume(mesh: Mesh, number: int) -> float:
    """Volume (area in 2D) of the curved cells of a part."""
    return curved_volume(replace(mesh, cells=mesh.cells[mesh.part == number], part=None, part_labels=()))


def edge_lengths(mesh: Mesh, facets: str) -> tuple[Float, Float]:
    """Corners (f, 3, 3) mm of triangles on the surface, and the mean length (f,) mm of the edges of each."""
    corners = mesh.points[mesh.facets[facets][:, :3]]
    return corners, np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
