"""Files of a mold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from finger3d.mold.output import as_printed, plate
from finger3d.mold.shell import shell


def test_parts_and_plate_load_again_in_mm(paper_mold, tmp_path: Path) -> None:
    from lib3mf import Lib3MF

    from finger3d.mold.shell import write_3mf, write_stl

    shells = {name: shell(part, 0.05, name) for name, part in paper_mold.parts.items()}
    printed = as_printed(shells)
    placed, size = plate(printed)
    write_3mf(tmp_path / "mold.3mf", placed)
    wanted = {name: part.volume for name, part in paper_mold.parts.items()}
    for name, part in printed.items():
        write_stl(tmp_path / f"{name}.stl", part.surface, text=False)
        mesh = trimesh.load(tmp_path / f"{name}.stl")
        assert mesh.is_watertight
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(wanted[name], rel=1e-3)
        np.testing.assert_allclose(mesh.bounds[0], 0.0, atol=1e-6)
        np.testing.assert_allclose(mesh.extents, part.extent, atol=1e-4)
    model = Lib3MF.Wrapper(str(Path(Lib3MF.__file__).with_name("lib3mf"))).CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(tmp_path / "mold.3mf"))
    assert model.GetUnit() == Lib3MF.ModelUnit.MilliMeter
    meshes = model.GetMeshObjects()
    for name, part in placed.items():
        assert meshes.MoveNext()
        mesh = meshes.GetCurrentMeshObject()
        assert mesh.GetName() == name
        assert mesh.IsManifoldAndOriented()
        points = np.array([list(v.Coordinates) for v in mesh.GetVertices()])
        faces = np.array([list(t.Indices) for t in mesh.GetTriangleIndices()])
        assert trimesh.Trimesh(points, faces).volume == pytest.approx(wanted[name], rel=1e-3)
        np.testing.assert_allclose(points.min(axis=0), part.surface.low, atol=1e-4)
    assert not meshes.MoveNext()
    assert size[1] == pytest.approx(sum(p.extent[1] for p in printed.values()) + 16.0)
