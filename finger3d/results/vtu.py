"""fields.vtu: a mesh and its fields for ParaView and PyVista."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np
from numpy.typing import ArrayLike

from finger3d._extras import require
from finger3d._types import Array
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.io import atomic

if TYPE_CHECKING:
    import pyvista

_VTK_TYPES = ("f8", "f4", "i8", "i4", "i1", "u1")


def write_vtu(
    path: str | Path,
    mesh: Mesh,
    point_data: Mapping[str, ArrayLike],
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write a mesh and its fields for ParaView or PyVista, without loading VTK.

    Points, vectors and tensors of a 2D mesh get a third component of zero.

    Parameters
    ----------
    mesh : linear or quadratic simplices; points in mm
    point_data : name -> (n,) or (n, k), or tensors (n, d, d)
    cell_data : name -> (e,) or (e, k), or (e, d, d)
    """
    whole = [(len(mesh.points), point_data), (len(mesh.cells), cell_data or {})]
    at_points, at_cells = (
        {_escaped(name): _vtk_values(name, np.asarray(values), count, mesh.dim) for name, values in fields.items()}
        for count, fields in whole
    )
    points = _vtk_values("points", mesh.points, len(mesh.points), mesh.dim)
    grid = meshio.Mesh(points, [(mesh.element.name, mesh.cells)], at_points, {k: [v] for k, v in at_cells.items()})
    with atomic(path) as temporary:
        # 64-bit counts of bytes, for fields beyond 4 GB; compression would take ten times as long
        meshio.vtu.write(temporary, grid, compression=None, header_type="UInt64")


def _escaped(name: str) -> str:
    """Return a name as an attribute of XML, which meshio writes as it is."""
    return escape(name).encode("ascii", "xmlcharrefreplace").decode()


def _vtk_values(name: str, values: Array, count: int, dim: int) -> Array:
    """Values as (count,) or (count, k) of a type VTK knows, padded to three dimensions."""
    if values.ndim not in (1, 2, 3) or len(values) != count:
        raise ValueError(f"field {name!r} has shape {values.shape}; its first length must be {count}")
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    elif values.dtype.str[1:] not in _VTK_TYPES:
        values = values.astype(np.float64)
    if dim == 2 and values.ndim > 1 and values.shape[-1] == 2:
        values = np.pad(values, [(0, 0)] + [(0, 1)] * (values.ndim - 1))
    return values.reshape(count, -1) if values.ndim == 3 else values


def grid(folder: str | Path, step: int | None = None) -> pyvista.UnstructuredGrid:
    """Return the finger at rest with its fields, from a folder of results.

    Parameters
    ----------
    step : as in `PressResult.to_pyvista`

    Raises
    ------
    Finger3dError
        If the folder holds no fields, or not that step.
    """
    require("to_pyvista()", "pyvista", instead="read fields.vtu with ParaView")
    import pyvista

    from finger3d.results.states import load_states

    path = Path(folder) / "fields.vtu"
    if not path.exists():
        raise Finger3dError(f"{folder}: holds no fields.vtu; press a scene into it first")
    found = pyvista.read(path)
    if step is None:
        return found
    states = load_states(Path(folder) / "steps.npz")
    k = states.index(step, folder)
    found.point_data.clear()
    found["displacement"] = np.pad(states.displacement[k], [(0, 0), (0, 3 - states.dim)])
    for name in ("pressure", "shear_x", "shear_z", "status"):
        found[name] = states.on_points(name, k)
    return found
