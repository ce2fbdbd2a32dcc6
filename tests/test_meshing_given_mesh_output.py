"""Meshes that are written come back with every number, label and part."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.meshing.given.given import given_mesh
from finger3d.meshing.given.mesh_output import write_mesh_msh, write_mesh_vtu
from tests.given_meshes import GMSH


@pytest.mark.parametrize(("write", "name"), [(write_mesh_msh, "again.msh"), (write_mesh_vtu, "again.vtu")])
def test_a_mesh_comes_back(write, name: str, tmp_path: Path) -> None:
    mesh = given_mesh(GMSH / "binary.msh").mesh
    write(tmp_path / name, mesh)
    back = given_mesh(tmp_path / name).mesh
    np.testing.assert_array_equal(back.points, mesh.points)
    assert back.part_labels == mesh.part_labels
    for part in (0, 1):  # .msh holds the cells part by part
        np.testing.assert_array_equal(back.cells[back.part == part], mesh.cells[mesh.part == part])
    for label, facets in mesh.facets.items():
        assert {frozenset(f) for f in back.facets[label].tolist()} == {frozenset(f) for f in facets.tolist()}


@pytest.mark.parametrize(("write", "name"), [(write_mesh_msh, "again.msh"), (write_mesh_vtu, "again.vtu")])
def test_names_of_parts_come_back_with_their_quotation_marks(write, name: str, tmp_path: Path) -> None:
    mesh = replace(given_mesh(GMSH / "binary.msh").mesh, part_labels=("a\"b \\ 'c' K\u00f6rper",))
    write(tmp_path / name, mesh)
    assert given_mesh(tmp_path / name).mesh.part_labels == mesh.part_labels
