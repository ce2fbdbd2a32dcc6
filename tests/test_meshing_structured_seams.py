"""Nodes where several faces meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from finger3d.geometry.cad import sound
from finger3d.geometry.implicit import ImplicitCylinder, ImplicitPlane, ImplicitSphere
from finger3d.geometry.tessellate import Tessellation, tessellate
from finger3d.meshing.structured.seams import Seams
from finger3d.meshing.structured.snap import UnusableMeshError, project, snap_nodes
from tests.cad_cases import faces_of


def test_points_go_where_their_surfaces_meet() -> None:
    plane = ImplicitPlane(np.array([0.0, 0.0, 0.5]), np.array([0.0, 0.0, 1.0]))
    tilted = ImplicitPlane(np.array([0.2, 0.0, 0.0]), np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))
    faces = faces_of(
        plane, tilted, ImplicitSphere(np.zeros(3), 1.0), ImplicitCylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.8)
    )
    points = np.random.default_rng(0).uniform(0.3, 0.7, (8, 3)) * [1.0, -1.0, 1.0]
    sets = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [1, 0, 1, 0], [1, 1, 1, 0], [0, 1, 0, 1], [0, 0, 0, 1]], dtype=bool)
    sets = np.vstack([sets, np.zeros((2, 4), dtype=bool)])
    moved = project(points, sets, faces)
    for i, f in enumerate(faces):
        on = sets[:, i]
        assert np.abs(f.surface.distance(moved[on])[0]).max() < 1e-13
    assert (moved[sets[:, 0], 2] == 0.5).all()
    np.testing.assert_array_equal(moved[-2:], points[-2:])
    np.testing.assert_array_equal(moved[1, :2], points[1, :2])


@pytest.fixture(scope="module")
def rounded() -> tuple[Tessellation, dict[str, int]]:
    """A box 12 x 5 x 8 on its base, its upper edges along z rounded with 1.5 mm, and the numbers of its faces."""
    from build123d import Axis, Box, Pos, fillet

    box = Pos(0.0, 2.5, 0.0) * Box(12.0, 5.0, 8.0)
    upper = box.edges().filter_by(Axis.Z).sort_by(Axis.Y)[-2:]
    body = tessellate(sound(fillet(upper, 1.5), "rounded"), 1e-3, exact=(0.0, 6.0, -6.0, 4.0, -4.0, 5.0))
    middle = {i: 0.5 * (f.low + f.high) for i, f in enumerate(body.faces)}
    of = {"base": [0, 0, 0], "top": [0, 5, 0], "wall": [6, 1.75, 0], "fillet": [5.25, 4.25, 0], "end": [0, 2.5, 4]}
    return body, {name: min(middle, key=lambda i: np.linalg.norm(middle[i] - at)) for name, at in of.items()}


def placed_on(rounded: tuple[Tessellation, dict[str, int]], point: list[float], names: str, reach: float = 9.0) -> Any:
    body, number = rounded
    sets = np.zeros((1, len(body.faces)), dtype=bool)
    sets[0, [number[n] for n in names.split()]] = True
    moved, rows = snap_nodes(np.array([point]), sets, Seams(body), np.array([reach]))
    return moved[0], {n for n, i in number.items() if rows[0, i]}


def test_where_faces_join_smoothly_a_node_goes_onto_the_nearest(rounded: tuple[Tessellation, dict[str, int]]) -> None:
    # 0.4 mm beside the seam at x = 4.5 the fillet is 0.4^2/3 = 0.053 mm below the flat top; both ways it stays there.
    moved, on = placed_on(rounded, [4.1, 4.98, 1.0], "top fillet")
    assert on == {"top"}
    np.testing.assert_allclose(moved, [4.1, 5.0, 1.0], atol=1e-12)
    moved, on = placed_on(rounded, [4.9, 4.93, 1.0], "top fillet")
    assert on == {"fillet"}
    assert np.hypot(moved[0] - 4.5, moved[1] - 3.5) == pytest.approx(1.5, abs=1e-12)
    assert np.linalg.norm(moved - [4.9, 4.93, 1.0]) < 0.03
    moved, on = placed_on(rounded, [4.9, 4.93, 3.99], "top fillet end")
    assert on == {"fillet", "end"}
    assert moved[2] == 4.0
    assert np.hypot(moved[0] - 4.5, moved[1] - 3.5) == pytest.approx(1.5, abs=1e-12)


def test_a_node_that_cannot_reach_where_its_faces_meet_stays_beside(
    rounded: tuple[Tessellation, dict[str, int]],
) -> None:
    near, on = placed_on(rounded, [2.0, 4.9, 3.7], "top end")
    assert on == {"top", "end"}
    np.testing.assert_allclose(near, [2.0, 5.0, 4.0], atol=1e-12)
    beside, on = placed_on(rounded, [2.0, 4.9, 3.7], "top end", reach=0.2)
    assert on == {"top"}
    np.testing.assert_allclose(beside, [2.0, 5.0, 3.7], atol=1e-12)
    # Nothing takes a node off the base.
    moved, on = placed_on(rounded, [2.0, 0.02, 1.0], "base wall", reach=0.2)
    assert on == {"base"}
    np.testing.assert_array_equal(moved, [2.0, 0.0, 1.0])


def test_a_crease_between_faces_is_no_seam(rounded: tuple[Tessellation, dict[str, int]]) -> None:
    body, number = rounded
    sets = np.zeros((3, len(body.faces)), dtype=bool)
    for row, names in enumerate((("top", "end"), ("wall", "base"), ("fillet", "end"))):
        sets[row, [number[n] for n in names]] = True
    np.testing.assert_array_equal(Seams(body).one_per_smooth_group(np.zeros((3, 3)), sets), sets)


def test_points_without_a_place_are_reported() -> None:
    axis = np.array([0.0, 1.0, 0.0])
    faces = faces_of(ImplicitPlane(np.zeros(3), axis), ImplicitPlane(axis, axis))
    with pytest.raises(UnusableMeshError, match="place"):
        project(np.array([[0.0, 0.4, 0.0], [1.0, 0.0, 1.0]]), np.ones((2, 2), dtype=bool), faces)
