"""Structured meshes of sections of several parts: their cells, their interfaces, their volumes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.geometry.section import cylinder_section, with_layer
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.bands import bands, outline, thin_places
from finger3d.meshing.structured.swept import mesh_section
from tests.designs import make, zone_of
from tests.meshes import interface
from tests.test_meshing_structured_swept import check_planes, check_whole

FINGERTIP = designs()["fingertip"]
BODIES = {
    "skin and core": FINGERTIP(100.0, 50.0, 36.6, 20.0, 3.0, 30.0, 20.0),
    "base plate": FINGERTIP(100.0, 50.0, 36.6, 20.0, 0.0, 50.0, 3.0),
    "tall core": FINGERTIP(100.0, 50.0, 36.6, 20.0, 1.0, 5.0, 45.0),
    "core nearly as long": FINGERTIP(100.0, 50.0, 36.6, 20.0, 0.0, 49.0, 20.0),
    "steep walls": FINGERTIP(8.0, 8.0, 6.0, 16.0, 0.0, 3.0, 10.0),
    "half cylinder": FINGERTIP(8.0, 8.0, 0.0, 16.0, 1.0, 3.0, 4.0),
    "lens": FINGERTIP(100.0, 50.0, 0.0, 16.0, 1.0, 20.0, 5.0),
    "low": FINGERTIP(100.0, 80.0, 5.0, 16.0, 1.0, 30.0, 5.0),
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
        own = replace(mesh, cells=mesh.cells[mesh.part == number], part=None)
        # chords of quadratic arcs: 1e-5 at 12 degrees an edge
        assert multiple * thickness * curved_volume(own) == pytest.approx(area * design.width_mm, rel=2e-5), label


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
    skin = mesh.points[np.unique(interface(mesh, 0, 1))]
    radius = np.hypot(skin[:, 0], skin[:, 1] - inner.contact.centre_y_mm)
    np.testing.assert_allclose(radius, design.radius_mm - design.skin_mm, rtol=1e-14)
    core = mesh.points[np.unique(interface(mesh, 0, 2))]
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


def test_equal_bodies_with_and_without_parts_have_equal_outlines() -> None:
    plain = cylinder_section(100.0, 50.0, 36.6)
    skinned = with_layer(plain, 2.0)
    assert [len(bands(s).bands) for s in (plain, skinned)] == [1, 2]
    assert not len(thin_places(plain)[0])
    u = np.linspace(0.0, 2.0, 9)
    np.testing.assert_array_equal(outline(plain, u), outline(skinned, u))
    inner = bands(skinned).bands[0].points(u[:5], 0.0)
    assert np.hypot(inner[:, 0], inner[:, 1] - plain.contact.at(np.zeros(1))[0, 1] + 100.0) == pytest.approx(98.0)
