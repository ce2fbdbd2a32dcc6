"""Parts of unstructured meshes: cells sorted by the solid that holds them, interfaces on their CAD faces, cavities."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.mesh.quality import curved_jacobians, curved_volume
from finger3d.fem.mesh.simplex import Mesh, boundary
from finger3d.geometry.imported import imported
from finger3d.geometry.parts import OUTSIDE, glue
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import tessellate_parts
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.given.interfaces import part_facets, parts_of, points_on, thickness
from finger3d.meshing.structured.snap import snap
from tests.bodies import box
from tests.designs import make
from tests.meshes import interface
from tests.test_geometry_parts import file_of

FINGERTIP = make("fingertip")
BOTH = ("x", "z")


def check(mesh: Mesh, volumes: dict[str, float]) -> None:
    """Every part has its volume, cells are positive, and labelled facets are the boundary."""
    assert mesh.part is not None
    assert (curved_jacobians(mesh) > 0.0).all()
    labelled = np.vstack([f[:, :3] for f in mesh.facets.values()])
    outer = boundary(mesh.cells[:, :4], 3)
    assert {tuple(f) for f in np.sort(labelled, axis=1)} == {tuple(f) for f in np.sort(outer, axis=1)}
    assert set(mesh.part_labels) == set(volumes) - {""}
    for number, label in enumerate(("", *mesh.part_labels)):
        own = replace(mesh, cells=mesh.cells[mesh.part == number], part=None)
        # curved cells on cylinders and spheres: 1e-4 at 30 degrees an edge
        assert 4.0 * curved_volume(own) == pytest.approx(volumes[label], rel=2e-3), label


def test_a_real_mesh_of_parts_is_conforming_and_on_its_interfaces() -> None:
    options = MeshOptions(size_mm=1.6, base_size_mm=4.0, mesher="ftetwild")
    mesh, report = mesh_solid(FINGERTIP, options, (-2.0, 2.0, -2.0, 2.0), BOTH)
    areas = FINGERTIP.section().areas_mm2
    check(mesh, {label: area * FINGERTIP.width_mm for label, area in areas.items()})
    assert report.min_dihedral_deg > 3.0
    assert set(mesh.facets) == {"base", "contact", "ends", "symmetry_x", "symmetry_z", "walls"}
    skin = mesh.points[np.unique(interface(mesh, 0, 1))]
    np.testing.assert_allclose(np.hypot(skin[:, 0], skin[:, 1] - 2.0), 9.0, rtol=1e-10)  # its axis is 12 - 10 mm high
    core = mesh.points[np.unique(interface(mesh, 0, 2))]
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
    cavity = mesh.points[np.unique(mesh.facets["cavity"])] - [0.0, 3.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(cavity, axis=1), 1.5, rtol=1e-10)
    np.testing.assert_allclose(mesh.points[np.unique(interface(mesh, 0, 1)), 1], 1.0, rtol=1e-12)


def cube_of_two() -> tuple[np.ndarray, np.ndarray]:
    """Six tets of the unit cube about its diagonal."""
    from tests.meshes import grid

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


def test_points_are_sorted_by_the_solid_that_holds_them() -> None:
    points = np.array([[0.5, 0.1, 0.5], [0.5, 0.9, 0.5], [0.5, 1.1, 0.5], [-0.1, 0.2, 0.5]])
    assert parts_of(points, halves()).tolist() == [0, 1, OUTSIDE, OUTSIDE]


def test_nodes_near_an_interface_come_onto_it() -> None:
    points, cells = cube_of_two()
    part = (points[cells].mean(axis=1)[:, 1] > 0.5).astype(np.int64)
    moved = points + 0.03 * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
    mesh = snap(moved, cells, halves(), part)
    assert (mesh.points[np.unique(interface(mesh, 0, 1)), 1] == 0.5).all()
    for number in range(2):
        own = replace(mesh, cells=mesh.cells[mesh.part == number], part=None)
        assert curved_volume(own) == pytest.approx(0.5, rel=1e-12)


def test_a_layer_is_as_thick_as_it_is_and_sampled_all_over() -> None:
    layer = box(20.0, 0.5, 10.0)
    assert thickness(layer) == pytest.approx(0.5 / (1.0 + 0.05 + 0.025))
    points = points_on(layer, 1.0)
    np.testing.assert_array_equal(points, points_on(Triangles(layer.points, layer.faces), 1.0))
    assert np.ptp(points, axis=0) == pytest.approx([20.0, 0.5, 10.0], rel=0.1)


def test_a_skin_thinner_than_the_envelope_is_refused() -> None:
    design = designs()["fingertip"](100.0, 50.0, 36.6, 20.0, 0.05)
    with pytest.raises(Finger3dError, match=r"'skin' .*[\d.]+ mm.*'ftetwild' .*mesher = 'swept'"):
        mesh_solid(design, MeshOptions(5.0, 10.0), (-10.0, 10.0, -5.0, 5.0), BOTH)
