"""Local refinement of a quadratic mesh by bisection of longest edges (Rivara 1984).

A cell that is too large is halved at the middle of its longest edge.  The neighbours across that edge are halved with
it, after their own longest edges, so that the mesh stays conforming.  In two dimensions no angle falls below half of
the smallest one of the mesh (Rosenberg and Stenger 1975).  New nodes lie on the curved cells that they divide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh import EDGES, Mesh, quadratic

TOO_LONG = 1.8
"""Longest edge of a cell over the wanted edge length above which the cell is halved; the diagonal of a cube is 1.73."""

_DIGITS = 9
"""Decimals to which lengths (mm) are compared: equal edges are ordered by their nodes and not by round-off."""


class _Marked(NamedTuple):
    """Edges that are halved: ascending keys of their ends, middle nodes, and ranks by length, each (k,)."""

    keys: Int
    middles: Int
    ranks: Int
    base: int

    def of(self, edges: Int) -> Int:
        """Return the number of each edge (..., 2) among the marked ones, -1 for others."""
        keys = _keys(edges, self.base)
        positions = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[positions] == keys, positions, -1)


def refined(mesh: Mesh, size: Callable[[Float], Float], check: Callable[[int], None] = lambda cells: None) -> Mesh:
    """Return a quadratic mesh whose cells are halved until they are as small as wanted.

    Parameters
    ----------
    mesh : quadratic
    size : function of points (n, d)
        Wanted edge length (n,) mm.  It is evaluated at the centroids of cells.
    check : called with the number of cells before each round; it may raise
    """
    d = mesh.dim
    points = mesh.points
    cells = mesh.cells[:, : d + 1]
    facets = {label: f[:, :d] for label, f in mesh.facets.items()}
    parents = np.arange(len(cells))
    places = np.tile(np.eye(d + 1), (len(cells), 1, 1))
    while True:
        check(len(cells))
        edges, number, ranks = _edges(points, cells)
        halved = _edges_to_halve(points, cells, number, ranks, size)
        if not halved.any():
            break
        chosen = np.flatnonzero(halved)
        middles = len(points) + np.arange(len(chosen))
        cell, edge = np.nonzero(halved[number])
        _, first = np.unique(number[cell, edge], return_index=True)
        ends = _pairs(d + 1)[edge[first]]
        bary = places[cell[first, None], ends].mean(axis=1)
        points = np.vstack([points, _positions(mesh, parents[cell[first]], bary)])
        marked = _Marked(_keys(edges[chosen], len(points)), middles, ranks[chosen], len(points))
        cells, origin, places = _split(cells, places, marked)
        parents = parents[origin]
        facets = {label: _split(f, np.zeros((len(f), d, 0)), marked)[0] for label, f in facets.items()}
    if len(cells) == len(mesh.cells):
        return mesh
    used, compact = np.unique(cells, return_inverse=True)
    renumbered = {label: np.searchsorted(used, f) for label, f in facets.items()}
    part = None if mesh.part is None else mesh.part[parents]
    linear = replace(mesh, points=points[used], cells=compact.reshape(cells.shape), facets=renumbered, part=part)
    straight = quadratic(linear)
    curved = straight.points.copy()
    for k, (i, j) in enumerate(EDGES[d]):
        curved[straight.cells[:, d + 1 + k]] = _positions(mesh, parents, 0.5 * (places[:, i] + places[:, j]))
    return replace(straight, points=curved)


def _pairs(corners: int) -> Int:
    return np.array(list(combinations(range(corners), 2)))


def _keys(edges: Int, base: int) -> Int:
    """Return a number for each edge (..., 2) between nodes below `base`, whichever way it runs."""
    return np.asarray(edges.min(axis=-1) * base + edges.max(axis=-1))


def _positions(mesh: Mesh, cells: Int, bary: Float) -> Float:
    """Return positions (n, d) of barycentric places (n, d + 1) in curved cells (n,)."""
    return np.asarray(np.einsum("nk,nkd->nd", mesh.element.shape(bary), mesh.points[mesh.cells[cells]]))


def _edges(points: Float, cells: Int) -> tuple[Int, Int, Int]:
    """Return the edges (k, 2) in the order of their keys, those of every cell (e, pairs), and ranks (k,) by length."""
    ends = cells[:, _pairs(cells.shape[1])]
    keys, number = np.unique(_keys(ends, len(points)), return_inverse=True)
    edges = np.stack([keys // len(points), keys % len(points)], axis=1)
    length = np.round(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1), _DIGITS)
    ranks = np.empty(len(keys), dtype=np.int64)
    ranks[np.lexsort((keys, length))] = np.arange(len(keys))
    return edges, number.reshape(ends.shape[:2]), ranks


def _edges_to_halve(
    points: Float, cells: Int, number: Int, ranks: Int, size: Callable[[Float], Float]
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which edges (k,) are halved: those of cells too large, and with any edge the longest of its cells."""
    every = np.arange(len(cells))
    longest = number[every, ranks[number].argmax(axis=1)]
    corners = points[cells]
    pairs = _pairs(cells.shape[1])
    length = np.linalg.norm(corners[:, pairs[:, 0]] - corners[:, pairs[:, 1]], axis=2).max(axis=1)
    halved = np.zeros(len(ranks), dtype=bool)
    halved[longest[length > TOO_LONG * size(corners.mean(axis=1))]] = True
    while not halved[needed := longest[halved[number].any(axis=1)]].all():
        halved[needed] = True
    return halved


def _split(simplices: Int, places: Float, marked: _Marked) -> tuple[Int, Int, Float]:
    """Halve simplices (m, k) at their marked edges, the longest first.

    Returns
    -------
    simplices : (n, k)
    origin : (n,) number of the simplex that each is a part of
    places : (n, k, ...) of the corners, those of new ones halfway between old ones
    """
    done: list[tuple[Int, Int, Float]] = []
    pairs = _pairs(simplices.shape[1])
    origin = np.arange(len(simplices))
    while True:
        number = marked.of(simplices[:, pairs])
        rank = np.where(number >= 0, marked.ranks[number], -1)
        longest = rank.argmax(axis=1)
        whole = rank.max(axis=1, initial=-1) < 0
        done.append((simplices[whole], origin[whole], places[whole]))
        if whole.all():
            return _joined(done)
        simplices, origin, places = simplices[~whole], origin[~whole], places[~whole]
        every = np.arange(len(simplices))
        i, j = pairs[longest[~whole]].T
        middle = marked.middles[number[~whole][every, longest[~whole]]]
        halfway = 0.5 * (places[every, i] + places[every, j])
        halves = []
        for replaced in (i, j):
            corners, corner_places = simplices.copy(), places.copy()
            corners[every, replaced], corner_places[every, replaced] = middle, halfway
            halves.append((corners, origin, corner_places))
        simplices, origin, places = _joined(halves)


def _joined(parts: list[tuple[Int, Int, Float]]) -> tuple[Int, Int, Float]:
    simplices, origins, places = zip(*parts, strict=True)
    return np.concatenate(simplices), np.concatenate(origins), np.concatenate(places)
