"""Tessellation and snapping, on deterministic meshes: a swept mesh shaken as fTetWild would."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.fem.quality import cell_angles_deg, curved_jacobians, curved_volume
from finger3d.fem.simplex import boundary, unfold
from finger3d.geometry.cad import cut, sound
from finger3d.geometry.implicit import Freeform, ImplicitCylinder, ImplicitPlane, ImplicitSphere, surface_of
from finger3d.geometry.registry import designs
from finger3d.geometry.tessellate import CadFace, Tessellation, tessellate
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.seams import Seams
from finger3d.meshing.snap import MIN_DIHEDRAL_DEG, UnusableMeshError, check_closed, project, repair, snap, snap_nodes

FIG9 = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0)
HALF = designs()["half_cylinder"](5.0, 10.0)
EXACT = (0.0, 10.0, -10.0, 5.0, -5.0, 50.0, -50.0)


def body_of(design: Any, symmetry: tuple[str, ...] = (), tolerance: float = 0.01) -> Tessellation:
    return tessellate(cut(design.solid(), symmetry), tolerance, exact=EXACT)


def shaken(design: Any, symmetry: tuple[str, ...], by: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and linear tets of a swept mesh, every vertex moved at random by up to `by` mm along each axis."""
    size = 0.12 * design.height_mm
    options = SimpleNamespace(size_mm=size, base_size_mm=2 * size, mesher="swept", layers=2)
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
    with pytest.raises(UnusableMeshError, match="not closed"):
        check_closed(boundary(np.array([[0, 1, 2, 3]]), 3)[:3])


def faces_of(*surfaces: Any) -> tuple[CadFace, ...]:
    return tuple(CadFace("contact", s, np.full(3, -9.0), np.full(3, 9.0), 1.0) for s in surfaces)


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
    with pytest.raises(UnusableMeshError, match="no place"):
        project(np.array([[0.0, 0.4, 0.0], [1.0, 0.0, 1.0]]), np.ones((2, 2), dtype=bool), faces)


@pytest.mark.parametrize(
    ("tolerance", "volume_error"), [(0.1, 1e-3), (0.01, 1e-4), (1e-3, 1e-5)]
)  # measured on this body: 7e-4, 7.5e-5, 7.6e-6
def test_tessellation_is_closed_and_as_fine_as_asked(tolerance: float, volume_error: float) -> None:
    solid = FIG9.solid()
    body = tessellate(solid, tolerance, exact=EXACT)
    check_closed(body.triangles)
    assert 0.2 * volume_error < 1.0 - body.volume_mm3 / FIG9.volume_mm3 < volume_error
    # The triangulation kept on the shape must not be handed out again.
    assert len(tessellate(solid, 10.0 * tolerance).triangles) < len(body.triangles)
    assert len(body.corners) == 8
    assert {len(f) for f in body.corner_faces} == {3}


def test_every_triangle_lies_on_its_labelled_face() -> None:
    body = body_of(HALF, ("x",), 1e-3)
    assert sorted(f.label for f in body.faces) == ["base", "contact", "ends", "ends", "symmetry_x"]
    middle = body.points[body.triangles].mean(axis=1)
    for i, face in enumerate(body.faces):
        assert np.abs(face.surface.distance(middle[body.face == i])[0]).max() < 2e-3
    assert set(body.labels) == {"base", "contact", "ends", "symmetry_x"}
    assert body.labels.count("base") == 2


def test_free_form_surfaces_are_reached_by_projection() -> None:
    from build123d import Face, Vector

    # A patch of a cylinder through points, so that CAD knows it as a free form only.
    angles = np.linspace(-0.6, 0.6, 9)
    rows = [[(5 * np.sin(a), 5 * np.cos(a), z) for z in (-2.0, 0.0, 2.0, 4.0)] for a in angles]
    face = Face.make_surface_from_array_of_points([[Vector(*map(float, p)) for p in row] for row in rows], tol=1e-6)
    surface = surface_of(face)
    assert isinstance(surface, Freeform)
    points = np.array([[0.5, 5.3, 0.2], [-1.0, 4.6, 1.0]])
    distance, normal = surface.distance(points)
    exact, out = ImplicitCylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0).distance(points)
    np.testing.assert_allclose(np.abs(distance), np.abs(exact), atol=1e-4)
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", normal, out)), 1.0, atol=1e-4)
    moved = project(points, np.ones((2, 1), dtype=bool), faces_of(surface))
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), 5.0, atol=1e-4)
