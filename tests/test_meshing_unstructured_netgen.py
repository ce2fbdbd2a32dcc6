"""netgen: the same mesh every time, on the CAD faces, graded, of one solid or several; what it refuses."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError, MissingError
from finger3d.fem.mesh.quality import curved_jacobians, curved_volume
from finger3d.fem.mesh.simplex import boundary
from finger3d.geometry.imported import imported
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing import cache
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.refinement.sizing import sizing
from finger3d.meshing.structured.snap import UnusableMeshError
from finger3d.meshing.unstructured import netgen
from finger3d.meshing.unstructured.solids import box, glued_solids
from finger3d.progress import QUIET
from tests.bodies import box as box_of
from tests.bodies import write_stl
from tests.designs import FIG9, ZONE, make
from tests.meshes import edge_lengths, interface

BOTH = ("x", "z")
OPTIONS = MeshOptions(4.0, 10.0, "netgen")


def field_of(design: Any, options: Any, zone: tuple[float, float, float, float], symmetry: tuple[str, ...]) -> Any:
    return sizing(design, options, zone, *box(design, symmetry))


def test_a_quarter_lies_on_the_cad_and_is_graded() -> None:
    mesh, report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH)
    assert set(mesh.facets) == {"contact", "base", "ends", "walls", "symmetry_x", "symmetry_z"}
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    planes = {"base": (1, 0.0), "ends": (2, 10.0), "walls": (0, 50.0), "symmetry_x": (0, 0.0), "symmetry_z": (2, 0.0)}
    for label, (axis, value) in planes.items():
        assert (at[label][:, axis] == value).all()
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - FIG9.height_mm + 100.0) - 100.0
    assert np.abs(off).max() < 1e-10
    assert (curved_jacobians(mesh) > 0.0).all()
    assert report.volume_mm3 == pytest.approx(FIG9.volume_mm3, rel=1e-4)
    assert report.min_dihedral_deg > 10.0
    contact, length = edge_lengths(mesh, "contact")
    top = length[contact[:, :, 0].max(axis=1) < 40.0].mean()
    assert 0.8 * OPTIONS.size_mm < top < 1.2 * OPTIONS.size_mm
    assert edge_lengths(mesh, "base")[1].mean() > 1.5 * top


def test_the_same_mesh_comes_every_time() -> None:
    field = field_of(FIG9, OPTIONS, ZONE, BOTH)
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
        own = replace(mesh, cells=mesh.cells[mesh.part == number], part=None)
        assert 4.0 * curved_volume(own) == pytest.approx(area * design.width_mm, rel=1e-4)
    skin = mesh.points[np.unique(interface(mesh, 0, 1))]
    np.testing.assert_allclose(np.hypot(skin[:, 0], skin[:, 1] - 2.0), 9.0, rtol=1e-10)


def test_a_hemisphere_of_few_cells_is_curved() -> None:
    ball = designs()["hemisphere"](5.0)
    mesh, report = mesh_solid(ball, MeshOptions(1.5, 3.0, "netgen"), (-1.0, 1.0, -1.0, 1.0))
    assert set(mesh.facets) == {"contact", "base"}
    assert report.volume_mm3 == pytest.approx(ball.volume_mm3, rel=2e-3)


def test_points_of_the_size_field_are_as_dense_as_the_cells() -> None:
    field = field_of(FIG9, OPTIONS, ZONE, ())
    points, sizes = netgen.size_points(field)
    assert (points >= field.low).all()
    assert (points <= field.high).all()
    np.testing.assert_allclose(sizes, field.at(points))
    assert sizes.min() == OPTIONS.size_mm
    # every point stands for a box no longer than its edge length; the boxes fill the field's box
    assert np.sum(sizes**3) >= np.prod(field.high - field.low)


def test_meshes_of_the_two_meshers_are_kept_apart() -> None:
    keys = {cache.key(FIG9, replace(OPTIONS, mesher=m), ZONE, BOTH) for m in ("netgen", "ftetwild")}
    assert len(keys) == 2


def test_stl_is_left_to_ftetwild(tmp_path: Path) -> None:
    body = imported(write_stl(tmp_path / "body.stl", box_of(10.0, 8.0, 6.0)))
    with pytest.raises(Finger3dError, match=r"'netgen' .*STL.*'ftetwild'"):
        mesh_solid(body, MeshOptions(2.0, 3.0, "netgen"), (-1.0, 1.0, -1.0, 1.0))


def test_without_the_package_a_line_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finger3d._extras.available", lambda module: module != "netgen")
    with pytest.raises(MissingError, match=r'-m pip install .*\[netgen\]".*mesh.mesher = "swept"'):
        netgen.new_mesh(FIG9, OPTIONS, ZONE, BOTH, QUIET)


@pytest.mark.parametrize(("limit", "text"), [(0.01, " within 0 s"), (60.0, "netgen .*return code 1.: .*Error")])
def test_a_child_that_fails_is_told(monkeypatch: pytest.MonkeyPatch, limit: float, text: str) -> None:
    if limit > 1.0:
        monkeypatch.setattr(netgen, "size_points", lambda field: (np.zeros((1, 2)), np.ones(1)))  # two coordinates
    body = SimpleNamespace(shape=glued_solids(FIG9, BOTH).shape)
    with pytest.raises(UnusableMeshError, match=text):
        netgen.run_child(body, field_of(FIG9, OPTIONS, ZONE, BOTH), limit)  # type: ignore[arg-type]
    assert "netgen.occ" not in sys.modules
