"""Fingers that are meshes: kept as they are, put on their base, measured, bisected; refused with a reason."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.given.given import GivenMesh, given_mesh
from tests.given_meshes import GMSH, cube, refused, vtu_of

RADIUS, MIDDLE = 20.0, -12.0  # of the dome's arc, mm
EVERYWHERE = (-99.0, 99.0, -99.0, 99.0)


def made(tmp_path: Path, mesh: Mesh, **options: object) -> GivenMesh:
    """A mesh that was written and read."""
    return given_mesh(vtu_of(tmp_path / "body.vtu", mesh, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["text.msh", "binary.msh"])
def test_a_mesh_of_gmsh_is_a_finger(name: str) -> None:
    body = given_mesh(GMSH / name)
    angle = np.arcsin(10.0 / RADIUS)
    segment = RADIUS**2 * (angle - np.sin(angle) * np.cos(angle))
    exact = 8.0 * (20.0 * (RADIUS * np.cos(angle) + MIDDLE) + segment)
    assert body.name == name
    # edges of 5 mm on an arc of 20 mm: chords leave h^2 / (12 R^2) of the cap's height, curved edges the square of that
    assert body.volume_mm3 == pytest.approx(exact, rel=1e-4)
    assert body.height_mm == pytest.approx(8.0, abs=1e-9)
    assert body.half_length_mm == pytest.approx(10.0, abs=1e-9)
    assert body.width_mm == pytest.approx(8.0, abs=1e-9)
    assert body.part_labels == ("core",)
    core = replace(body.mesh, cells=body.mesh.cells[body.mesh.part == 1], part=None)
    assert curved_volume(core) == pytest.approx(10.0 * 3.0 * 8.0, rel=1e-9)
    x, z = np.array([-7.3, 0.0, 4.1]), np.array([1.0, -2.0, 3.9])
    np.testing.assert_allclose(body.top(x, z), np.sqrt(RADIUS**2 - x**2) + MIDDLE, atol=0.01)
    assert np.isnan(body.top(np.array([10.5]), np.zeros(1)))[0]
    assert {label: len(f) > 0 for label, f in body.mesh.facets.items()} == {
        "contact": True, "base": True, "walls": True, "ends": False,
    }  # fmt: skip


def test_the_surface_is_closed_and_facets_face_outward() -> None:
    body = given_mesh(GMSH / "binary.msh")
    edges = np.sort(body.surface.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    # chords of a quarter of an edge: a sixteenth of the chords of whole edges
    assert body.surface.volume == pytest.approx(body.volume_mm3, rel=5e-4)
    base = body.mesh.points[body.mesh.facets["base"][:, :3]]
    assert (np.cross(base[:, 1] - base[:, 0], base[:, 2] - base[:, 0])[:, 1] < 0.0).all()


def test_linear_cells_become_quadratic_with_straight_edges(tmp_path: Path) -> None:
    body = made(tmp_path, cube())
    assert body.mesh.element.is_quadratic
    assert body.volume_mm3 == pytest.approx(64.0, rel=1e-12)
    assert len(body.surface.faces) == 48
    assert body.top(np.array([0.3]), np.array([-1.0]))[0] == pytest.approx(4.0, abs=1e-12)
    assert body.part_labels == ()
    assert body.mirrors() == ()
    assert "STEP" in refused(body.solid)


def test_the_middle_of_the_base_becomes_the_origin(tmp_path: Path) -> None:
    mesh = cube()
    body = made(tmp_path, replace(mesh, points=mesh.points + [30.0, -7.0, 2.0]))
    np.testing.assert_allclose(body.mesh.points[body.mesh.vertices], mesh.points, atol=1e-12)
    assert (body.mesh.points[np.unique(body.mesh.facets["base"]), 1] == 0.0).all()


def test_parts_are_named(tmp_path: Path) -> None:
    mesh = cube()
    assert made(tmp_path, mesh, parts=["", "bone"]).part_labels == ("bone",)
    assert made(tmp_path, mesh, parts=["body", "bone", "skin"], numbers=True).part_labels == ("bone", "skin")
    assert made(tmp_path, mesh, parts=["silicone"]).part_labels == ()  # one name for all is no part of them


def test_edges_are_halved_where_shorter_ones_are_asked_for() -> None:
    body = given_mesh(GMSH / "binary.msh")
    kept, report = mesh_solid(body, MeshOptions(body.size_mm, body.base_size_mm), EVERYWHERE)
    assert kept is body.mesh
    assert report.cells == len(body.mesh.cells)
    near, _ = mesh_solid(body, MeshOptions(0.5 * body.size_mm, body.base_size_mm), (-2.0, 2.0, -4.0, 4.0))
    every, _ = mesh_solid(body, MeshOptions(0.5 * body.size_mm, 0.5 * body.base_size_mm), EVERYWHERE)
    assert len(body.mesh.cells) < len(near.cells) < len(every.cells)
    for finer in (near, every):
        assert curved_volume(finer) == pytest.approx(body.volume_mm3, rel=1e-12)
        assert set(np.unique(finer.part)) == {0, 1}
    coarser = MeshOptions(2.0 * body.size_mm, 2.0 * body.base_size_mm)
    assert f" {body.size_mm:g} mm" in refused(lambda: mesh_solid(body, coarser, EVERYWHERE))


def _with(mesh: Mesh, **facets: np.ndarray) -> Mesh:
    return replace(mesh, facets={**mesh.facets, **facets})


def _two_cubes() -> Mesh:
    one = cube(1)
    points = np.vstack([one.points, one.points + [9.0, 0.0, 0.0]])
    count = len(one.points)
    facets = {label: np.vstack([f, f + count]) for label, f in one.facets.items()}
    return Mesh(points, np.vstack([one.cells, one.cells + count]), facets)


def _without(label: str) -> Mesh:
    return replace(cube(), facets={key: f for key, f in cube().facets.items() if key != label})


def _inverted() -> Mesh:
    cells = cube().cells.copy()
    cells[6] = cells[6][[1, 0, 2, 3]]
    return replace(cube(), cells=cells)


def _tilted() -> Mesh:
    mesh = cube()
    return replace(mesh, points=mesh.points + np.outer(mesh.points[:, 0], [0.0, 0.1, 0.0]))


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        (_without("contact"), r"'contact' .*'label'.* 'base'"),
        (_without("base"), r"'base' .*'label'.* 'contact'"),
        (_inverted(), r"1 of 48 tetrahedra .* 7, near \("),
        (_two_cubes(), "2 bodies"),
        (_tilted(), r"y = -0\.2 to 0\.2 mm"),
        (replace(cube(), points=cube().points * [1.0, -1.0, -1.0]), "4 mm below .*'base'"),
        (replace(cube(), points=1e-3 * cube().points), r" 0\.2 to 5000 mm"),
        (_with(cube(), symmetry_x=cube().facets["base"]), "'symmetry_x'"),
        (_with(cube(), contact=cube().facets["base"]), "'base' and 'contact'|'contact' and 'base'"),
        (_with(cube(), contact=cube().cells[:1, :3] * 0 + [[0, 13, 26]]), r"facet \d+ .*'contact'"),
    ],
)
def test_a_mesh_that_is_no_finger_is_refused(mesh: Mesh, told: str, tmp_path: Path) -> None:
    assert re.search(told, refused(lambda: made(tmp_path, mesh)))
