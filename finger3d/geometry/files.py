"""Bodies from STL and STEP files as closed triangles; a defect raises an error of one line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._extras import require
from finger3d._ranges import number
from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake

if TYPE_CHECKING:
    from build123d import Compound, Face, Shape, Solid
    from OCP.STEPControl import STEPControl_Reader


STL, STEP = (".stl",), (".step", ".stp")
SUFFIXES = (*STL, *STEP)

MOST_TRIANGLES = 300_000
"""Largest number of triangles of an STL file; the checks take about 25 us a triangle."""

_NO_LABEL = re.compile(r"|COMPOUND|COMPSOLID|SOLID|SHELL|NONE|unnamed|Open_CASCADE.*|=>.*", re.IGNORECASE)
"""Names that CAD programs give to solids without a name."""

_CHORD_ERROR = 5e-5  # of the tessellation of a CAD solid, over its diagonal
_FACET_ANGLE = 0.2  # radians, between facets of the tessellation
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
        If there is no such file, or it does not hold one closed body with triangles facing outward.
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
    return surface


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None


def content(path: Path) -> str:
    """Return the SHA-256 of a file."""
    import hashlib

    return hashlib.sha256(_bytes(path)).hexdigest()


def _stl(path: Path, scale: float) -> Triangles:
    import io

    import trimesh

    try:
        mesh = trimesh.load(io.BytesIO(_bytes(path)), file_type="stl", process=False)
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, OverflowError, MemoryError):
        mesh = None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise Finger3dError(f"{path}: this is no STL mesh, or an empty one")
    if len(mesh.faces) > MOST_TRIANGLES:
        raise Finger3dError(
            f"{path}: {len(mesh.faces)} triangles; must be at most {MOST_TRIANGLES}: triangles much smaller than "
            "mesh.size_mm do not change the mesh; export it coarser, or simplify it"
        )
    points = np.asarray(mesh.vertices, dtype=float)
    far = np.isfinite(points) & (np.abs(points) * scale > _LARGEST_COORDINATE_MM)
    if far.any():
        raise Finger3dError(
            f"{path}: a point at {points[far].flat[0]:g}: coordinates must be numbers from "
            f"-{number(_LARGEST_COORDINATE_MM)} to {number(_LARGEST_COORDINATE_MM)} mm; mend it where it was drawn"
        )
    return welded(points, np.asarray(mesh.faces, dtype=np.int64))


def welded(points: Float, faces: NDArray[np.int64]) -> Triangles:
    """Merge equal points, and near points along open edges; triangles without area are dropped."""
    _, first, number = np.unique(points, axis=0, return_index=True, return_inverse=True)
    points, faces = points[first], number.reshape(-1)[faces]
    surface = Triangles(points, _proper(faces))
    edges = np.sort(surface.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    loose = np.unique(unique[count == 1])
    if not len(loose) or not np.isfinite(points).all():
        return surface
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    near = loose[cKDTree(points[loose]).query_pairs(_WELD_DISTANCE * surface.size, output_type="ndarray")]
    joined = coo_matrix((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(points), len(points)))
    _, number = connected_components(joined, directed=False)
    _, first = np.unique(number, return_index=True)
    return Triangles(points[first], _proper(number[faces].astype(np.int64)))


def _proper(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    a, b, c = faces.T
    value: NDArray[np.int64] = faces[(a != b) & (b != c) & (c != a)]
    return value


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
    """

    solids: tuple[Solid, ...]
    labels: tuple[str, ...]
    faces: Mapping[str, list[Face]]


def read_step(path: Path) -> StepBody:
    """Read the solids of a STEP file and their names, in which blanks, dots and brackets become underscores.

    Raises
    ------
    Finger3dError
        If this is no STEP file, or holds no solid or an invalid one.
    """
    _bytes(path)
    require(f"{path}: a STEP file", "build123d")
    from build123d import Compound
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Message import Message, Message_PrinterOStream
    from OCP.Standard import Standard_Failure
    from OCP.STEPControl import STEPControl_Reader

    # OCCT prints messages to the terminal directly.
    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    reader = STEPControl_Reader()
    try:
        done = reader.ReadFile(str(path)) == IFSelect_RetDone and reader.TransferRoots() > 0
        shape = reader.OneShape() if done else None
    except Standard_Failure:
        shape = None
    if shape is None or shape.IsNull():
        raise Finger3dError(f"{path}: this is no STEP file that can be read")
    solids = tuple(Compound(shape).solids())
    if not solids:
        raise Finger3dError(f"{path}: the file has no solid, only faces or curves; give a solid body")
    if not all(solid.is_valid for solid in solids):
        raise Finger3dError(f"{path}: CAD calls its solid invalid; mend it where it was drawn")
    faces: dict[str, list[Face]] = {}
    for face in (face for solid in solids for face in solid.faces()):
        if name := _entity_name(face, reader):
            faces.setdefault(name.lower(), []).append(face)
    labels = [_label(_entity_name(solid, reader)) for solid in solids]
    if len(solids) > 1 and not all(labels):
        labels = [own or product for own, product in zip(labels, _product_names(path, solids), strict=True)]
    return StepBody(solids, tuple(labels), faces)


def _entity_name(shape: Shape, reader: STEPControl_Reader) -> str:
    """Return the name of the ADVANCED_FACE or MANIFOLD_SOLID_BREP that a shape was read from."""
    from OCP.StepRepr import StepRepr_RepresentationItem
    from OCP.TopLoc import TopLoc_Location

    drawn = shape.wrapped.Located(TopLoc_Location())  # the entity has no location of an assembly
    entity = reader.WS().TransferReader().EntityFromShapeResult(drawn, 1)
    named = isinstance(entity, StepRepr_RepresentationItem) and entity.Name() is not None
    return str(entity.Name().ToCString()).strip() if named else ""


def _product_names(path: Path, solids: tuple[Solid, ...]) -> list[str]:
    """Return the label of the product that each solid belongs to."""
    from build123d import import_step

    known = []
    waiting = [*import_step(str(path)).children]
    while waiting:
        shape = waiting.pop()
        waiting += shape.children
        if not shape.children:
            known += [(solid, _label(shape.label)) for solid in shape.solids()]
    if not known:
        return [""] * len(solids)
    nearest = [min(known, key=lambda item: (item[0].center() - solid.center()).length) for solid in solids]
    return [label for _, label in nearest]


def _label(name: str) -> str:
    """Return the label that a name in a STEP file stands for."""
    label = name.translate(str.maketrans(" .()[]", "______"))
    return "" if _NO_LABEL.fullmatch(label) else label


def tessellated(solid: Solid | Compound) -> Triangles:
    """Return a CAD solid as triangles, within 5e-5 of its diagonal."""
    from finger3d.geometry.tessellate import tessellate

    box = solid.bounding_box()
    body = tessellate(solid, _CHORD_ERROR * box.diagonal, _FACET_ANGLE)
    return Triangles(body.points, body.triangles)
