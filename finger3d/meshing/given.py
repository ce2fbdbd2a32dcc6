"""A finger that is given as a mesh of tetrahedra: its checks, its place, its surface and its edge lengths."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._ranges import four_digits
from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import EDGES, FACETS, Mesh, boundary, curved_jacobians, curved_volume, quadratic, signed_volumes
from finger3d.geometry.files import content, welded
from finger3d.geometry.imported import FileDesign, check_size
from finger3d.geometry.surface import Triangles, connected
from finger3d.meshing.bisection import TOO_LONG, refined
from finger3d.meshing.limits import MeshReport, check_count, mesh_report
from finger3d.meshing.mesh_files import MAIN_BODY, MeshContents, read_contents
from finger3d.meshing.sizing import RATE, MeshOptions, SizedPlaces, Zone

if TYPE_CHECKING:
    from build123d import Solid


NEEDED = ("contact", "base")
"""Facets that a file must name."""

_KEPT = ("contact", "base", "walls", "ends")  # names of facets with a meaning; others are walls
_UNIT = "was it meshed in another unit? Its numbers are read as mm; give its scale in [finger], such as 1000 for metres"
_CUTS = ("symmetry_x", "symmetry_z")
_LEVEL = 1e-6  # largest distance of the base from its plane, over the size
_STRAIGHT = 1e-9  # largest distance of a node from the middle of its edge on a straight facet, over the size
_PIECES = 4  # straight pieces of the edge of a curved facet: their sagitta is a sixteenth of that of one
_SAME = 1e-3  # relative difference of edge lengths that are the same; scenes keep four digits


@dataclass(frozen=True, eq=False)
class GivenMesh(FileDesign):
    """A finger in a mesh file, moved so that the middle of its base is the origin.

    Attributes
    ----------
    path : the file
    content : SHA-256 of the file
    scale : factor of the coordinates in the file
    mesh : quadratic, facets labelled contact, base, walls and ends, cells with their part; mm
    surface : its boundary, a curved facet as sixteen triangles
    """

    path: str
    content: str
    scale: float
    mesh: Mesh = field(repr=False)
    surface: Triangles = field(repr=False)

    @property
    def part_labels(self) -> tuple[str, ...]:
        """See :attr:`Design.part_labels`."""
        return self.mesh.part_labels

    @property
    def cache_fields(self) -> Mapping[str, object]:
        """Content of the file and its scale; the file's name does not matter."""
        return {"design": "mesh", "dimensions": {"content": self.content, "scale": repr(self.scale)}}

    @cached_property
    def volume_mm3(self) -> float:
        """Volume of the curved cells."""
        return curved_volume(self.mesh)

    def solid(self) -> Solid:
        """Raise a Finger3dError: there is no CAD."""
        raise Finger3dError(f"{self.name}: a mesh of tetrahedra has no CAD solid; give the finger as a STEP file")

    @cached_property
    def size_mm(self) -> float:
        """Mean edge length of the contact facets, mm, four digits."""
        return four_digits(_mean_edge(self.mesh.points, self.mesh.facets["contact"]))

    @cached_property
    def base_size_mm(self) -> float:
        """Mean edge length of all cells, mm, four digits; at least that of the contact facets."""
        return max(four_digits(_mean_edge(self.mesh.points, self.mesh.cells)), self.size_mm)


def given_mesh(path: str | Path, scale: float = 1.0) -> GivenMesh:
    """Read a finger from a .msh or .vtu file, check it, and move the middle of its base to the origin.

    Parameters
    ----------
    scale : factor of the coordinates in the file, to be mm

    Raises
    ------
    Finger3dError
        If the file cannot be read, facets have no name, cells are inverted, the body is not connected, or the base is
        no level plane with the body above it.
    """
    path = Path(path)
    contents = read_contents(path)
    mesh = _labelled(path, replace(contents, points=scale * contents.points))
    _check_cells(path, mesh)
    _check_connected(path, mesh)
    mesh = _on_its_base(path, mesh)
    return GivenMesh(str(path), content(path), scale, mesh, _surface(mesh))


def mesh_given(design: GivenMesh, options: MeshOptions, zone: Zone) -> tuple[Mesh, MeshReport]:
    """Return the given mesh as it is, or with its cells halved where shorter edges are asked for.

    With `size_mm` below the measured edge length at the contact, cells are halved there, and less with the distance;
    with `base_size_mm` below the measured one, everywhere.

    Raises
    ------
    Finger3dError
        If longer edges are asked for, or the mesh is estimated to need too much memory.
    """
    finer, everywhere = options.size_mm / design.size_mm, options.base_size_mm / design.base_size_mm
    if max(finer, everywhere) > 1.0 + _SAME:
        raise Finger3dError(f"the mesh {design.name} has edges of {design.size_mm:g} mm, and is not made coarser")
    mesh = design.mesh
    if min(finer, everywhere) < 1.0 - _SAME:
        wanted = _wanted(design, zone, min(finer, 1.0), min(everywhere, 1.0))
        mesh = refined(mesh, wanted, lambda cells: check_count(cells, 3, options))
    return mesh, mesh_report(mesh, 1.0, design.volume_mm3, {"cad": 0.0, "mesh": 0.0})


