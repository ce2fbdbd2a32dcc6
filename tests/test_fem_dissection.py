"""Separators: nothing lost, halves without edges between them, and little fill on a grid."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.dissection import dissect


def lattice(*counts: int) -> sp.csr_matrix:
    """Pattern of the points of a grid, each coupled to its neighbours along the axes."""
    found = sp.csr_matrix(np.ones((1, 1)))
    for n in counts:
        line = sp.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n))
        found = sp.kronsum(sp.csr_matrix(line), found) if found.shape[0] > 1 else sp.csr_matrix(line)
    return sp.csr_matrix(found)


def below(tree, node: int) -> set[int]:
    """Unknowns of a separator and of all below it."""
    own = set(tree.unknowns[node].tolist())
    return own.union(*(below(tree, child) for child in tree.children[node]))


@pytest.mark.parametrize("counts", [(400,), (30, 30), (10, 10, 10)])
def test_every_unknown_is_in_one_separator_and_halves_are_apart(counts: tuple[int, ...]) -> None:
    pattern = lattice(*counts)
    tree = dissect(pattern)
    assert sorted(np.concatenate(tree.unknowns).tolist()) == list(range(pattern.shape[0]))
    for node, children in enumerate(tree.children):
        assert all(child < node for child in children)
        parts = [sorted(below(tree, child)) for child in children]
        for i, one in enumerate(parts):
            for other in parts[i + 1 :]:
                assert pattern[one][:, other].nnz == 0


def test_the_separator_of_a_square_grid_is_about_a_line() -> None:
    """The smallest one has n points of n by n; a cut along the diagonal has up to twice as many."""
    n = 40
    tree = dissect(lattice(n, n))
    assert len(tree.unknowns[-1]) <= 1.5 * n
    assert min(len(below(tree, child)) for child in tree.children[-1]) > 0.35 * n * n


def test_two_components_need_no_separator() -> None:
    tree = dissect(sp.csr_matrix(sp.block_diag([lattice(20, 20), lattice(20, 20)])))
    assert sum(map(len, tree.unknowns)) == 800
    roots = set(range(len(tree.children))) - {child for children in tree.children for child in children}
    assert sorted(len(below(tree, root)) for root in roots) == [400, 400]


def test_unknowns_of_a_node_stay_together() -> None:
    """Three unknowns a node: their rows of the pattern are equal, and the graph has the nodes as vertices."""
    tree = dissect(sp.csr_matrix(sp.kron(lattice(15, 15), np.ones((3, 3)))))
    for unknowns in tree.unknowns:
        nodes, counts = np.unique(unknowns // 3, return_counts=True)
        assert (counts == 3).all(), nodes
