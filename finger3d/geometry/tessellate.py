"""CAD solids -> closed triangles with an absolute tolerance, and the CAD face under every triangle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.geometry.cad import labelled_faces
from finger3d.geometry.implicit import ImplicitSurface, surface_of
from finger3d.geometry.parts import OUTSIDE, Glued, GluedFace
from finger3d.geometry.surface import Triangles

if TYPE_CHECKING:
    from build123d import Compound, Face, Shape, Solid


_WELD = 1e-7  # mm


@dataclass(frozen=True)
class CadFace:
    """Face of a solid: its label, its surface, the box (mm) around it, and +1 if the surface's normal points outward.

    `inside` and `outside` are the numbers of the parts on its sides; a face between two parts has no label, and "out"
    is away from the part `inside`.
    """

    label: str
    surface: ImplicitSurface
    low: Float
    high: Float
    sign: float
    inside: int = 0
    outside: int = OUTSIDE


@dataclass(frozen=True)
class Tessellation:
    """A solid, or several solids that share faces, as closed triangles.

    Attributes
    ----------
    points : (n, 3) mm
    triangles : (m, 3) outward from the part inside their face
    face : (m,) number of the CAD face in `faces`
    corners : (k, 3) mm where three faces or more and three of their edges meet, and `corner_faces`, their numbers
    part_labels : labels of parts 1, 2, ..., for a body of several parts
    """

    points: Float
    triangles: Int
    face: Int
    faces: tuple[CadFace, ...]
    corners: Float
    corner_faces: tuple[tuple[int, ...], ...]
    part_labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def labels(self) -> list[str]:
        """Label of every triangle."""
        return [self.faces[i].label for i in self.face]

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume."""
        return Triangles(self.points, self.surface).volume

    @property
    def surface(self) -> Int:
        """Triangles (k, 3) of the surface, without those between parts."""
        free = np.array([f.outside == OUTSIDE for f in self.faces])
        return np.asarray(self.triangles[free[self.face]])

    def part(self, number: int) -> Triangles:
        """Return the closed surface of a part."""
        inside, outside = (
            np.array([getattr(f, side) for f in self.faces])[self.face] for side in ("inside", "outside")
        )
        outward, other = self.triangles[inside == number], self.triangles[outside == number]
        return Triangles(self.points, np.vstack([outward, other[:, ::-1]]))


def tessellate(
    solid: Solid | Compound,
    tolerance_mm: float,
    angle: float = 0.5,
    exact: tuple[float, ...] = (0.0,),
) -> Tessellation:
    """Tessellate a build123d solid within `tolerance_mm` (absolute) and `angle` radians between facets.

    build123d's own `tessellate` and `export_stl` take a relative tolerance and reuse what was tessellated before.
    `exact` lists numbers (mm) that a plane's constant coordinate may stand for to the last bit.
    """
    faces = tuple(GluedFace(face, 0, OUTSIDE) for face in labelled_faces(solid))
    body = Glued(solid, ("",), (), faces)
    return tessellate_parts(body, tolerance_mm, angle, exact, voids_of(solid, tolerance_mm))


def tessellate_parts(
    body: Glued,
    tolerance_mm: float,
    angle: float = 0.5,
    exact: tuple[float, ...] = (0.0,),
    voids: Triangles | None = None,
) -> Tessellation:
    """Tessellate glued solids like :func:`tessellate`; faces between them have their triangles once.

    `voids` are the inner surfaces of the whole body, for a part of it on one side of a plane of symmetry, which may cut
    them open.
    """
    points, triangles, face = triangulated(body.shape, [f.face for f in body.faces], tolerance_mm, angle)
    cad_faces = []
    for i, f in enumerate(body.faces):
        cad_face = _cad_face(f.face, points, triangles[face == i], surface_of(f.face, exact))
        label = cad_face.label if f.outside == OUTSIDE else ""
        if label and voids is not None and len(voids.faces):
            middle = points[triangles[face == i][:1]].mean(axis=1)
            label = "cavity" if np.linalg.norm(voids.closest(middle)[0] - middle) < 4.0 * tolerance_mm else label
        cad_faces.append(replace(cad_face, label=label, inside=f.inside, outside=f.outside))
    touching = np.unique(np.stack([triangles.ravel(), np.repeat(face, 3)], axis=1), axis=0)
    several = np.bincount(touching[:, 0], minlength=len(points)) >= 3
    many = np.flatnonzero(several & (_seams_at_points(triangles, face, len(points)) >= 3))
    sets = tuple(tuple(int(i) for i in touching[touching[:, 0] == v, 1]) for v in many)
    return Tessellation(points, triangles, face, tuple(cad_faces), points[many], sets, body.labels[1:])


