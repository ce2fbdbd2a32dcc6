"""CAD solid -> closed triangles with an absolute tolerance, and the CAD face under every triangle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._arrays import freeze_arrays
from finger3d._types import Float, Int
from finger3d.geometry.cad import labelled_faces
from finger3d.geometry.implicit import ImplicitSurface, surface_of

if TYPE_CHECKING:
    from build123d import Face, Solid


_WELD = 1e-7  # mm


@dataclass(frozen=True)
class CadFace:
    """One face of a solid: its label, its surface, the box (mm) around it, and +1 if the surface's normal looks out."""

    label: str
    surface: ImplicitSurface
    low: Float
    high: Float
    sign: float


@dataclass(frozen=True)
class Tessellation:
    """A solid as closed triangles.

    Attributes
    ----------
    points : (n, 3) mm
    triangles : (m, 3) outward
    face : (m,) number of the CAD face in `faces`
    corners : (k, 3) mm where three faces or more meet, and `corner_faces`, the numbers of these
    """

    points: Float
    triangles: Int
    face: Int
    faces: tuple[CadFace, ...]
    corners: Float
    corner_faces: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def labels(self) -> list[str]:
        """Label of every triangle."""
        return [self.faces[i].label for i in self.face]

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def tessellate(
    solid: Solid, tolerance_mm: float, angle: float = 0.5, exact: tuple[float, ...] = (0.0,)
) -> Tessellation:
    """Tessellate a build123d solid within `tolerance_mm` (absolute) and `angle` radians between facets.

    build123d's own `tessellate` and `export_stl` take a relative tolerance and reuse what was tessellated before.
    `exact` lists numbers (mm) that a plane's constant coordinate may stand for to the last bit.
    """
    faces = labelled_faces(solid)
    points, triangles, face = triangulated(solid, faces, tolerance_mm, angle)
    known = tuple(_cad_face(f, points, triangles[face == i], surface_of(f, exact)) for i, f in enumerate(faces))
    touching = np.unique(np.stack([triangles.ravel(), np.repeat(face, 3)], axis=1), axis=0)
    many = np.flatnonzero(np.bincount(touching[:, 0], minlength=len(points)) >= 3)
    sets = tuple(tuple(int(i) for i in touching[touching[:, 0] == v, 1]) for v in many)
    return Tessellation(points, triangles, face, known, points[many], sets)


def triangulated(solid: Solid, faces: list[Face], tolerance_mm: float, angle: float) -> tuple[Float, Int, Int]:
    """Points (n, 3) mm and outward triangles (m, 3) of a solid, welded, and the number (m,) of each one's face.

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
