"""pytetwild and netgen: guarded, graded, on the CAD faces; parts and their interfaces."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError, MissingError
from finger3d.fem.mesh import TRI3, Mesh, boundary, curved_jacobians, curved_volume, signed_volumes, unfold
from finger3d.geometry.cad import OUTSIDE, glue
from finger3d.geometry.design import designs
from finger3d.geometry.imported import imported
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import tessellate_parts
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.sizing import sizing
from finger3d.meshing.unstructured import netgen, tetwild
from finger3d.meshing.unstructured.snap import UnusableMeshError, check_closed, part_facets, snap
from finger3d.meshing.unstructured.solids import (
    box,
    check_volume,
    finer_in_layers,
    glued_solids,
    tessellated,
)
from finger3d.progress import QUIET
from tests.bodies import CUBE, SIDES, write_stl
from tests.bodies import box as box_of
from tests.designs import FIG9, OPTIONS, ZONE, make
from tests.logs import Log
from tests.meshes import edge_lengths, grid, interface, part_volume
from tests.test_geometry_files import file_of

BALL = designs()["hemisphere"](5.0)
BOTH = ("x", "z")


def check_quarter_of_fig9(mesh: Mesh, report: Any) -> None:
    """The quarter lies on the CAD faces, fills them, and its cells are positive."""
    assert set(mesh.facets) == {"contact", "base", "ends", "walls", "symmetry_x", "symmetry_z"}
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    planes = {"base": (1, 0.0), "ends": (2, 10.0), "walls": (0, 50.0), "symmetry_x": (0, 0.0), "symmetry_z": (2, 0.0)}
    for label, (axis, value) in planes.items():
        assert (at[label][:, axis] == value).all()
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - FIG9.height_mm + 100.0) - 100.0
    assert np.abs(off).max() < 1e-10
    assert (signed_volumes(mesh) > 0.0).all()
    assert (curved_jacobians(mesh) > 0.0).all()
    assert report.volume_mm3 == pytest.approx(FIG9.volume_mm3, rel=1e-4)
    assert report.cad_volume_mm3 == FIG9.volume_mm3


def test_a_real_mesh_lies_on_the_cad_and_fills_it(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh, report, _ = real
    check_quarter_of_fig9(mesh, report)
    assert 3.0 <= report.min_dihedral_deg < 60.0
    assert (report.points, report.cells) == (len(mesh.points), len(mesh.cells))


def test_a_real_quarter_unfolds_to_a_closed_body(real: tuple[Mesh, Any, list[str]]) -> None:
    whole = unfold(real[0], (0, 2))[0]
    faces = boundary(whole.cells[:, :4], 3)
    check_closed(faces)
    assert sum(len(f) for f in whole.facets.values()) == len(faces)
    assert curved_volume(whole) == pytest.approx(FIG9.volume_mm3, rel=1e-4)


def test_a_real_mesh_is_finer_in_the_zone_than_at_the_base(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh = real[0]
    contact, length = edge_lengths(mesh, "contact")
    top = length[contact[:, :, 0].max(axis=1) < 40.0].mean()
    assert 0.7 * OPTIONS.size_mm < top < 1.3 * OPTIONS.size_mm
    assert edge_lengths(mesh, "base")[1].mean() > 1.2 * top


def test_a_hemisphere_is_meshed_off_the_middle() -> None:
    options = MeshOptions(size_mm=1.2, base_size_mm=2.0, mesher="ftetwild")
    mesh, report = mesh_solid(BALL, options, (0.0, 2.0, -1.0, 1.0), ("z",))
    assert set(mesh.facets) == {"contact", "base", "symmetry_z"}
    contact = mesh.points[np.unique(mesh.facets["contact"])]
    np.testing.assert_allclose(np.linalg.norm(contact, axis=1), 5.0, atol=1e-12)
    assert report.volume_mm3 == pytest.approx(BALL.volume_mm3, rel=1e-3)


def at(index: int, value: float) -> np.ndarray:
    points = CUBE.copy()
    points.flat[index] = value
    return points


@pytest.mark.parametrize(
    ("points", "triangles", "text"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), dtype=int), "0 triangles"),
        (at(0, math.nan), SIDES, "NaN"),
        (CUBE * 1e-9, SIDES, "diagonal"),
        (CUBE * [1.0, 1.0, 0.0], SIDES, "flat"),
        (CUBE * [1.0, 1.0, 5e-4], SIDES, "thin"),
        (CUBE + 1e9, SIDES, "origin"),
        (CUBE, SIDES[1:], "closed"),
        (CUBE, SIDES[:, ::-1], "inside out"),
    ],
    ids=["empty", "nan", "tiny", "flat", "thin", "far", "hole", "inverted"],
)
def test_surfaces_that_crash_or_hang_pytetwild_are_refused(points: Any, triangles: Any, text: str) -> None:
    with pytest.raises(Finger3dError, match=text) as refused:
        tetwild.check_surface(Triangles(points, triangles))
    assert "\n" not in str(refused.value)


def test_three_attempts_and_then_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path))
    calls = []

    def crash(*_: Any) -> None:
        calls.append(1)
        raise UnusableMeshError("pytetwild crashed (return code -11): no message")

    monkeypatch.setattr(tetwild, "run_child", crash)
    said = Log()
    with pytest.raises(Finger3dError, match="3 .* -11.*mesher = 'swept'") as failed:
        mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said)
    assert len(calls) == 3
    assert sum("again" in text for text in said.lines) >= 2
    assert "\n" not in str(failed.value)
    assert not list(tmp_path.rglob("*.npz"))


NETGEN = MeshOptions(4.0, 10.0, "netgen")


def field_of(design: Any, options: Any, zone: tuple[float, float, float, float], symmetry: tuple[str, ...]) -> Any:
    return sizing(design, options, zone, *box(design, symmetry))


def test_a_quarter_lies_on_the_cad_and_is_graded() -> None:
    mesh, report = mesh_solid(FIG9, NETGEN, ZONE, BOTH)
    check_quarter_of_fig9(mesh, report)
    assert report.min_dihedral_deg > 10.0
    contact, length = edge_lengths(mesh, "contact")
    top = length[contact[:, :, 0].max(axis=1) < 40.0].mean()
    assert 0.8 * NETGEN.size_mm < top < 1.2 * NETGEN.size_mm
    assert edge_lengths(mesh, "base")[1].mean() > 1.5 * top


def test_the_same_mesh_comes_every_time() -> None:
    field = field_of(FIG9, NETGEN, ZONE, BOTH)
    first, second = (netgen.run_child(glued_solids(FIG9, BOTH), field, 60.0) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_parts_share_their_interfaces() -> None:
    design = make("fingertip")
    mesh, _ = mesh_solid(design, MeshOptions(1.6, 4.0, "netgen"), (-2.0, 2.0, -2.0, 2.0), BOTH)
    assert mesh.part is not None
    labelled = np.vstack([f[:, :3] for f in mesh.facets.values()])
    assert len(labelled) == len(boundary(mesh.cells[:, :4], 3))
    for number, area in enumerate(design.section().areas_mm2.values()):
        assert 4.0 * part_volume(mesh, number) == pytest.approx(area * design.width_mm, rel=1e-4)
    skin = mesh.points[interface(mesh, 0, 1)]
    np.testing.assert_allclose(np.hypot(skin[:, 0], skin[:, 1] - 2.0), 9.0, rtol=1e-10)


def test_a_hemisphere_of_few_cells_is_curved() -> None:
    ball = designs()["hemisphere"](5.0)
    mesh, report = mesh_solid(ball, MeshOptions(1.5, 3.0, "netgen"), (-1.0, 1.0, -1.0, 1.0))
    assert set(mesh.facets) == {"contact", "base"}
    assert report.volume_mm3 == pytest.approx(ball.volume_mm3, rel=2e-3)


def test_stl_is_left_to_ftetwild(tmp_path: Path) -> None:
    body = imported(write_stl(tmp_path / "body.stl", box_of(10.0, 8.0, 6.0)))
    with pytest.raises(Finger3dError, match=r"'netgen' .*STL.*'ftetwild'"):
        mesh_solid(body, MeshOptions(2.0, 3.0, "netgen"), (-1.0, 1.0, -1.0, 1.0))


def test_without_the_package_a_line_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finger3d._extras.available", lambda module: module != "netgen")
    with pytest.raises(MissingError, match=r'-m pip install .*\[netgen\]".*mesh.mesher = "swept"'):
        netgen.new_mesh(FIG9, NETGEN, ZONE, BOTH, QUIET)


def test_a_child_that_takes_too_long_is_told() -> None:
    with pytest.raises(UnusableMeshError, match=" within 0 s"):
        netgen.run_child(glued_solids(FIG9, BOTH), field_of(FIG9, NETGEN, ZONE, BOTH), 0.01)
    assert "netgen.occ" not in sys.modules


TOLERANCE_MM = 0.1
SKINNED = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0, skin_mm=0.25)


def test_tessellated_parts_have_their_volumes() -> None:
    body = tessellated(SKINNED, glued_solids(SKINNED, ("x",)), TOLERANCE_MM)
    assert body.part_labels == ("skin",)
    assert body.part(1).volume == pytest.approx(4.0 * 0.25 * 4.0)
    assert body.volume_mm3 == pytest.approx(4.0 * 3.0 * 4.0)
    check_volume(SKINNED, body, ("x",))
    with pytest.raises(Finger3dError, match=r"^block: .*volume_mm3"):
        check_volume(SKINNED, body, ())


def test_edges_in_a_thin_part_are_no_longer_than_it_is_thick() -> None:
    body = tessellated(SKINNED, glued_solids(SKINNED, ()), TOLERANCE_MM)
    field = sizing(SKINNED, MeshOptions(1.0, 1.0), (-1.0, 1.0, -1.0, 1.0), *box(SKINNED, ()))
    fine = finer_in_layers(field, body)
    inside = np.array([[0.5, 2.9, 0.5], [3.0, 2.8, -1.0]])
    assert (field.at(inside) > 0.9).all()
    # Twice the volume over the whole surface of the layer, whose rim counts too.
    layer = 2.0 * (8.0 * 4.0 * 0.25) / (2.0 * 8.0 * 4.0 + 2.0 * (8.0 + 4.0) * 0.25)
    assert (fine.at(inside) <= 1.6 * layer).all()
    assert fine.at(np.array([[0.0, 0.2, 0.0]]))[0] > 2.0 * layer


FINGERTIP = make("fingertip")


def check(mesh: Mesh, volumes: dict[str, float]) -> None:
    """Every part has its volume, cells are positive, and labelled facets are the boundary."""
    assert mesh.part is not None
    assert (curved_jacobians(mesh) > 0.0).all()
    labelled = np.vstack([f[:, :3] for f in mesh.facets.values()])
    outer = boundary(mesh.cells[:, :4], 3)
    assert {tuple(f) for f in np.sort(labelled, axis=1)} == {tuple(f) for f in np.sort(outer, axis=1)}
    assert set(mesh.part_labels) == set(volumes) - {""}
    for number, label in enumerate(("", *mesh.part_labels)):
        # curved cells on cylinders and spheres: 1e-4 at 30 degrees an edge
        assert 4.0 * part_volume(mesh, number) == pytest.approx(volumes[label], rel=2e-3), label


def test_a_real_mesh_of_parts_is_conforming_and_on_its_interfaces() -> None:
    options = MeshOptions(size_mm=1.6, base_size_mm=4.0, mesher="ftetwild")
    mesh, report = mesh_solid(FINGERTIP, options, (-2.0, 2.0, -2.0, 2.0), BOTH)
    areas = FINGERTIP.section().areas_mm2
    check(mesh, {label: area * FINGERTIP.width_mm for label, area in areas.items()})
    assert report.min_dihedral_deg > 3.0
    assert set(mesh.facets) == {"base", "contact", "ends", "symmetry_x", "symmetry_z", "walls"}
    skin = mesh.points[interface(mesh, 0, 1)]
    np.testing.assert_allclose(np.hypot(skin[:, 0], skin[:, 1] - 2.0), 9.0, rtol=1e-10)  # its axis is 12 - 10 mm high
    core = mesh.points[interface(mesh, 0, 2)]
    assert (np.isclose(core[:, 1], 6.0, atol=1e-9) | np.isclose(core[:, 0], 3.0, atol=1e-9)).all()
    again, cached = mesh_solid(FINGERTIP, options, (-2.0, 2.0, -2.0, 2.0), BOTH)
    assert cached.from_cache
    np.testing.assert_array_equal(again.part, mesh.part)


@pytest.mark.slow
def test_a_step_file_with_a_core_and_a_cavity_is_meshed(tmp_path: Path) -> None:
    from build123d import Box, Pos, Sphere

    ball = Pos(0.0, 3.0, 0.0) * Sphere(1.5)
    core = Pos(0.0, 0.5, 0.0) * Box(10.0, 1.0, 8.0)
    path = file_of(tmp_path / "finger.step", _=Pos(0.0, 3.5, 0.0) * Box(10.0, 5.0, 8.0) - ball, core=core)
    body = imported(path)
    mesh, _ = mesh_solid(body, MeshOptions(1.5, 3.0), (-2.0, 2.0, -2.0, 2.0), BOTH)
    check(mesh, {"": 400.0 - 4.5 * np.pi, "core": 80.0})
    facets, points = mesh.facets["cavity"], mesh.points - [0.0, 3.0, 0.0]
    radius, straight = np.linalg.norm(points, axis=1), points[facets[:, TRI3.edges]].mean(axis=2)
    np.testing.assert_allclose(radius[facets[:, :3]], 1.5, rtol=1e-10)
    curved = np.isclose(radius[facets[:, 3:]], 1.5, rtol=1e-10, atol=0.0)
    assert curved.mean() > 0.98  # an edge whose cell it would invert is straight
    np.testing.assert_allclose(points[facets[:, 3:]][~curved], straight[~curved], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(mesh.points[interface(mesh, 0, 1), 1], 1.0, rtol=1e-12)


def cube_of_two() -> tuple[np.ndarray, np.ndarray]:
    """Six tets of the unit cube about its diagonal."""

    mesh = grid((2, 2, 2))
    return mesh.points, mesh.cells


def test_facets_between_parts_are_found_once_and_look_out_of_the_lower_part() -> None:
    points, cells = cube_of_two()
    part = (points[cells].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    facets = part_facets(cells, part)
    between = facets.outside != OUTSIDE
    assert between.sum() == 8
    assert (facets.inside[between] == 0).all()
    a, b, c = points[facets.faces[between]].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 1] > 0.0).all()
    np.testing.assert_array_equal(facets.free, boundary(cells, 3))
    np.testing.assert_array_equal(part_facets(cells).faces, boundary(cells, 3))


def halves() -> Any:
    """The glued halves, below and above y = 0.5, of a unit cube with a corner at the origin."""
    from build123d import Box, Pos

    low, high = (Pos(0.5, y, 0.5) * Box(1.0, 0.5, 1.0) for y in (0.25, 0.75))
    return tessellate_parts(glue({"": low.solids()[0], "top": high.solids()[0]}, "cube"), 1e-3)


def test_nodes_near_an_interface_come_onto_it() -> None:
    points, cells = cube_of_two()
    part = (points[cells].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    moved = points + 0.03 * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
    mesh = snap(moved, cells, halves(), part)
    assert (mesh.points[interface(mesh, 0, 1), 1] == 0.5).all()
    for number in range(2):
        assert part_volume(mesh, number) == pytest.approx(0.5, rel=1e-12)


def test_a_skin_thinner_than_the_envelope_is_refused() -> None:
    design = designs()["fingertip"](100.0, 50.0, 36.6, 20.0, 0.05)
    with pytest.raises(Finger3dError, match=r"'skin' .*[\d.]+ mm.*'ftetwild' .*mesher = 'swept'"):
        mesh_solid(design, MeshOptions(5.0, 10.0), (-10.0, 10.0, -5.0, 5.0), BOTH)
