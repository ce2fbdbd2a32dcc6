"""Tessellation and snapping, on deterministic meshes: a swept mesh shaken as fTetWild would."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from finger3d.fem.mesh.quality import cell_angles_deg, curved_jacobians, curved_volume
from finger3d.fem.mesh.simplex import boundary, unfold
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.snap import MIN_DIHEDRAL_DEG, UnusableMeshError, check_closed, repair, snap
from tests.cad_cases import body_of
from tests.designs import FIG9, HALF


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
