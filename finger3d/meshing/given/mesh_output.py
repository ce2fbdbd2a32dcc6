"""Meshes written as .vtu, with the names that `finger3d.meshing.given.mesh_files` reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from finger3d.fem.mesh import Mesh
from finger3d.io import atomic
from finger3d.meshing.given.given import MAIN_BODY
from finger3d.meshing.given.mesh_files import LABEL, PART

_VTK_TRIANGLE6, _VTK_TET10 = 22, 24


def write_mesh_vtu(path: Path, mesh: Mesh) -> None:
    """Write a quadratic mesh of tetrahedra and its facets as a .vtu file.

    Cells are numbered by their part and facets by their label, which ParaView can colour by; the names that the numbers
    stand for are field data.
    """
    import pyvista
    from vtkmodules.vtkCommonCore import vtkStringArray

    labels = [label for label, facets in mesh.facets.items() if len(facets)]
    facets = [mesh.facets[label] for label in labels]
    part = np.zeros(len(mesh.cells), dtype=np.int64) if mesh.part is None else mesh.part
    used = np.unique(part)
    names = [(MAIN_BODY, *mesh.part_labels)[k] for k in used]
    count = sum(map(len, facets))
    cells = [np.insert(block, 0, block.shape[1], axis=1).ravel() for block in (mesh.cells, *facets)]
    types = np.repeat([_VTK_TET10, _VTK_TRIANGLE6], [len(mesh.cells), count])
    grid = pyvista.UnstructuredGrid(np.concatenate(cells), types.astype(np.uint8), np.ascontiguousarray(mesh.points))
    grid.cell_data[PART] = np.concatenate([np.searchsorted(used, part), np.full(count, -1)])
    grid.cell_data[LABEL] = np.repeat([-1, *range(len(labels))], [len(mesh.cells), *map(len, facets)])
    for key, texts in ((PART, names), (LABEL, labels)):
        array = vtkStringArray()  # PyVista refuses texts that are not ASCII
        array.SetName(f"{key}_names")
        for text in texts:
            array.InsertNextValue(text)
        grid.GetFieldData().AddArray(array)
    with atomic(path) as temporary:
        grid.save(temporary)
