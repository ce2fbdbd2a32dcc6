"""Structured meshes: of sections, and swept from them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from finger3d.errors import Finger3dError
from finger3d.fem.mesh.quality import curved_jacobians
from finger3d.fem.mesh.simplex import Mesh, boundary, signed_volumes, unfold
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.swept import mesh_section
from tests.commands import loaded
from tests.designs import FIG9, HALF, zone_of

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


@pytest.mark.parametrize("symmetry", [(), ("x",)])
@pytest.mark.parametrize("name", ALL)
def test_sections_are_sound(name: str, symmetry: tuple[str, ...]) -> None:
    design = ALL[name]
    mesh, report = mesh_section(design, sizes(design), zone_of(design), symmetry)
    assert mesh.dim == 2
    check_whole(mesh)
    check_planes(mesh, design)
    assert ("symmetry_x" in mesh.facets) == bool(symmetry)
    assert report.volume_mm3 == pytest.approx(report.cad_volume_mm3, rel=1e-4)
    assert report.cad_volume_mm3 == pytest.approx(design.volume_mm3, rel=1e-12)
    assert (report.points, report.cells) == (len(mesh.points), len(mesh.cells))
    # A lens ends in a corner of 30 degrees, 53 for the low one; others have none below 90.
    assert report.min_dihedral_deg > (5.0 if name in ("lens", "low") else 11.0)


@pytest.mark.parametrize("symmetry", [(), ("x",), ("z",), ("x", "z")])
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


@settings(max_examples=60, deadline=None)
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
        "from types import SimpleNamespace as N; from finger3d.geometry.registry import *;"
        "from finger3d.meshing.generate import *; from finger3d.meshing.structured.swept import *;"
        "d = designs()['half_cylinder'](5.0, 10.0);"
        "o = N(size_mm=0.5, base_size_mm=2.0, mesher='swept', layers=2, grading=None);"
        "z = (-2, 2, -5, 5); mesh_section(d, o, z); mesh_solid(d, o, z)"
    )
    assert not loaded(program, "build123d", "OCP", "pytetwild", "trimesh", "scipy", "vtk")
