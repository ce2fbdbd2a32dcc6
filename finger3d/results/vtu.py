"""fields.vtu: a mesh and its fields for ParaView and PyVista."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from finger3d._extras import require
from finger3d._types import Array
from finger3d.errors import Finger3dError
from finger3d.fem.simplex import Mesh
from finger3d.io import atomic

if TYPE_CHECKING:
    import pyvista

_VTK_NAMES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "i1": "Int8", "u1": "UInt8"}


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
    n, e, nodes = len(mesh.points), *mesh.cells.shape
    file = _Appended()
    file.open("Piece", NumberOfPoints=n, NumberOfCells=e)
    for tag, count, fields in (("PointData", n, point_data), ("CellData", e, cell_data or {})):
        file.open(tag)
        for name, values in fields.items():
            file.array(name, _vtk_values(name, np.asarray(values), count, mesh.dim))
        file.close(tag)
    file.open("Points")
    file.array("Points", _vtk_values("points", mesh.points, n, mesh.dim))
    file.close("Points")
    file.open("Cells")
    file.array("connectivity", mesh.cells.astype(np.int64).ravel())
    file.array("offsets", np.arange(nodes, (e + 1) * nodes, nodes, dtype=np.int64)[:e])
    file.array("types", np.full(e, mesh.element.vtk_type, dtype=np.uint8))
    file.close("Cells")
    file.close("Piece")
    with atomic(path) as temporary:
        temporary.write_bytes(file.document())


def _vtk_values(name: str, values: Array, count: int, dim: int) -> Array:
    """Values as (count,) or (count, k) of a type VTK knows, padded to three dimensions."""
    if values.ndim not in (1, 2, 3) or len(values) != count:
        raise ValueError(f"field {name!r} has shape {values.shape}; its first length must be {count}")
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    elif values.dtype.str[1:] not in _VTK_NAMES:
        values = values.astype(np.float64)
    if dim == 2 and values.ndim > 1 and values.shape[-1] == 2:
        values = np.pad(values, [(0, 0)] + [(0, 1)] * (values.ndim - 1))
    return values.reshape(count, -1) if values.ndim == 3 else values


class _Appended:
    """A VTK XML document whose arrays follow the text as raw bytes: small, exact and quick."""

    def __init__(self) -> None:
        self._text: list[str] = []
        self._blocks: list[bytes] = []
        self._offset = 0

    def open(self, tag: str, **attributes: int) -> None:
        self._text.append(f"<{tag}" + "".join(f' {k}="{v}"' for k, v in attributes.items()) + ">")

    def close(self, tag: str) -> None:
        self._text.append(f"</{tag}>")

    def array(self, name: str, values: Array) -> None:
        data = np.ascontiguousarray(values.astype(values.dtype.newbyteorder("<"), copy=False))
        components = 1 if data.ndim == 1 else data.shape[1]
        self._text.append(
            f'<DataArray type="{_VTK_NAMES[data.dtype.str[1:]]}" Name="{escape(name)}" '
            f'NumberOfComponents="{components}" format="appended" offset="{self._offset}"/>'
        )
        self._blocks += [np.uint64(data.nbytes).astype("<u8").tobytes(), data.tobytes()]
        self._offset += 8 + data.nbytes

    def document(self) -> bytes:
        head = (
            '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
            'header_type="UInt64">\n<UnstructuredGrid>\n'
        )
        tail = '\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_'
        text = head + "\n".join(self._text) + tail
        return b"".join([text.encode(), *self._blocks, b"\n</AppendedData>\n</VTKFile>\n"])


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
    kept = states.step.tolist()
    if step not in kept:
        raise Finger3dError(f"{folder}: increment {step} is not among the kept ones, {', '.join(map(str, kept))}")
    found.point_data.clear()
    k, flat = kept.index(step), states.dim == 2
    u = states.displacement[k]
    found["displacement"] = u if not flat else _with_zeros(u)
    for name in ("pressure", "shear_x", "shear_z", "status"):
        found[name] = states.on_points(name, k)
    return found


def _with_zeros(u: Any) -> Any:
    import numpy as np

    return np.pad(u, [(0, 0), (0, 1)])