def _wanted(design: GivenMesh, zone: Zone, finer: float, everywhere: float) -> Callable[[Float], Float]:
    """Return the wanted edge length (n,) at points (n, 3): that of the mesh times `finer` in the zone."""
    from scipy.spatial import cKDTree

    mesh, facets = design.mesh, design.mesh.facets["contact"][:, :3]
    corners = mesh.points[mesh.cells[:, :4]]
    longest = np.linalg.norm(corners[:, EDGES[3][:, 0]] - corners[:, EDGES[3][:, 1]], axis=2).max(axis=1) / TOO_LONG
    centroids = cKDTree(corners.mean(axis=1))
    middle = mesh.points[facets].mean(axis=1)
    x0, x1, z0, z1 = zone
    inside = (middle[:, 0] >= x0) & (middle[:, 0] <= x1) & (middle[:, 2] >= z0) & (middle[:, 2] <= z1)
    touched = SizedPlaces(mesh.points[np.unique(facets[inside] if inside.any() else facets)], 0.0, RATE)

    def wanted(points: Float) -> Float:
        own = longest[centroids.query(points)[1]]
        return np.asarray(np.minimum(everywhere * own, finer * own + touched.at(points)))

    return wanted


def _mean_edge(points: Float, simplices: Int) -> float:
    """Return the mean length (mm) of the edges of tetrahedra (m, 10) or facets (m, 6)."""
    dim = 3 if simplices.shape[1] == 10 else 2
    ends = np.unique(np.sort(simplices[:, EDGES[dim]].reshape(-1, 2), axis=1), axis=0)
    return float(np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1).mean())


# --- from the file ------------------------------------------------------------------------------------------------


def _labelled(path: Path, contents: MeshContents) -> Mesh:
    """Return the quadratic mesh with its boundary facets by label, and its parts; nodes of no cell are left out."""
    missing = [name for name in NEEDED if name not in contents.label]
    if missing:
        names = ", ".join(f"'{name}'" for name in np.unique(contents.label)) or "none"
        how = "physical surface" if path.suffix.lower() == ".msh" else "value of the cell data 'label'"
        raise Finger3dError(
            f"{path}: no facets are named '{missing[0]}' (a {how}); named are: {names}; name the facets of the fixed "
            "base 'base' and the facets that may touch first 'contact'"
        )
    if cuts := [name for name in _CUTS if name in contents.label]:
        raise Finger3dError(
            f"{path}: facets are named '{cuts[0]}', but symmetry is not used with a mesh; give the whole finger"
        )
    corners = contents.cells[:, :4]
    used, cells = np.unique(corners, return_inverse=True)
    cells = cells.reshape(corners.shape)
    numbers = np.full(len(contents.points), -1)
    numbers[used] = np.arange(len(used))
    facets = boundary(cells, 3)
    named, key = (np.sort(triangles, axis=1) for triangles in (numbers[contents.triangles], facets))
    label = _labels(path, contents, named, key)
    labelled = {name: facets[label == name] for name in _KEPT}
    part, part_labels = _parts(contents)
    mesh = quadratic(Mesh(contents.points[used], cells, labelled, part, part_labels))
    if contents.cells.shape[1] == 4:
        return mesh
    points = mesh.points.copy()
    points[mesh.cells[:, 4:]] = contents.points[contents.cells[:, 4:]]  # the middles of curved edges
    if (points[mesh.cells[:, 4:]] != contents.points[contents.cells[:, 4:]]).any():
        raise Finger3dError(f"{path}: the middle node of an edge differs between its tetrahedra; merge nodes")
    return replace(mesh, points=points)


def _labels(path: Path, contents: MeshContents, named: Int, boundary: Int) -> np.ndarray[tuple[int], np.dtype[np.str_]]:
    """Return the label (m,) of every boundary facet; one without a name, or with one of no meaning, is a wall."""
    number = {tuple(corners): k for k, corners in enumerate(boundary.tolist())}
    label = np.full(len(boundary), "walls", dtype="U8")
    taken: dict[int, str] = {}
    for k, name in zip(range(len(named)), contents.label.tolist(), strict=True):
        if name not in _KEPT:
            continue
        facet = number.get(tuple(named[k].tolist()))
        if facet is None:
            raise Finger3dError(
                f"{path}: facet {k + 1} of those with a name, '{name}', lies on no outer face of a tetrahedron; name "
                "facets of the surface, and merge nodes at the same place"
            )
        if taken.setdefault(facet, name) != name:
            raise Finger3dError(f"{path}: a facet is named both '{taken[facet]}' and '{name}'; give it one name")
        label[facet] = name
    return label


