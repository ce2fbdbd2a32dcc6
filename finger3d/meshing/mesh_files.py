"""Finite element meshes in files of Gmsh (.msh, format 4.1) and VTK (.vtu): tetrahedra, named facets and named parts.

In a .msh file facets and parts are physical surfaces and volumes; of nested volumes the innermost counts.  In a .vtu
file they are the values of the cell data ``label`` at triangles and ``part`` at tetrahedra: texts, or whole numbers k
that stand for the k-th text, counted from 0, of the field data ``label_names`` and ``part_names``; a negative number is
no name.  The names of facets are compared in lower case.  meshio reads the nodes and cells of .msh and turns them into
VTK's order; names are read here.  VTK reads .vtu, whose texts meshio does not know.
"""

from __future__ import annotations

import io
import itertools
import re
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d._ranges import printable
from finger3d._types import Float, Int, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.io import atomic, text_of

MAIN_BODY = "body"
"""Name of the main body, beside cells without a name."""

MSH, VTU = ".msh", ".vtu"
MESH_SUFFIXES = (MSH, VTU)

LABEL, PART = "label", "part"
"""Names of the cell data of a .vtu file; with "_names" those of its field data."""

MSH_VERSION = "4.1"

_TETS = {"tetra": 4, "tetra10": 10}
_TRIANGLES = {"triangle": 3, "triangle6": 6}
_WIDTH = {**_TETS, **_TRIANGLES}
_IGNORED = ("vertex", "line", "line3", "empty")
_VTK = {
    "empty": [0], "vertex": [1], "line": [3, 68], "line3": [21, 68], "triangle": [5, 69], "triangle6": [22, 69],
    "tetra": [10, 71], "tetra10": [24, 71],
}  # fmt: skip
"""Types of VTK by those of meshio; 68 to 71 are Lagrange cells, whose number of nodes tells their degree."""

_DAMAGED = (
    ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError, MemoryError, StopIteration
)  # fmt: skip
_HEAD = 4096  # bytes in which the format of a .msh file is looked for


@dataclass(frozen=True)
class MeshContents:
    """What a mesh file holds.

    Attributes
    ----------
    points : (n, 3) as in the file
    cells : (e, 4 | 10) nodes of the tetrahedra in VTK's order
    triangles : (m, 3) corners of the named triangles
    label : (m,) name of each of them, lower case
    part : (e,) name of the part of each tetrahedron; empty without one
    """

    points: Float
    cells: Int
    triangles: Int
    label: NDArray[np.str_]
    part: NDArray[np.str_]

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class _Block:
    """Cells of one type: their nodes (k, nodes), and their names (k,)."""

    kind: str
    nodes: Int
    names: NDArray[np.str_]


def read_contents(path: Path) -> MeshContents:
    """Read a mesh file.

    Raises
    ------
    Finger3dError
        If there is no such file, it is not in its format, or it holds other cells than tetrahedra of one order.
    """
    if not path.is_file():
        raise Finger3dError(f"{path}: there is no such file")
    points, blocks = _msh(path) if path.suffix.lower() == MSH else _vtu(path)
    tets, triangles = (_of_kind(blocks, kinds) for kinds in (_TETS, _TRIANGLES))
    _check_kinds(path, blocks)
    if not tets:
        hint = "; Gmsh saves what is in a physical group: make one of the volume" if path.suffix.lower() == MSH else ""
        raise Finger3dError(f"{path}: holds no tetrahedra{hint}")
    named = [b.nodes[b.names != ""][:, :3] for b in triangles]
    labels = [np.char.lower(np.char.strip(b.names[b.names != ""])) for b in triangles]
    contents = MeshContents(
        points=points,
        cells=np.concatenate([b.nodes for b in tets]),
        triangles=np.concatenate([*named, np.zeros((0, 3), dtype=np.int64)]),
        label=np.concatenate([*labels, np.zeros(0, dtype=str)]),
        part=np.concatenate([b.names for b in tets]),
    )
    _check_arrays(path, contents)
    return contents


def _of_kind(blocks: Iterable[_Block], kinds: Iterable[str]) -> list[_Block]:
    return [b for b in blocks if b.kind in kinds and len(b.nodes)]


def _check_kinds(path: Path, blocks: Iterable[_Block]) -> None:
    """Refuse cells of other types, and tetrahedra of both orders."""
    count: dict[str, int] = {}
    for block in blocks:
        if len(block.nodes):
            count[block.kind] = count.get(block.kind, 0) + len(block.nodes)
    others = [f"{n} of type {kind}" for kind, n in count.items() if kind not in (*_TETS, *_TRIANGLES, *_IGNORED)]
    if others:
        raise Finger3dError(
            f"{path}: holds cells of other types than tetrahedra: {', '.join(others)}; mesh the body with tetrahedra"
        )
    orders = [f"{count[kind]} of {nodes} nodes" for kind, nodes in _TETS.items() if kind in count]
    if len(orders) > 1:
        raise Finger3dError(
            f"{path}: holds linear and quadratic tetrahedra, {' and '.join(orders)}; save all with one order"
        )


