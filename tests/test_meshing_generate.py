"""Meshes of bodies from files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.geometry.faceted import body as faceted_body
from finger3d.geometry.imported import imported
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from tests.designs import SMALL

BOTH = ("x", "z")


def options(size: float, base: float) -> Any:
    return MeshOptions(size_mm=size, base_size_mm=base, mesher="ftetwild")


def test_a_step_finger_is_meshed_on_its_cad_faces(drawn: Path) -> None:
    body = imported(drawn / "finger.step")
    mesh, report = mesh_solid(body, options(1.2, 3.0), (-6.0, 6.0, -4.0, 4.0), BOTH)
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    planes = {"base": (1, 0.0), "ends": (2, 4.0), "walls": (0, 10.0), "symmetry_x": (0, 0.0), "symmetry_z": (2, 0.0)}
    for label, (axis, value) in planes.items():
        assert np.abs(at[label][:, axis] - value).max() < 1e-12
    assert (at["base"][:, 1] == 0.0).all()
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - SMALL.height_mm + 20.0) - 20.0
    assert np.abs(off).max() < 1e-9
    assert report.volume_mm3 == pytest.approx(SMALL.volume_mm3, rel=1e-4)


@pytest.mark.slow
def test_fillets_are_contact_and_hold_their_nodes(drawn: Path) -> None:
    from build123d import Compound, Vertex

    body = imported(drawn / "rounded.step")
    mesh, _ = mesh_solid(body, options(0.9, 2.0), (-5.0, 5.0, -3.0, 3.0), BOTH)
    assert set(mesh.facets) == {"contact", "base", "ends", "walls", "symmetry_x", "symmetry_z"}
    nodes = np.unique(mesh.facets["contact"])
    contact = mesh.points[nodes]
    off = [np.hypot(contact[:, i] - middle, contact[:, 1] - 3.5) - 1.5 for i, middle in ((0, 4.5), (2, 2.5))]
    off = np.abs(off).min(axis=0)[contact[:, 1] < 5.0 - 1e-9]
    assert np.quantile(off, 0.9) < 1e-9
    # The rest are nodes of the same facets on the walls, which the fillets run into smoothly.
    skin = Compound(body.solid().faces())
    away = np.array([skin.distance_to(Vertex(*map(float, p))) for p in contact])
    assert np.quantile(away, 0.95) < 1e-9
    assert away[np.isin(nodes, mesh.vertices)].max() < 1e-4
    # In some meshes an edge is left straight, where a curved one would turn a cell inside out: its chord's sagitta.
    assert away.max() < 1.5 * 0.9**2 / (8.0 * 1.5)  # of an edge somewhat longer than asked for, on a fillet of 1.5 mm


def test_an_stl_finger_is_meshed_on_its_triangles(drawn: Path) -> None:
    body = imported(drawn / "finger.stl")
    patches = faceted_body(body.surface)
    assert sorted(f.label for f in patches.faces) == ["base", "contact", "ends", "ends", "walls", "walls"]
    mesh, report = mesh_solid(body, options(1.5, 3.0), (-6.0, 6.0, -4.0, 4.0))
    assert set(mesh.facets) == {"contact", "base", "ends", "walls"}
    assert (mesh.points[np.unique(mesh.facets["base"]), 1] == 0.0).all()
    contact = mesh.points[np.unique(mesh.facets["contact"])]
    assert np.abs(body.surface.signed_distance(contact)[0]).max() < 1e-6
    assert report.volume_mm3 == pytest.approx(body.volume_mm3, rel=1e-3)