def _parts(contents: MeshContents) -> tuple[Int | None, tuple[str, ...]]:
    """Return the number (e,) of the part of every cell, and the labels of parts 1, 2, ...

    Cells without a name or named "body" are the main body, and all cells if they have one name.
    """
    names, first = np.unique(contents.part, return_index=True)
    main = {"", MAIN_BODY} if len(names) > 1 else set(names.tolist())
    labels = [str(names[k]) for k in np.argsort(first) if names[k] not in main]
    if not labels:
        return None, ()
    number = {name: k for k, name in enumerate(labels, start=1)}
    return np.array([number.get(name, 0) for name in contents.part.tolist()]), tuple(labels)


def _check_cells(path: Path, mesh: Mesh) -> None:
    """Refuse inverted cells: by the volume of the straight ones, and by the Jacobian of the curved ones."""
    for what, determinants in {"flat or inverted": signed_volumes(mesh), "folded": curved_jacobians(mesh)}.items():
        bad = np.flatnonzero(~(determinants > 0.0))
        if len(bad):
            place = mesh.points[mesh.cells[bad[0], :4]].mean(axis=0)
            raise Finger3dError(
                f"{path}: {len(bad)} of {len(mesh.cells)} tetrahedra are {what}, the first is number {bad[0] + 1}, "
                f"near ({place[0]:.4g}, {place[1]:.4g}, {place[2]:.4g}); mend the mesh where it was made"
            )


def _check_connected(path: Path, mesh: Mesh) -> None:
    """Refuse bodies that share no facets."""
    corners = np.sort(mesh.cells[:, FACETS[3]].reshape(-1, 3), axis=1)
    _, number = np.unique(corners, axis=0, return_inverse=True)
    count = len(mesh.cells)
    cell, face = np.repeat(np.arange(count), 4), count + number.reshape(-1)
    bodies = int(connected(int(face.max()) + 1, cell, face).max()) + 1
    if bodies > 1:
        raise Finger3dError(
            f"{path}: the tetrahedra are {bodies} bodies that share no facets; mesh them as one, with common nodes "
            "where they meet (in Gmsh: fragment the volumes)"
        )


def _on_its_base(path: Path, mesh: Mesh) -> Mesh:
    """Return the mesh with the middle of its base at the origin; refuse a base that is not the lowest plane."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    check_size(path, high - low, _UNIT)
    nodes = np.unique(mesh.facets["base"])
    level = mesh.points[nodes, 1]
    y0, y1 = float(level.min()), float(level.max())
    if y1 - y0 > _LEVEL * size:
        raise Finger3dError(
            f"{path}: the facets named 'base' are no level plane, but reach from y = {y0:.6g} to {y1:.6g} mm; turn "
            "the mesh so that y is up, and name only its plane base so"
        )
    if low[1] < y0 - _LEVEL * size:
        raise Finger3dError(
            f"{path}: the body reaches {y0 - low[1]:.4g} mm below the facets named 'base'; the base must be its lowest "
            "plane, turn the mesh so that y is up"
        )
    at = mesh.points[nodes]
    middle = 0.5 * (at.min(axis=0) + at.max(axis=0))
    middle = np.where(np.abs(middle) <= _LEVEL * size, 0.0, middle)  # a mesh that is in place keeps its numbers
    points = mesh.points - middle
    points[nodes, 1] = 0.0
    return replace(mesh, points=points)


def _surface(mesh: Mesh) -> Triangles:
    """Return the boundary as triangles: the facets, or sixteen pieces of each if any is curved."""
    facets = np.concatenate([f for f in mesh.facets.values() if len(f)])
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    middles = mesh.points[facets[:, EDGES[2]]].mean(axis=2)
    if np.abs(mesh.points[facets[:, 3:]] - middles).max() <= _STRAIGHT * size:
        return Triangles(mesh.points, facets[:, :3])
    n = _PIECES
    grid = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    number = {at: k for k, at in enumerate(grid)}
    bary = np.array([[n - i - j, i, j] for i, j in grid]) / n
    up = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in grid if i + j < n]
    down = [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in grid if i + j < n - 1]
    points = np.einsum("qk,mkd->mqd", mesh.facet_element.shape(bary), mesh.points[facets])
    faces = (np.arange(len(facets)) * len(grid))[:, None, None] + np.array(up + down)
    return welded(points.reshape(-1, 3), faces.reshape(-1, 3))  # neighbours agree but for round-off