def voids_of(solid: Solid | Compound, tolerance_mm: float) -> Triangles:
    """Return the triangles of the closed inner surfaces of a solid; none for a solid that is not hollow."""
    from OCP.BRepClass3d import BRepClass3d

    inner = [
        shell
        for one in solid.solids()
        for shell in one.shells()
        if not shell.wrapped.IsSame(BRepClass3d.OuterShell_s(one.wrapped))
    ]
    if not inner:
        return Triangles(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    faces = [face for shell in inner for face in shell.faces()]
    points, triangles, _ = triangulated(solid, faces, tolerance_mm, 0.5)
    return Triangles(points, triangles)


def _seams_at_points(triangles: Int, face: Int, count: int) -> Int:
    """Number (n,) of edges at every point that lie between different faces."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(face, 3)
    order = np.lexsort([owner, edges[:, 1], edges[:, 0]])
    edges, owner = edges[order], owner[order]
    between = (edges[1:] == edges[:-1]).all(axis=1) & (owner[1:] != owner[:-1])
    seams = np.unique(edges[1:][between], axis=0)
    return np.bincount(seams.ravel(), minlength=count)


def triangulated(solid: Shape, faces: list[Face], tolerance_mm: float, angle: float) -> tuple[Float, Int, Int]:
    """Points (n, 3) mm and outward triangles (m, 3) of solids, welded, and the number (m,) of each one's face.

    Absolute tolerances: mm, and radians between facets; nothing cached is used.
    """
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools

    BRepTools.Clean_s(solid.wrapped)
    BRepMesh_IncrementalMesh(solid.wrapped, tolerance_mm, False, angle, False)
    pieces = [_triangulation(face) for face in faces]
    sizes = [len(p) for p, _ in pieces]
    offset = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    points = np.vstack([p for p, _ in pieces])
    triangles = np.vstack([t + o for (_, t), o in zip(pieces, offset, strict=True)])
    face = np.repeat(np.arange(len(pieces)), [len(t) for _, t in pieces])
    _, first, weld = np.unique(
        np.round(points / _WELD).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    points, triangles = points[first], weld.reshape(-1)[triangles]
    a, b, c = triangles.T
    good = (a != b) & (b != c) & (c != a)  # a sphere's pole is an edge without length
    return points, triangles[good], face[good]


def _triangulation(face: Face) -> tuple[Float, Int]:
    """Points (n, 3) and outward triangles (m, 3) of one face."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_REVERSED
    from OCP.TopLoc import TopLoc_Location

    where = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face.wrapped, where)
    move = where.Transformation()
    nodes = [mesh.Node(i).Transformed(move) for i in range(1, mesh.NbNodes() + 1)]
    points = np.array([[p.X(), p.Y(), p.Z()] for p in nodes])
    triangles = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)], dtype=np.int64) - 1
    return points, triangles[:, ::-1] if face.wrapped.Orientation() == TopAbs_REVERSED else triangles


def _cad_face(face: Face, points: Float, triangles: Int, surface: ImplicitSurface) -> CadFace:
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    largest = int(np.argmax(np.linalg.norm(area, axis=1)))
    normal = surface.distance(corners[largest].mean(axis=0, keepdims=True))[1][0]
    used = points[np.unique(triangles)]
    return CadFace(face.label, surface, used.min(axis=0), used.max(axis=0), float(np.sign(normal @ area[largest])))
