"""Size and quality of a mesh."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.meshing.report import content_hash, mesh_report
from tests.meshes import grid


def test_a_report_of_a_quarter_is_that_of_the_whole_body() -> None:
    mesh = quadratic(grid((2, 2, 2)))
    found = mesh_report(mesh, 4.0, 4.0, {"mesh": 0.1})
    assert (found.points, found.cells) == (125, 48)
    assert found.volume_mm3 == pytest.approx(4.0, rel=1e-12)
    # Kuhn's cells have dihedral angles of 45, 60 and 90 degrees
    assert found.min_dihedral_deg == pytest.approx(45.0, abs=1e-9)
    assert not found.from_cache


def test_the_hash_tells_meshes_apart_and_does_not_depend_on_memory_order() -> None:
    mesh = grid((2, 2))
    moved = mesh.points.copy()
    moved[4] += [1e-15, 0.0]
    assert content_hash(mesh) == content_hash(Mesh(np.asfortranarray(mesh.points), mesh.cells, {}))
    assert content_hash(mesh) != content_hash(Mesh(moved, mesh.cells, {}))
    assert content_hash(mesh) != content_hash(Mesh(mesh.points, mesh.cells[::-1], {}))
