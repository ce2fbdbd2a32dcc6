"""Fingers that are meshes: files that Gmsh 4.15 wrote, and small ones made here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from tests.meshes import grid

GMSH = Path(__file__).resolve().parent / "gmsh"
"""A dome of radius 20 mm, 20 mm long and 8 mm high and wide, its walls along x straight, with a core of 10 by 3 mm.

`body.geo` tells how the files were made.  `tetrahedron.msh` is one cell with named facets, as Gmsh writes it.
"""


def refused(action: Callable[[], object]) -> str:
    """The one line with which an action is refused."""
    with pytest.raises(Finger3dError) as caught:
        action()
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    return line


def cube(count: int = 2, edge_mm: float = 4.0) -> Mesh:
    """A linear cube on its base, the middle of which is the origin; facets base and contact."""
    unit = grid((count, count, count))
    facets = {"contact": unit.facets["y+"], "base": unit.facets["y-"]}
    return Mesh((unit.points - [0.5, 0.0, 0.5]) * edge_mm, unit.cells, facets)


def vtu_of(
    path: Path,
    mesh: Mesh,
    parts: Sequence[str] = ("",),
    numbers: bool = False,
    names: bool = True,
    hexahedron: bool = False,
    text: bool = False,
) -> Path:
    """Write a linear mesh with its facets by name, and cells that take the names of parts in turn."""
    import pyvista

    labels = list(mesh.facets)
    blocks = [(10, mesh.cells), *((5, facets) for facets in mesh.facets.values())]
    label = np.repeat([-1, *range(len(labels))], [len(block) for _, block in blocks])
    part = np.where(label < 0, np.arange(len(label)) % len(parts), -1)
    if hexahedron:
        blocks.append((12, np.arange(8)[None]))
        label, part = np.append(label, -1), np.append(part, -1)
    cells = np.concatenate([np.insert(block, 0, block.shape[1], axis=1).ravel() for _, block in blocks])
    types = np.repeat([kind for kind, _ in blocks], [len(block) for _, block in blocks]).astype(np.uint8)
    grid_of = pyvista.UnstructuredGrid(cells, types, mesh.points)
    for key, values, known in (("label", label, labels), ("part", part, list(parts))):
        names_of = np.array([*known, ""])
        grid_of.cell_data[key] = values if numbers else names_of[values]
        if numbers and names:
            grid_of.field_data[f"{key}_names"] = np.array([name or "body" for name in known])
    if numbers:  # the main body has no name as a text
        grid_of.cell_data["part"] = np.where(part > 0, part, -1)
    grid_of.save(path, binary=not text)
    return path
