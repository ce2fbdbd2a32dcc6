"""Tessellation, seams and snapping, on deterministic meshes: a swept mesh shaken as fTetWild would."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from finger3d.fem.mesh.quality import cell_angles_deg, curved_jacobians, curved_volume
from finger3d.fem.mesh.simplex import boundary, unfold
from finger3d.geometry.cad import sound
from finger3d.geometry.implicit import ImplicitCylinder, ImplicitPlane, ImplicitSphere
from finger3d.geometry.tessellate import Tessellation, tessellate
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.snap import (
    MIN_DIHEDRAL_DEG,
    Seams,
    UnusableMeshError,
    check_closed,
    project,
    repair,
    snap,
    snap_nodes,
)
from tests.cad_cases import body_of, faces_of
from tests.designs import FIG9, HALF


def test_points_go_where_their_surfaces_meet() -> None:
    plane = ImplicitPlane(np.array([0.0, 0.0, 0.5]), np.array([0.0, 0.0, 1.0]))
    tilted = ImplicitPlane(np.array([0.2, 0.0, 0.0]), np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))
    faces = faces_of(
        plane, tilted, ImplicitSphere(np.zeros(3), 1.0), ImplicitCylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.8)
    )
    points = np.random.default_rng(0).uniform(0.3, 0.7, (8, 3)) * [1.0, -1.0, 1.0]
    sets = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [1, 0, 1, 0], [1, 1, 1, 0], [0, 1, 0, 1], [0, 0, 0, 1]], dtype=bool)
    sets = np.vstack([sets, np.zeros((2, 4), dtype=bool)])
    moved, failed = project(points, sets, faces)
    assert not failed.any()
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
    _, failed = project(np.array([[0.0, 0.4, 0.0], [1.0, 0.0, 1.0]]), np.ones((2, 2), dtype=bool), faces)
    assert failed.all()


def shaken(design: Any, symmetry: tuple[str, ...], by: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and linear tets of a swept mesh, every vertex moved at random by up to `by` mm along each axis."""
    size = 0.12 * design.height_mm
    options = MeshOptions(size_mm=size, base_size_mm=2 * size, mesher="swept", layers=2)
    mesh = mesh_solid(design, options, (-size, size, -size, size), symmetry)[0]
    used, tets = np.unique(mesh.cells[:, :4], return_inverse=True)
    points = mesh.points[used] + np.random.default_rng(1).uniform(-by, by, (len(used), 3))
    return points, tets.reshape(-1, 4)


@pytest.mark.parametrize("symmetry", [(), ("x",), ("x", "z")])
@pytest.mark.parametrize(("design", "by"), [(FIG9, 0.1), (HALF, 0.01)], ids=["fig9", "half"])
def test_a_shaken_mesh_is_put_back_on_its_surfaces(design: Any, by: float, symmetry: tuple[str, ...]) -> None:
    mesh = snap(*shaken(design, symmetry, by), body_of(design, symmetry, 1e-4 * design.height_mm))
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    assert (at["base"][:, 1] == 0.0).all()
    assert (np.isin(at["ends"][:, 2], [-0.5 * design.width_mm, 0.5 * design.width_mm])).all()
    if "walls" in at:
        assert (np.abs(at["walls"][:, 0]) == design.half_length_mm).all()
    for axis, label in ((0, "symmetry_x"), (2, "symmetry_z")):
        assert (label in at) == (label[-1] in symmetry)
        assert label not in at or (at[label][:, axis] == 0.0).all()
    radius, centre = design.radius_mm, design.height_mm - design.radius_mm
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - centre) - radius
    assert np.abs(off).max() < 1e-12 * radius
    assert (curved_jacobians(mesh) > 0.0).all()
    assert 2 ** len(symmetry) * curved_volume(mesh) == pytest.approx(design.volume_mm3, rel=1e-4)
    whole = unfold(mesh, tuple({"x": 0, "z": 2}[a] for a in symmetry))[0]
    check_closed(boundary(whole.cells[:, :4], 3))
    assert set(whole.facets) == set(mesh.facets) - {"symmetry_x", "symmetry_z"}


def test_a_flat_cell_on_the_surface_is_collapsed() -> None:
    points, tets = shaken(FIG9, ("x", "z"), 0.0)
    faces = boundary(tets, 3)
    onto = faces[np.argmin(np.linalg.norm(points[faces].mean(axis=1) - [20.0, 47.9, 5.0], axis=1))]
    # A thin tet glued on a facet: snapped to the cylinder, all four corners lie on one surface.
    a, b, c = points[onto]
    apex = 0.45 * a + 0.45 * b + 0.1 * c + 0.05 * np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
    worse = np.vstack([tets, [*onto[[0, 2, 1]], len(points)]])
    first = np.vstack([points, apex])
    volume = np.linalg.det(first[worse[-1, 1:]] - first[worse[-1, 0]])
    if volume < 0:
        worse[-1, :2] = worse[-1, 1::-1]
    mesh = snap(first, worse, body_of(FIG9, ("x", "z"), 1e-3))
    assert cell_angles_deg(mesh.points, mesh.cells).min() >= MIN_DIHEDRAL_DEG
    assert len(mesh.cells) <= len(tets)
    assert 4.0 * curved_volume(mesh) == pytest.approx(FIG9.volume_mm3, rel=1e-4)
    check_closed(boundary(mesh.cells[:, :4], 3))


def test_a_mesh_of_flat_cells_is_given_up() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1e-6]])
    with pytest.raises(UnusableMeshError):
        repair(points, np.array([[0, 1, 2, 3]]), np.eye(4, dtype=bool))


def test_an_open_boundary_is_refused() -> None:
    check_closed(boundary(np.array([[0, 1, 2, 3]]), 3))
    with pytest.raises(UnusableMeshError, match="closed"):
        check_closed(boundary(np.array([[0, 1, 2, 3]]), 3)[:3])
