"""Bodies from STL and STEP files as closed triangles; a defect raises an error of one line."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._child import ChildError, in_child
from finger3d._extras import require
from finger3d._ranges import number
from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles, connected, has_three_corners
from finger3d.geometry.surface_checks import crossings, mistake
from finger3d.io import file_bytes

if TYPE_CHECKING:
    from build123d import Compound, Face, Solid


STL, STEP = (".stl",), (".step", ".stp")
SUFFIXES = (*STL, *STEP)

MOST_TRIANGLES = 300_000
"""Largest number of triangles of an STL file; the checks take about 60 us a triangle."""

_CHORD_ERROR = 5e-5  # of the tessellation of a CAD solid, over its diagonal
_FACET_ANGLE = 0.2  # radians, between facets of the tessellation
_STL_COUNT, _STL_HEADER = slice(80, 84), 84  # bytes of a binary STL file
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_STEP_S, _STEP_S_PER_BYTE = 120.0, 5e-5  # time limit of a STEP file; 28 kB took 0.1 s
_LARGEST_COORDINATE_MM = 1e12
_WELD_DISTANCE = 1e-6  # over the diagonal: gaps that single precision leaves between neighbouring triangles


def read_surface(path: str | Path, scale: float = 1.0) -> Triangles:
    """Read a closed body from an STL file (its numbers are mm) or a STEP file (its own unit, turned into mm).

    Parameters
    ----------
    scale : factor of every coordinate, for instance 1000 for an STL drawn in metres

    Raises
    ------
    Finger3dError
        If there is no such file, or it does not hold one closed body with triangles that face outward and do not
        intersect.
    """
    path = Path(path)
    if path.suffix.lower() in STEP:
        surface = tessellated(read_solid(path))
    elif path.suffix.lower() in STL:
        surface = _stl(path, scale)
    else:
        raise Finger3dError(f"{path}: must be a file named {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    surface = Triangles(surface.points * scale, surface.faces)
    if reason := mistake(surface):
        raise Finger3dError(f"{path}: the body {reason}")
    if path.suffix.lower() in STL:  # CAD checks its solids itself
        _check_crossings(path, surface)
    return surface


def _check_crossings(path: Path, surface: Triangles) -> None:
    """Raise a Finger3dError if triangles intersect."""
    crossed = crossings(surface)
    if len(crossed):
        place = surface.corners[crossed[0]].mean(axis=0)
        near = f"({place[0]:.4g}, {place[1]:.4g}, {place[2]:.4g}) mm; mend it where it was drawn"
        what = f"the body's surface runs through itself at {len(crossed)} triangles"
        raise Finger3dError(f"{path}: {what}, the first near {near}")


def content(path: Path) -> str:
    """Return the SHA-256 of a file."""
    import hashlib

    return hashlib.sha256(file_bytes(path)).hexdigest()


def _stl(path: Path, scale: float) -> Triangles:
    content = file_bytes(path)
    points = _binary_stl(path, content) if _is_binary(content) else _text_stl(path, content)
    far = np.isfinite(points) & (np.abs(points) * scale > _LARGEST_COORDINATE_MM)
    if far.any():
        most = number(_LARGEST_COORDINATE_MM)
        allowed = f"coordinates must be numbers from -{most} to {most} mm; mend it where it was drawn"
        raise Finger3dError(f"{path}: a point at {points[far].flat[0]:g}: {allowed}")
    return welded(points, np.arange(len(points)).reshape(-1, 3))


def _is_binary(content: bytes) -> bool:
    """Whether an STL file is binary, whose header may begin with "solid", too."""
    count = int.from_bytes(content[_STL_COUNT], "little")
    text = content.lstrip(codecs.BOM_UTF8).lstrip()[:5].lower() == b"solid" and b"\0" not in content[:_STL_HEADER]
    return len(content) == _STL_HEADER + count * _STL_FACET.itemsize or not text


def _binary_stl(path: Path, content: bytes) -> Float:
    """Return the corners (3 m, 3) of m triangles, one triangle after the other."""
    if len(content) < _STL_HEADER:
        raise Finger3dError(
            f"{path}: this is no STL file: it has {len(content)} bytes, and does not begin with 'solid'"
        )
    count = int.from_bytes(content[_STL_COUNT], "little")
    held = (len(content) - _STL_HEADER) // _STL_FACET.itemsize
    if held < count:
        raise Finger3dError(
            f"{path}: the header of this binary STL file announces {count} triangles, and {held} follow: it was cut "
            "off, or is no STL file; copy or export it again"
        )
    _check_triangles(path, count)
    return np.frombuffer(content, _STL_FACET, count, _STL_HEADER)["corners"].reshape(-1, 3).astype(float)


def _text_stl(path: Path, content: bytes) -> Float:
    """Return the corners (3 m, 3) of the triangles of all solids, which together make one body."""
    count, vertices = (len(re.findall(rb"(?im)^\s*" + word, content)) for word in (rb"end\s*facet", rb"vertex\s"))
    if vertices != 3 * count:
        raise Finger3dError(
            f"{path}: this STL text has {count} whole facets and {vertices} vertices, where a facet has three: it was "
            "cut off or damaged; export it again"
        )
    if not re.search(rb"(?im)^\s*end\s*solid[^\n]*\s*\Z", content):
        raise Finger3dError(f"{path}: this STL text does not end with 'endsolid': it was cut off; export it again")
    _check_triangles(path, count)
    words = re.findall(rb"(?im)^\s*vertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[ \t]*\r?$", content)
    try:
        return np.array(words, dtype=bytes).astype(float).reshape(3 * count, 3)
    except ValueError:
        raise Finger3dError(
            f"{path}: a vertex of this STL text is not three numbers, as -1.5 0 2e-3; export it again"
        ) from None


def _check_triangles(path: Path, count: int) -> None:
    if not count:
        raise Finger3dError(f"{path}: this STL file holds no triangles")
    if count > MOST_TRIANGLES:
        raise Finger3dError(
            f"{path}: {count} triangles; must be at most {MOST_TRIANGLES}: triangles much smaller than "
            "mesh.size_mm do not change the mesh; export it coarser, or simplify it"
        )


def welded(points: Float, faces: NDArray[np.int64]) -> Triangles:
    """Merge equal points, and near points along open edges; triangles without area are dropped."""
    _, first, number = np.unique(points, axis=0, return_index=True, return_inverse=True)
    points, faces = points[first], number.reshape(-1)[faces]
    surface = Triangles(points, faces[has_three_corners(faces)])
    unique, count = np.unique(np.sort(surface.edges, axis=1), axis=0, return_counts=True)
    loose = np.unique(unique[count == 1])
    if not len(loose) or not np.isfinite(points).all():
        return surface
    from scipy.spatial import cKDTree

    near = loose[cKDTree(points[loose]).query_pairs(_WELD_DISTANCE * surface.size, output_type="ndarray")]
    number = connected(len(points), *near.T)
    _, first = np.unique(number, return_index=True)
    faces = number[faces]
    return Triangles(points[first], faces[has_three_corners(faces)])


def read_solid(path: Path) -> Solid:
    """Return the only build123d solid of a STEP file, mm.

    Raises
    ------
    Finger3dError
        If this is no STEP file, or does not hold exactly one valid solid.
    """
    solids = read_step(path).solids
    if len(solids) != 1:
        raise Finger3dError(f"{path}: the file has {len(solids)} solids; give one solid body")
    return solids[0]


@dataclass(frozen=True)
class StepBody:
    """Solids of a STEP file, mm.

    Attributes
    ----------
    solids : in the order of the file
    labels : name of each solid, or else of its product; "" for none or one that only says what it is, like SOLID
    faces : by their names in the file, in lower case
    unit : of length in the file; empty if it names none
    """

    solids: tuple[Solid, ...]
    labels: tuple[str, ...]
    faces: Mapping[str, list[Face]]
    unit: str


def read_step(path: Path) -> StepBody:
    """Read the solids of a STEP file and their names, in which blanks, dots and brackets become underscores.

    Raises
    ------
    Finger3dError
        If this is no STEP file, or holds no solid or an invalid one.
    """
    size = len(file_bytes(path))
    require(f"{path}: a STEP file", "build123d")
    from build123d import Compound
    from OCP.BinTools import BinTools
    from OCP.TopoDS import TopoDS_Shape

    from finger3d.geometry import _step

    try:
        read = in_child(_step.read, _STEP_S + _STEP_S_PER_BYTE * size, path=str(path.resolve()))
    except ChildError as error:
        raise Finger3dError(
            f"{path}: OpenCASCADE {error} on this STEP file, which is damaged or too complex; export it again where it "
            "was drawn"
        ) from None
    if read["error"]:
        raise Finger3dError(f"{path}: {read['error']}")
    shape = TopoDS_Shape()
    BinTools.Read_s(shape, io.BytesIO(read["shape"].tobytes()))
    solids = tuple(Compound(shape).solids())
    faces: dict[str, list[Face]] = {}
    for face, name in zip((f for solid in solids for f in solid.faces()), read["faces"].tolist(), strict=True):
        if name:
            faces.setdefault(name.lower(), []).append(face)
    return StepBody(solids, tuple(read["labels"].tolist()), faces, str(read["unit"]))


def tessellated(solid: Solid | Compound) -> Triangles:
    """Return a CAD solid as triangles, within 5e-5 of its diagonal."""
    from finger3d.geometry.tessellate import tessellate

    box = solid.bounding_box()
    body = tessellate(solid, _CHORD_ERROR * box.diagonal, _FACET_ANGLE)
    return Triangles(body.points, body.triangles)
