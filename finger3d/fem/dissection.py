"""Nested dissection of a sparse symmetric matrix: an elimination order with little fill, as a tree of separators.

A graph is cut in two halves by a smoothed difference of distances from two of its ends, and the edges that are cut are
covered by as few vertices as possible (Koenig's theorem on bipartite graphs); these form the separator, which is
eliminated after both halves. George 1973, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import maximum_bipartite_matching

from finger3d._types import Int

_LEAF = 48
"""Vertices of a part that is not cut any further: unknowns of some dozen nodes, a front of a few hundred rows."""

_SMOOTHINGS = 3
"""Averages over neighbours: distances are integers, and many of them equal where the cut runs."""


@dataclass(frozen=True)
class Separators:
    """Tree of separators, in an order in which children precede their parent.

    Attributes
    ----------
    unknowns : for each separator the numbers of its unknowns
    children : for each separator the numbers of the separators below it
    """

    unknowns: tuple[Int, ...]
    children: tuple[tuple[int, ...], ...]


def dissect(pattern: sp.csr_matrix) -> Separators:
    """Return separators of a symmetric pattern (n, n) that has its whole diagonal."""
    first, group = _groups(pattern)
    graph = pattern[first]
    graph = sp.csr_matrix((np.ones(graph.nnz), group[graph.indices], graph.indptr), (len(first), len(first)))
    graph.sum_duplicates()
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    graph.data[:] = 1.0
    members = np.argsort(group, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(group, minlength=len(first)))])
    nodes: list[Int] = []
    children: list[tuple[int, ...]] = []

    def add(vertices: Int, below: tuple[int, ...]) -> tuple[int, ...]:
        nodes.append(np.concatenate([members[starts[v] : starts[v + 1]] for v in vertices]))
        children.append(below)
        return (len(nodes) - 1,)

    def visit(graph: sp.csr_matrix, vertices: Int) -> tuple[int, ...]:
        """Add the separators of a part and return the topmost ones."""
        if not len(vertices):
            return ()
        if len(vertices) > _LEAF:
            near, far, cut = _cut(graph)
            if near.any() and far.any():
                below = visit(graph[near][:, near], vertices[near]) + visit(graph[far][:, far], vertices[far])
                return add(vertices[cut], below) if cut.any() else below
        return add(vertices, ())

    visit(graph, np.arange(len(first)))
    return Separators(tuple(nodes), tuple(children))


def _groups(pattern: sp.csr_matrix) -> tuple[Int, Int]:
    """Return one unknown of each group of unknowns with equal rows, such as those of a node, and the group of each."""
    ones = sp.csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr), pattern.shape)
    # Equal rows have equal sums; those of different rows are equal with a probability of some 1e-16 a pair.
    sums = ones @ np.random.default_rng(0).random(pattern.shape[0])
    _, first, group = np.unique(sums, return_index=True, return_inverse=True)
    return first, group


def _cut(graph: sp.csr_matrix) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the vertices of two halves without edges between them, and of their separator."""
    start = _distance(graph, 0)
    none = np.zeros(len(start), dtype=bool)
    if (start < 0).any():  # the graph has several components
        return start >= 0, start < 0, none
    from_one = _distance(graph, int(start.argmax()))
    from_other = _distance(graph, int(from_one.argmax()))
    place = (from_one - from_other).astype(np.float64)
    degree = np.maximum(np.diff(graph.indptr), 1)
    for _ in range(_SMOOTHINGS):
        place = 0.5 * (place + graph @ place / degree)
    near = np.zeros(len(place), dtype=bool)
    near[np.argsort(place, kind="stable")[: len(place) // 2]] = True
    cut = _cover(graph, near)
    return near & ~cut, ~near & ~cut, cut


def _distance(graph: sp.csr_matrix, start: int) -> Int:
    """Return the number of edges from a vertex to every vertex (n,), -1 if it cannot be reached."""
    found = np.full(graph.shape[0], -1, dtype=np.int64)
    front, level = np.array([start]), 0
    while len(front):
        found[front] = level
        around = graph.indices[_ranges(graph.indptr[front], graph.indptr[front + 1])]
        front, level = np.unique(around[found[around] < 0]), level + 1
    return found


def _ranges(starts: Int, ends: Int) -> Int:
    """Return the concatenation of ranges."""
    counts = ends - starts
    offsets = np.repeat(starts - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    return np.asarray(np.arange(counts.sum()) + offsets)


def _cover(graph: sp.csr_matrix, near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the smallest set of vertices (n,) that touches all edges between two halves."""
    ours, theirs = np.flatnonzero(near), np.flatnonzero(~near)
    edges = graph[ours][:, theirs].tocsr()
    match = np.asarray(maximum_bipartite_matching(edges, perm_type="column"))  # the partner of each of ours, or -1
    partner = np.full(len(theirs), -1)
    partner[match[match >= 0]] = np.flatnonzero(match >= 0)
    seen, seen_there = np.zeros(len(ours), dtype=bool), np.zeros(len(theirs), dtype=bool)
    front = np.flatnonzero((match < 0) & (np.diff(edges.indptr) > 0))
    while len(front):  # along alternating paths
        seen[front] = True
        there = np.unique(edges.indices[_ranges(edges.indptr[front], edges.indptr[front + 1])])
        there = there[~seen_there[there]]
        seen_there[there] = True
        front = partner[there]
        front = front[(front >= 0)]
        front = front[~seen[front]]
    cover = np.zeros(len(near), dtype=bool)
    cover[ours[(match >= 0) & ~seen]] = True
    cover[theirs[seen_there]] = True
    return cover
