"""Edges and outlines of sections."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.plotting.outlines import edges_of, outline_of
from tests.meshes import grid


def square(order: int, cells: int = 3) -> Mesh:
    mesh = grid((cells, cells))
    return mesh if order == 1 else quadratic(mesh)


@pytest.mark.parametrize("order", [1, 2])
def test_every_edge_is_drawn_once(order: int) -> None:
    mesh = square(order)
    path = edges_of(mesh, mesh.points)
    # Euler: vertices - edges + cells = 1
    edges = 16 + len(mesh.cells) - 1
    assert (path.codes == path.MOVETO).sum() == edges
    assert len(path.vertices) == edges * (order + 1)


@pytest.mark.parametrize("order", [1, 2])
def test_the_outline_encloses_the_area_of_the_moved_section(order: int) -> None:
    mesh = square(order)
    path = outline_of(mesh, mesh.points * [2.0, 3.0])
    x, y = path.vertices.T
    assert abs(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) == pytest.approx(6.0)
    assert path.contains_point((1.0, 1.5))
    assert len(path.vertices) == order * 12 + 1


def test_edges_that_would_merge_into_an_area_are_left_out() -> None:
    assert len(edges_of(square(1, 100), square(1, 100).points).vertices) == 0
    assert len(edges_of(square(1, 20), square(1, 20).points).vertices) > 0
