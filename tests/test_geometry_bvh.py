"""The bounding volume hierarchy finds what a comparison with every triangle finds."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.bvh import Tree, cylinder_distance
from tests.bodies import ball

SURFACE = ball(3.0, rings=12, sectors=20)
CORNERS = SURFACE.points[SURFACE.faces]


@pytest.mark.parametrize("count", [1, 4, 5, 17, len(CORNERS)])
def test_every_triangle_is_in_one_leaf(count: int) -> None:
    tree = Tree.over(CORNERS[:count])
    items = tree.items[tree.items >= 0]
    assert sorted(items) == list(range(count))
    assert [len(boxes) for boxes in tree.boxes] == [4**level for level in range(len(tree.boxes))]


def test_a_box_holds_the_boxes_below_it() -> None:
    tree = Tree.over(CORNERS)
    for parents, children in zip(tree.boxes, tree.boxes[1:], strict=False):
        below = children.reshape(-1, 4, 6)
        assert (parents[:, None, :3] <= below[:, :, :3]).all()
        assert (parents[:, None, 3:] >= below[:, :, 3:]).all()
    assert tree.boxes[0][0] == pytest.approx([-3.0, -3.0, -3.0, 3.0, 3.0, 3.0], abs=0.2)


def test_pairs_are_those_whose_boxes_meet_a_vertical_line() -> None:
    tree, at = Tree.over(CORNERS), np.random.default_rng(1).uniform(-4.0, 4.0, (300, 2))

    def meets(query: np.ndarray, level: int, node: np.ndarray) -> np.ndarray:
        box = tree.boxes[level][node]
        return ((box[:, [0, 2]] <= at[query]) & (at[query] <= box[:, [3, 5]])).all(axis=1)

    found = {
        (q, t) for queries, triangles in tree.pairs(len(at), meets) for q, t in zip(queries, triangles, strict=True)
    }
    low, high = CORNERS.min(axis=1)[:, [0, 2]], CORNERS.max(axis=1)[:, [0, 2]]
    wanted = {(q, t) for q, p in enumerate(at) for t in np.flatnonzero(((low <= p) & (p <= high)).all(axis=1))}
    assert wanted
    assert wanted <= found  # a leaf has up to four triangles, so that some others are tried as well


def test_flat_cylinders_bound_the_distance_from_below() -> None:
    tree = Tree.over(CORNERS)
    areas = np.cross(CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0])
    points = np.random.default_rng(2).normal(scale=5.0, size=(50, 3))
    for level, cylinders in enumerate(tree.bounding_cylinders(CORNERS, areas)):
        nodes = tree.items.reshape(4**level, -1)
        for items, cylinder in zip(nodes, cylinders, strict=True):
            vertices = CORNERS[items[items >= 0]].reshape(-1, 3)
            bound = cylinder_distance(points, np.broadcast_to(cylinder, (50, 8)))
            if not len(vertices):
                assert np.isinf(bound).all()
                continue
            nearest = np.linalg.norm(points[:, None] - vertices, axis=2).min(axis=1)
            assert (bound <= nearest + 1e-9).all()