def _check_arrays(path: Path, contents: MeshContents) -> None:
    """Refuse coordinates that are no numbers, and nodes that do not exist."""
    nodes = np.concatenate([contents.cells.ravel(), contents.triangles.ravel()])
    if len(nodes) and not 0 <= nodes.min() <= nodes.max() < len(contents.points):
        raise Finger3dError(f"{path}: a cell names a node that does not exist; save the mesh again")
    used = contents.points[np.unique(contents.cells)]
    if not np.isfinite(used).all():
        raise Finger3dError(f"{path}: a coordinate is no finite number; save the mesh again")


# --- Gmsh ---------------------------------------------------------------------------------------------------------


def _msh(path: Path) -> tuple[Float, list[_Block]]:
    is_binary, word = _msh_header(path)
    content = path.read_bytes()
    if b"\n$PartitionedEntities" in content:
        raise Finger3dError(f"{path}: this mesh is partitioned; save it undivided")
    # meshio loses names of reversed surfaces and those of two dimensions, and cannot read files with unnamed cells.
    content, names = _without(content, b"PhysicalNames")
    content, entities = _without(content, b"Entities")
    import meshio

    try:
        names_of = _names_of_entities(path, names, entities, is_binary, word)
        with tempfile.TemporaryDirectory(prefix="finger3d_") as folder:
            (Path(folder) / "nameless.msh").write_bytes(content)
            mesh = meshio.gmsh.read(Path(folder) / "nameless.msh")
        entity = [int(tags[0]) if len(tags) else 0 for tags in mesh.cell_data["gmsh:geometrical"]]
    except (meshio.ReadError, *_DAMAGED) as error:
        if "parametric" in str(error):
            raise Finger3dError(f"{path}: its nodes are parametric; save it with Mesh.SaveParametric = 0") from None
        raise Finger3dError(f"{path}: this Gmsh file is damaged or incomplete; save it again") from None
    blocks = [
        _Block(b.type, np.asarray(b.data, dtype=np.int64), np.full(len(b.data), name))
        for b, tag in zip(mesh.cells, entity, strict=True)
        for name in names_of.get((b.dim, tag), [""])
    ]
    return np.asarray(mesh.points, dtype=float), blocks


def _without(content: bytes, section: bytes) -> tuple[bytes, bytes]:
    """Return a file without a section, and what is between the lines that begin and end it."""
    first, last = b"$" + section, b"$End" + section
    before, separator, rest = content.partition(first)
    if not separator:
        return content, b""
    inside, _, after = rest.partition(last)
    return before + after.lstrip(), inside[inside.index(b"\n") + 1 :]


def _names_of_entities(
    path: Path, names: bytes, entities: bytes, is_binary: bool, word: int
) -> dict[tuple[int, int], list[str]]:
    """Return the names of the physical groups of each named entity (dimension, tag); of a volume the innermost."""
    lines = re.findall(r'^[ \t]*(\d+)[ \t]+(\d+)[ \t]+"(.*)"', text_of(names), re.MULTILINE)
    name_of = {(int(dim), int(group)): name for dim, group, name in lines}
    groups = _groups(entities, is_binary, word) if entities else {}
    found = {
        (dim, tag): [name_of[dim, number] for number in numbers if (dim, number) in name_of]
        for (dim, tag), numbers in groups.items()
    }
    volumes = {tag: names for (dim, tag), names in found.items() if dim == 3}
    members = {name: {tag for tag in volumes if name in volumes[tag]} for names in volumes.values() for name in names}
    inner = {name for name in members if len(members[name]) < len(volumes)}
    for tag, own in volumes.items():
        nested = sorted((name for name in own if name in inner), key=lambda name: len(members[name]))
        if apart := next((two for two in itertools.pairwise(nested) if not members[two[0]] < members[two[1]]), None):
            raise Finger3dError(f"{path}: a volume is named both '{apart[0]}' and '{apart[1]}'; give it one name")
        found[3, tag] = nested[:1] if inner else sorted(own)[:1]
    return {entity: names for entity, names in found.items() if names}


