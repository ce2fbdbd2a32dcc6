"""Meshes written as .msh (Gmsh 4.1, ASCII) and .vtu, with the names that `finger3d.meshing.given.mesh_files` reads."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from finger3d._types import Int
from finger3d.fem.mesh.simplex import Mesh
from finger3d.io import atomic
from finger3d.meshing.given.given import MAIN_BODY
from finger3d.meshing.given.mesh_files import LABEL, MSH_VERSION, PART

_GMSH_TRIANGLE6, _GMSH_TET10 = 9, 11
_GMSH_TET10_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # Gmsh numbers the last two edges the other way round
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
    part, names = _parts(mesh)
    count = sum(map(len, facets))
    cells = [np.insert(block, 0, block.shape[1], axis=1).ravel() for block in (mesh.cells, *facets)]
    types = np.repeat([_VTK_TET10, _VTK_TRIANGLE6], [len(mesh.cells), count])
    grid = pyvista.UnstructuredGrid(np.concatenate(cells), types.astype(np.uint8), np.ascontiguousarray(mesh.points))
    grid.cell_data[PART] = np.concatenate([part, np.full(count, -1)])
    grid.cell_data[LABEL] = np.repeat([-1, *range(len(labels))], [len(mesh.cells), *map(len, facets)])
    for key, texts in ((PART, names), (LABEL, labels)):
        array = vtkStringArray()  # PyVista refuses texts that are not ASCII
        array.SetName(f"{key}_names")
        for text in texts:
            array.InsertNextValue(text)
        grid.GetFieldData().AddArray(array)
    with atomic(path) as temporary:
        grid.save(temporary)


def write_mesh_msh(path: Path, mesh: Mesh) -> None:
    """Write a quadratic mesh of tetrahedra and its facets in Gmsh's format 4.1; labels and parts are physical groups.

    Every label is one surface, and every part one volume, without the curves and points that bound them.
    """
    surfaces = [(label, facets) for label, facets in mesh.facets.items() if len(facets)]
    part, names = _parts(mesh)
    volumes = [(name, mesh.cells[part == k]) for k, name in enumerate(names)]
    box = " ".join(f"{x:.17g}" for x in (*mesh.points.min(axis=0), *mesh.points.max(axis=0)))
    text = io.StringIO()
    text.write(f"$MeshFormat\n{MSH_VERSION} 0 8\n$EndMeshFormat\n$PhysicalNames\n{len(surfaces) + len(volumes)}\n")
    groups = [
        (dim, k, name) for dim, entities in ((2, surfaces), (3, volumes)) for k, (name, _) in enumerate(entities, 1)
    ]
    text.writelines(f'{dim} {k} "{name}"\n' for dim, k, name in groups)
    text.write(f"$EndPhysicalNames\n$Entities\n0 0 {len(surfaces)} {len(volumes)}\n")
    text.writelines(f"{k} {box} 1 {k} 0\n" for _, k, _ in groups)
    count = len(mesh.points)
    text.write(f"$EndEntities\n$Nodes\n1 {count} 1 {count}\n3 1 0 {count}\n")
    text.writelines(f"{k}\n" for k in range(1, count + 1))
    np.savetxt(text, mesh.points, fmt="%.17g")
    total = len(mesh.cells) + sum(len(facets) for _, facets in surfaces)
    text.write(f"$EndNodes\n$Elements\n{len(groups)} {total} 1 {total}\n")
    first = 1
    for dim, kind, entities in ((2, _GMSH_TRIANGLE6, surfaces), (3, _GMSH_TET10, volumes)):
        for k, (_, cells) in enumerate(entities, 1):
            text.write(f"{dim} {k} {kind} {len(cells)}\n")
            ordered = cells[:, _GMSH_TET10_ORDER] if dim == 3 else cells
            np.savetxt(text, np.column_stack([first + np.arange(len(cells)), ordered + 1]), fmt="%d")
            first += len(cells)
    text.write("$EndElements\n")
    with atomic(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")


def _parts(mesh: Mesh) -> tuple[Int, tuple[str, ...]]:
    """Return the number (e,) of the part of every cell, and the names of the parts that there are."""
    part = np.zeros(len(mesh.cells), dtype=np.int64) if mesh.part is None else mesh.part
    names = (MAIN_BODY, *mesh.part_labels)
    used = np.unique(part)
    return np.searchsorted(used, part), tuple(names[k] for k in used)
