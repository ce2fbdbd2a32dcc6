"""Edges and outline of a 2D mesh as matplotlib paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.design import Design

if TYPE_CHECKING:
    from matplotlib.path import Path


_MOST_CELLS = 4000  # of a mesh whose edges are drawn; those of a finer mesh would merge into a grey area


def _runs(lines: Float) -> Path:
    """Return one path of k separate polylines, shape (k, p, 2): far faster to draw than k artists."""
    from matplotlib.path import Path

    codes = np.full(lines.shape[:2], Path.LINETO)
    codes[:, 0] = Path.MOVETO
    return Path(lines.reshape(-1, 2), codes.ravel())


def edges_of(mesh: Mesh, moved: Float) -> Path:
    """Return every edge of the cells once, at nodes moved to (n, 2) mm; an empty path for a very fine mesh."""
    if len(mesh.cells) > _MOST_CELLS:
        return _runs(np.zeros((0, 2, 2)))
    edges = _sides(mesh)
    ends = np.sort(edges[:, [0, -1]], axis=1)
    return _runs(moved[edges[np.unique(ends, axis=0, return_index=True)[1]]])


def interfaces_of(mesh: Mesh, moved: Float) -> Path:
    """Return the edges between the parts of a section, at nodes moved to (n, 2) mm; an empty path for one part."""
    edges = _sides(mesh)
    if mesh.part is None:
        return _runs(moved[edges[:0]])
    part = np.repeat(mesh.part, 3)
    _, first, number = np.unique(np.sort(edges[:, [0, -1]], axis=1), axis=0, return_index=True, return_inverse=True)
    between = np.zeros(len(first), dtype=np.bool_)
    number = number.ravel()
    np.logical_or.at(between, number, part != part[first[number]])
    return _runs(moved[edges[first[between]]])


def _sides(mesh: Mesh) -> Int:
    """Return the nodes (3 e, 2 or 3) along the edges of all cells, in order."""
    sides = mesh.element.edges
    if mesh.element.is_quadratic:
        sides = np.insert(sides, 1, range(3, 6), axis=1)
    return np.asarray(mesh.cells[:, sides].reshape(-1, len(sides[0])))


def outline_of(mesh: Mesh, moved: Float) -> Path:
    """Return the boundary of a section as a closed path, at nodes moved to (n, 2) mm."""
    from matplotlib.path import Path

    facets = np.concatenate([f for f in mesh.facets.values() if len(f)])
    facets = facets[:, [0, 2, 1]] if mesh.element.is_quadratic else facets
    following = {int(a): i for i, a in enumerate(facets[:, 0])}
    ring = [0]
    while (after := following[int(facets[ring[-1], -1])]) != 0:
        ring.append(after)
    return Path(np.concatenate([moved[facets[ring, :-1]].reshape(-1, 2), moved[facets[:1, 0]]]), closed=True)


def middle_section(design: Design, count: int = 201) -> Float:
    """Return the closed outline (k, 2), mm, of the section of a finger at z = 0, with `count` points on its top."""
    half = design.half_length_mm
    x = np.linspace(-half, half, count)
    return np.column_stack([[-half, *x, half, -half], [0.0, *np.nan_to_num(design.top(x, np.zeros_like(x))), 0.0, 0.0]])