def _groups(entities: bytes, is_binary: bool, word: int) -> dict[tuple[int, int], list[int]]:
    """Return the physical groups of each entity (dimension, tag), without the sign, which tells the orientation."""
    stream = io.BytesIO(entities)
    words = iter(entities.split() if not is_binary else [])

    def take(kind: str, count: int) -> list[int]:
        if not is_binary:
            return [int(float(next(words))) for _ in range(count)]
        values = np.frombuffer(stream.read(count * np.dtype(kind).itemsize), kind, count)
        return [int(value) for value in values.tolist()]

    size = f"<u{word}"
    groups = {}
    for dim, count in enumerate(take(size, 4)):
        for _ in range(count):
            (tag,) = take("<i4", 1)
            take("<f8", 3 if dim == 0 else 6)  # its box
            groups[dim, tag] = [abs(group) for group in take("<i4", *take(size, 1))]
            if dim > 0:
                take("<i4", *take(size, 1))  # its boundary
    return groups


def _msh_header(path: Path) -> tuple[bool, int]:
    """Return whether a file is binary, and the bytes of its large integers; refuse one of another format or version."""
    with path.open("rb") as file:
        lines = file.read(_HEAD).split(b"\n")
    stripped = [line.strip() for line in lines]
    if b"$MeshFormat" not in stripped[:-1]:
        raise Finger3dError(f"{path}: this is no file of Gmsh; it has no $MeshFormat")
    words = stripped[stripped.index(b"$MeshFormat") + 1].decode("ascii", errors="replace").split()
    version = words[0] if words else ""
    if version != MSH_VERSION:
        raise Finger3dError(
            f"{path}: Gmsh's format {printable(version)} is not read; save it as {MSH_VERSION}: gmsh -format msh41"
        )
    return words[1:2] == ["1"], 4 if words[2:3] == ["4"] else 8


# --- VTK ----------------------------------------------------------------------------------------------------------


def _vtu(path: Path) -> tuple[Float, list[_Block]]:
    with _silent_vtk():
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(path))
        errors: list[str] = []
        reader.AddObserver("ErrorEvent", lambda *_: errors.append("error"))
        readable = bool(reader.CanReadFile(str(path)))
        if readable:
            reader.Update()
    if not readable or errors or not reader.GetOutput().GetNumberOfCells():
        raise Finger3dError(f"{path}: this is no unstructured grid of VTK, or a damaged or empty one; save it again")
    import pyvista

    grid = pyvista.wrap(reader.GetOutput())
    offset = np.asarray(pyvista.convert_array(grid.GetCells().GetOffsetsArray()), dtype=np.int64)
    nodes = np.asarray(grid.cell_connectivity, dtype=np.int64)
    label, part = (_names(path, grid, key, grid.n_cells) for key in (LABEL, PART))
    blocks, forms = [], np.column_stack([grid.celltypes, np.diff(offset)])
    for number, width in np.unique(forms, axis=0).tolist():
        fitting = (kind for kind, numbers in _VTK.items() if number in numbers and width == _WIDTH.get(kind, width))
        kind = next(fitting, f"{number} of VTK with {width} nodes")
        cells = np.flatnonzero((forms == [number, width]).all(axis=1))
        names = part if kind in _TETS else label
        blocks.append(_Block(kind, nodes[offset[cells][:, None] + np.arange(width)], names[cells]))
    return np.asarray(grid.points, dtype=float), blocks


@contextmanager
def _silent_vtk() -> Iterator[None]:
    """Keep VTK from printing messages to the terminal."""
    from vtkmodules.vtkCommonCore import vtkObject

    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        yield
    finally:
        vtkObject.SetGlobalWarningDisplay(shown)


def _names(path: Path, grid: Any, key: str, count: int) -> NDArray[np.str_]:
    """Return the name (count,) of every cell from its cell data, empty without one."""
    array = grid.GetCellData().GetAbstractArray(key)
    if array is None:
        return np.full(count, "")
    if not array.IsNumeric():
        return _texts(array)
    values = np.asarray(grid.cell_data[key])
    where = f"{path}: cell data '{key}'"
    names = f"{key}_names"
    known = grid.GetFieldData().GetAbstractArray(names)
    if values.ndim != 1 or values.dtype.kind not in "iuf" or (values != np.round(values)).any():
        raise Finger3dError(f"{where} must hold a text or a whole number for each cell")
    if known is None:
        raise Finger3dError(
            f"{where} holds numbers, and there is no field data '{names}' with the names they stand for"
        )
    labels = _texts(known)
    number = values.astype(np.int64)
    if number.max(initial=-1) >= len(labels):
        raise Finger3dError(
            f"{where} has the number {number.max()}, and '{names}' has {len(labels)} names, counted from 0"
        )
    return np.append(labels, "")[np.where(number < 0, len(labels), number)]


def _texts(array: Any) -> NDArray[np.str_]:
    """Return the values (n,) of an array of VTK as texts; VTK gives bytes for what is no UTF-8."""
    values = map(array.GetValue, range(array.GetNumberOfValues()))
    return np.array([text_of(value) if isinstance(value, bytes) else str(value) for value in values])


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
