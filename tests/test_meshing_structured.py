"""Structured meshes of sections and swept solids, and nodes that are snapped onto CAD faces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from finger3d.errors import Finger3dError
from finger3d.fem.mesh import (
    Mesh,
    boundary,
    cell_angles_deg,
    curved_jacobians,
    curved_volume,
    locate,
    signed_volumes,
    unfold,
)
from finger3d.geometry.cad import sound
from finger3d.geometry.design import designs
from finger3d.geometry.tessellate import ImplicitCylinder, ImplicitPlane, ImplicitSphere, Tessellation, tessellate
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.swept import mesh_section
from finger3d.meshing.unstructured.snap import (
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
from tests.commands import loaded
from tests.designs import FIG9, HALF, make, zone_of
from tests.meshes import interface, part_volume

BLOCK = designs()["block"](20.0, 20.0, 20.0)
LENS = designs()["clipped_cylinder"](100.0, 50.0, 0.0, 20.0)
LOW = designs()["clipped_cylinder"](100.0, 80.0, 5.0, 20.0)
ARCH = designs()["clipped_cylinder"](10.0, 10.0, 10.0, 8.0)
ALL = {"fig9": FIG9, "half": HALF, "block": BLOCK, "lens": LENS, "low": LOW, "arch": ARCH}


def sizes(design: Any, share: float = 0.08, grow: float = 4.0) -> Any:
    size = share * design.height_mm
    return MeshOptions(size_mm=size, base_size_mm=grow * size, mesher="swept", layers=2)


def check_whole(mesh: Mesh) -> None:
    """Cells positive, facets the boundary once and outward."""
    d = mesh.dim
    assert mesh.element.is_quadratic
    assert (signed_volumes(mesh) > 0.0).all()
    assert (curved_jacobians(mesh) > 0.0).all()
    assert np.array_equal(np.unique(mesh.cells), np.arange(len(mesh.points)))
    outer = {tuple(np.roll(f, -np.argmin(f))) for f in boundary(mesh.cells[:, : d + 1], d)}
    listed = [tuple(np.roll(f[:d], -np.argmin(f[:d]))) for facets in mesh.facets.values() for f in facets]
    assert len(listed) == len(set(listed))
    assert set(listed) == outer


def check_planes(mesh: Mesh, design: Any) -> None:
    """Labelled planes are planes to the last bit, and contact nodes, mid-edge nodes too, lie on the exact surface."""
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    assert (at["base"][:, 1] == 0.0).all()
    if len(at.get("walls", [])):
        np.testing.assert_array_equal(np.abs(at["walls"][:, 0]), design.half_length_mm)
    if "ends" in at:
        np.testing.assert_array_equal(np.abs(at["ends"][:, 2]), 0.5 * design.width_mm)
    for axis, label in ((0, "symmetry_x"), (2, "symmetry_z")):
        assert (at[label][:, axis] == 0.0).all() if label in at else True
    contact = at["contact"]
    z = contact[:, 2] if mesh.dim == 3 else np.zeros(len(contact))
    # Heights are ill-conditioned where the curve runs into a vertical.
    inner = np.abs(contact[:, 0]) < 0.99 * design.half_length_mm
    np.testing.assert_allclose(contact[inner, 1], design.top(contact[inner, 0], z[inner]), rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", ALL)
def test_sections_are_sound(name: str) -> None:
    design, symmetry = ALL[name], ("x",)
    mesh, report = mesh_section(design, sizes(design), zone_of(design), symmetry)
    assert mesh.dim == 2
    check_whole(mesh)
    check_planes(mesh, design)
    assert "symmetry_x" in mesh.facets
    assert report.volume_mm3 == pytest.approx(report.cad_volume_mm3, rel=1e-4)
    assert report.cad_volume_mm3 == pytest.approx(design.volume_mm3, rel=1e-12)
    assert (report.points, report.cells) == (len(mesh.points), len(mesh.cells))
    # A lens ends in a corner of 30 degrees, 53 for the low one; others have none below 90.
    assert report.min_dihedral_deg > (5.0 if name in ("lens", "low") else 11.0)


@pytest.mark.parametrize("symmetry", [(), ("x", "z")])
@pytest.mark.parametrize("name", ["fig9", "half", "block"])
def test_swept_solids_are_sound(name: str, symmetry: tuple[str, ...]) -> None:
    design = ALL[name]
    mesh, report = mesh_solid(design, sizes(design), zone_of(design), symmetry)
    check_whole(mesh)
    check_planes(mesh, design)
    assert {f"symmetry_{axis}" for axis in symmetry} == {label for label in mesh.facets if "symmetry" in label}
    assert report.volume_mm3 == pytest.approx(design.volume_mm3, rel=1e-4)
    assert report.min_dihedral_deg > 11.0
    assert not report.from_cache
    assert report.cache_path is None


def test_meshes_are_deterministic() -> None:
    first, second = (mesh_solid(FIG9, sizes(FIG9), zone_of(FIG9), ())[1].hash for _ in range(2))
    assert first == second != mesh_solid(FIG9, sizes(FIG9, 0.07), zone_of(FIG9), ())[1].hash


@pytest.mark.parametrize("dim", [2, 3])
def test_the_whole_is_its_own_mirror_image_to_the_last_bit(dim: int) -> None:
    # A zone off the middle must not spoil it.
    where = (5.0, 20.0, -10.0, 10.0)
    mesh = mesh_section(FIG9, sizes(FIG9), where)[0] if dim == 2 else mesh_solid(FIG9, sizes(FIG9), where)[0]
    number = {tuple(p): i for i, p in enumerate(mesh.points)}
    cells = {tuple(sorted(c)) for c in mesh.cells.tolist()}
    for axis in (0, 2)[: dim - 1]:
        flip = np.ones(dim)
        flip[axis] = -1.0
        image = np.array([number[tuple(p)] for p in mesh.points * flip + 0.0])
        assert {tuple(sorted(c)) for c in image[mesh.cells].tolist()} == cells


def test_a_quarter_unfolds_to_the_whole() -> None:
    quarter, report = mesh_solid(HALF, sizes(HALF), zone_of(HALF), ("x", "z"))
    whole = unfold(quarter, (0, 2))[0]
    check_whole(whole)
    assert mesh_solid(HALF, sizes(HALF), zone_of(HALF), ())[1].points == len(whole.points)
    assert report.volume_mm3 == pytest.approx(HALF.volume_mm3, rel=1e-4)


def test_the_curved_area_converges_with_the_fourth_power_of_the_size() -> None:
    errors = []
    for share in (0.16, 0.08, 0.04):
        report = mesh_section(HALF, sizes(HALF, share, 1.0), zone_of(HALF))[1]
        errors.append(abs(report.volume_mm3 / report.cad_volume_mm3 - 1.0))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 3.5).all()


@settings(max_examples=25, deadline=None)
@given(
    radius=st.floats(1.0, 200.0),
    length=st.floats(0.4, 1.0),
    edge=st.one_of(st.just(0.0), st.floats(0.1, 1.0)),
    share=st.floats(0.02, 0.3),
    grow=st.floats(1.0, 10.0),
    where=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
)
def test_any_finger_gives_a_sound_section(
    radius: float, length: float, edge: float, share: float, grow: float, where: tuple[float, float]
) -> None:
    design = designs()["clipped_cylinder"](radius, length * radius, edge * radius, 10.0)
    size = share * min(design.height_mm, design.half_length_mm)
    options = MeshOptions(size_mm=size, base_size_mm=grow * size)
    low, high = sorted(w * design.half_length_mm for w in where)
    mesh, report = mesh_section(design, options, (low, high, 0.0, 0.0))
    check_whole(mesh)
    assert report.volume_mm3 == pytest.approx(design.volume_mm3, rel=2e-3)


def test_a_design_without_section_cannot_be_swept() -> None:
    ball = designs()["hemisphere"](5.0)
    options = MeshOptions(size_mm=1.0, base_size_mm=2.0, mesher="swept", layers=2)
    with pytest.raises(Finger3dError, match="hemisphere.*'ftetwild'"):
        mesh_solid(ball, options, (-1, 1, -1, 1))
    with pytest.raises(Finger3dError, match="hemisphere.*'solid'"):
        mesh_section(ball, options, (-1, 1, -1, 1))


def test_structured_meshes_load_no_cad() -> None:
    program = (
        "from types import SimpleNamespace as N; from finger3d.geometry.design import *;"
        "from finger3d.meshing.generate import *; from finger3d.meshing.swept import *;"
        "d = designs()['half_cylinder'](5.0, 10.0);"
        "o = N(size_mm=0.5, base_size_mm=2.0, mesher='swept', layers=2, grading=None);"
        "z = (-2, 2, -5, 5); mesh_section(d, o, z); mesh_solid(d, o, z)"
    )
    assert not loaded(program, "build123d", "OCP", "pytetwild", "trimesh", "scipy", "vtk")


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_edges_have_the_asked_length_in_the_zone_and_grow_away_from_it(size: float) -> None:
    options = MeshOptions(size_mm=size, base_size_mm=8.0, mesher="swept")
    mesh = mesh_section(FIG9, options, (-40.0, 40.0, 0.0, 0.0))[0]
    edges = mesh.points[mesh.facets["contact"][:, :2]]
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    inside = np.abs(edges[..., 0]).max(axis=1) < 40.0
    np.testing.assert_allclose(length[inside], size, rtol=0.05)
    assert length[inside].max() / length[inside].min() < 1.001
    base = mesh.points[mesh.facets["base"][:, :2]]
    assert np.linalg.norm(base[:, 1] - base[:, 0], axis=1).max() == pytest.approx(8.0, rel=0.2)
    assert np.diff(np.sort(mesh.points[mesh.points[:, 0] == 0.0][:, 1]))[-1] == pytest.approx(size / 2, rel=0.2)


def test_every_point_of_a_graded_solid_is_in_one_of_its_cells() -> None:
    """Some of these points are in none of the 40 cells with the nearest centroids."""
    body = designs()["block"](half_length_mm=10.0, height_mm=8.0, width_mm=12.0)
    options = MeshOptions(size_mm=0.5, base_size_mm=5.0, mesher="swept")
    mesh, _ = mesh_solid(body, options, (-3.0, 3.0, -3.0, 3.0), ())
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    points = low + np.random.default_rng(1).random((4000, 3)) * (high - low)
    cell, bary = locate(mesh, points)
    assert (cell >= 0).all()
    np.testing.assert_allclose(np.einsum("pk,pkd->pd", mesh.element.shape(bary), mesh.points[mesh.cells[cell]]), points)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"size_mm": 60.0, "base_size_mm": 60.0}, "mesh.size_mm = 60 .*width, 20 mm"),
        ({"size_mm": 3.0, "base_size_mm": 2.0}, "mesh.base_size_mm = 2 .*size_mm"),
    ],
)
def test_sizes_that_cannot_work_are_refused_in_one_line(changes: dict[str, float], text: str) -> None:
    options = MeshOptions(**{"size_mm": 2.0, "base_size_mm": 8.0, "mesher": "swept", "layers": 2, **changes})
    with pytest.raises(Finger3dError, match=text) as refused:
        mesh_solid(FIG9, options, zone_of(FIG9))
    assert "\n" not in str(refused.value)


def test_a_wall_too_thin_for_the_size_is_refused() -> None:
    design = designs()["clipped_cylinder"](100.0, 100.0, 0.02, 20.0)
    with pytest.raises(Finger3dError, match="edge_height_mm = 0"):
        mesh_section(design, MeshOptions(size_mm=20.0, base_size_mm=50.0), (-20.0, 20.0, 0.0, 0.0))


@pytest.mark.parametrize("size", [5.6, 2.0])
def test_no_layer_along_z_is_thicker_than_the_edges_at_the_contact(size: float) -> None:
    options = MeshOptions(size_mm=size, base_size_mm=4.0 * size, mesher="swept", layers=2)
    mesh = mesh_solid(FIG9, options, zone_of(FIG9))[0]
    levels = np.unique(mesh.points[np.unique(mesh.facets["contact"][:, :3]), 2])
    assert np.diff(levels).max() <= size


def test_the_least_number_of_layers_is_kept() -> None:
    for layers in (1, 2, 4):
        options = MeshOptions(size_mm=12.0, base_size_mm=12.0, mesher="swept", layers=layers)
        mesh = mesh_solid(FIG9, options, zone_of(FIG9))[0]
        levels = np.unique(mesh.points[np.unique(mesh.facets["contact"][:, :3]), 2])
        assert len(levels) == 2 * layers + 1


FINGERTIP = designs()["fingertip"]
BODIES = {
    "skin and core": FINGERTIP(100.0, 50.0, 36.6, 20.0, 3.0, 30.0, 20.0),
    "core nearly as long": FINGERTIP(100.0, 50.0, 36.6, 20.0, 0.0, 49.0, 20.0),
    "half cylinder": FINGERTIP(8.0, 8.0, 0.0, 16.0, 1.0, 3.0, 4.0),
    "lens": FINGERTIP(100.0, 50.0, 0.0, 16.0, 1.0, 20.0, 5.0),
    "thin skin": FINGERTIP(100.0, 50.0, 36.6, 20.0, 0.2),
    "block": make("block"),
}


def meshed(design: Any, dim: int, symmetry: tuple[str, ...] = ()) -> tuple[Mesh, Any]:
    size = 0.06 * design.height_mm
    options = MeshOptions(size_mm=size, base_size_mm=3.0 * size, mesher="swept", layers=1)
    made = mesh_section if dim == 2 else mesh_solid
    return made(design, options, zone_of(design), symmetry)


def check_parts(mesh: Mesh, design: Any, multiple: float = 1.0) -> None:
    """Every part has its volume (in 2D area times width), and no cell is of no part."""
    assert mesh.part is not None
    assert mesh.part_labels == design.part_labels
    thickness = design.width_mm if mesh.dim == 2 else 1.0
    for number, (label, area) in enumerate(design.section().areas_mm2.items()):
        # chords of quadratic arcs: 1e-5 at 12 degrees an edge
        volume = multiple * thickness * part_volume(mesh, number)
        assert volume == pytest.approx(area * design.width_mm, rel=2e-5), label


@pytest.mark.parametrize("name", BODIES)
def test_sections_of_several_parts_are_sound(name: str) -> None:
    design = BODIES[name]
    mesh, report = meshed(design, 2)
    check_whole(mesh)
    check_planes(mesh, design)
    check_parts(mesh, design)
    assert report.min_dihedral_deg > 10.0  # the lens ends in a corner of 30 degrees, of which the skin cuts a part


@pytest.mark.parametrize("name", ["skin and core", "half cylinder", "block"])
def test_swept_solids_of_several_parts_are_sound(name: str) -> None:
    design = BODIES[name]
    mesh, _ = meshed(design, 3, ("z",))
    check_whole(mesh)
    check_planes(mesh, design)
    check_parts(mesh, design, 2.0)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ["skin and core", "half cylinder"])
def test_interfaces_lie_on_their_surfaces(name: str, dim: int) -> None:
    design = BODIES[name]
    mesh, _ = meshed(design, dim)
    inner = design.section().inner
    skin = mesh.points[interface(mesh, 0, 1)]
    radius = np.hypot(skin[:, 0], skin[:, 1] - inner.contact.centre_y_mm)
    np.testing.assert_allclose(radius, design.radius_mm - design.skin_mm, rtol=1e-14)
    core = mesh.points[interface(mesh, 0, 2)]
    top, side = core[:, 1] == design.core_height_mm, np.abs(core[:, 0]) == design.core_half_length_mm
    assert (top | side).all()
    assert (top & side).any()
    assert not len(interface(mesh, 1, 2))


def test_a_skin_has_two_cells_through_its_thickness() -> None:
    design = BODIES["thin skin"]
    mesh, _ = meshed(design, 2)
    assert mesh.part is not None
    on_axis = mesh.points[np.unique(mesh.cells[mesh.part == 1, :3])]
    assert (on_axis[:, 0] == 0.0).sum() == 3


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


def test_a_node_beside_short_edges_stays_on_the_face_and_the_base(
    rounded: tuple[Tessellation, dict[str, int]],
) -> None:
    moved, on = placed_on(rounded, [6.03, 0.001, 1.0], "wall base", reach=0.01)
    assert on == {"wall", "base"}
    np.testing.assert_allclose(moved, [6.0, 0.0, 1.0], atol=1e-12)


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


@pytest.mark.parametrize("symmetry", [(), ("x", "z")])
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
