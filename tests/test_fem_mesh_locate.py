"""Points in cells: the inverse of the isoparametric map."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.elements import TET4, TET10, TRI3, TRI6, Element
from finger3d.fem.mesh.locate import cells_at, inverse_map, locate
from finger3d.fem.mesh.simplex import Mesh, quadratic
from tests.meshes import points_in


@pytest.mark.parametrize("element", [TRI3, TRI6, TET4, TET10], ids=lambda e: e.name)
def test_inverse_map_recovers_points_of_a_curved_cell(element: Element) -> None:
    nodes = element.nodes[:, 1:].copy()
    if element.is_quadratic:
        nodes[element.dim + 1 :] += np.random.default_rng(2).uniform(-0.05, 0.05, nodes[element.dim + 1 :].shape)
    bary = points_in(element)
    at = element.shape(bary) @ nodes
    found = inverse_map(element, np.broadcast_to(nodes, (len(at), *nodes.shape)), at)
    np.testing.assert_allclose(found, bary, atol=1e-12)


def test_a_shared_edge_lies_in_two_cells_and_an_outer_point_in_none() -> None:
    square = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([[0, 1, 2], [0, 2, 3]]), {})
    mesh = quadratic(square)
    assert [cell for cell, _ in cells_at(mesh, np.array([0.5, 0.5]))] == [0, 1]
    assert cells_at(mesh, np.array([1.5, 0.5])) == []
    cell, bary = locate(mesh, np.array([[0.75, 0.25], [0.25, 0.75], [1.5, 0.5]]))
    assert cell.tolist() == [0, 1, -1]
    np.testing.assert_allclose(bary[0], [0.25, 0.5, 0.25])
