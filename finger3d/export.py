"""Files for others to read: VTU, CSV and JSON, each written whole or not at all."""

from __future__ import annotations

import csv
import json
import math
import os
import secrets
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d.errors import Finger3dError
from finger3d.mesh import Mesh

MAIN = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")
"""The numbers of a press that short tables show, and that get an error bar, beside every gauge."""

AREAS = ("contact_area_mm2", "stick_area_mm2")
"""Those that get an error bar besides."""

_CELL_TYPES = {(2, 3): 5, (2, 6): 22, (3, 4): 10, (3, 10): 24}
"""VTK's number for a cell, by dimension and number of nodes."""

_VTK_NAMES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i4": "Int32", "i1": "Int8", "u1": "UInt8"}


@contextmanager
def atomic(path: str | Path) -> Iterator[Path]:
    """Give the name of a temporary file beside `path`; it takes the place of `path` when the block ends well.

    The temporary name keeps the ending of `path`, for writers that go by it. An error in the block removes the
    temporary file and leaves an older `path` as it was. Missing folders are made.

    Raises
    ------
    Finger3dError
        If the file cannot be written.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        reason = error.strerror or str(error)
        raise Finger3dError(f"cannot write {target}: {reason}; choose another place with --out") from error
    finally:
        # Usually it is gone by now, or was never made; and a folder that refuses has been reported above.
        with suppress(OSError):
            temporary.unlink()


_LOCK = ".finger3d.lock"

_RESULTS = {
    "press": "summary.json", "compare": "compare.json", "calibrate": "calibration.json", "sweep": "sweep.json",
    "design": "search.json",
}  # fmt: skip
"""By command, the file that tells its results."""


@contextmanager
def claimed(folder: str | Path, command: str = "") -> Iterator[Path]:
    """Make a folder and keep every other finger3d from writing there while the block runs.

    A folder that this made, and into which nothing was written, is removed.

    Parameters
    ----------
    command : what is going to write there; its own older results may be replaced, those of another command may not

    Raises
    ------
    Finger3dError
        If another run holds it, it holds what another command wrote, or it cannot be written.
    """
    from filelock import FileLock, Timeout

    path = Path(folder)
    for other, file in _RESULTS.items():
        if command not in ("", other) and (path / file).exists():
            raise Finger3dError(f"--out {path}: holds the results of a {other}; name another folder, or remove it")
    made = [p for p in (path, *path.parents) if not p.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path / _LOCK, blocking=False)
        lock.acquire()
    except Timeout:
        raise Finger3dError(
            f"{path}: another finger3d is writing there; wait for it, or name another folder with --out"
        ) from None
    except OSError as error:
        raise Finger3dError(f"--out {path}: cannot be written: {error.strerror or error}") from None
    try:
        yield path
    finally:
        if made and os.listdir(path) == [_LOCK]:
            with suppress(OSError):  # of a folder that another run has found in the meantime
                (path / _LOCK).unlink()
                for folder in made:
                    folder.rmdir()
        lock.release()


_DAMAGED = (
    ValueError, TypeError, KeyError, AttributeError, EOFError, MemoryError, NotImplementedError, OverflowError,
    RuntimeError, SyntaxError, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What NumPy raises for an .npz file that is cut short, changed, or of another kind."""


def read_arrays(path: str | Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an .npz file.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except _DAMAGED as error:
        raise ValueError(f"no .npz file, or damaged: {error}") from error


def write_csv(path: str | Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write one line of names and a line for each entry; numbers keep every digit (``repr``).

    Parameters
    ----------
    columns : name (with its unit) -> (n,) numbers, or texts; all of one length
    """
    arrays = [np.asarray(column) for column in columns.values()]
    shapes = {a.shape for a in arrays}
    if len(shapes) > 1 or any(len(s) != 1 for s in shapes):
        raise ValueError(f"columns of {path} differ in shape: { {k: np.shape(v) for k, v in columns.items()} }")
    with atomic(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(a.tolist() for a in arrays), strict=True))


def write_json(path: str | Path, data: Any) -> None:
    """Write nested dicts, lists, arrays and numbers; NaN and infinity, which JSON lacks, become null."""
    text = json_text(data)
    with atomic(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def json_text(data: Any) -> str:
    """JSON of nested dicts, lists, arrays and numbers; NaN and infinity become null."""
    return json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, Enum | Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


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
    kind = _CELL_TYPES[mesh.dim, nodes]
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
    file.array("types", np.full(e, kind, dtype=np.uint8))
    file.close("Cells")
    file.close("Piece")
    with atomic(path) as temporary:
        temporary.write_bytes(file.document())


def _vtk_values(name: str, values: NDArray[Any], count: int, dim: int) -> NDArray[Any]:
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

    def array(self, name: str, values: NDArray[Any]) -> None:
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
