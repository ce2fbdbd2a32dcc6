"""CAD solids as closed triangles with an absolute tolerance, and CAD faces as implicit surfaces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.geometry.cad import OUTSIDE, Glued, GluedFace, labelled_faces
from finger3d.geometry.surface import Triangles, has_three_corners

if TYPE_CHECKING:
    from build123d import Compound, Face, Shape, Solid
    from OCP.Geom import Geom_Surface
    from OCP.gp import gp_Dir, gp_Pnt
    from OCP.ShapeAnalysis import ShapeAnalysis_Surface


_PROJECTION_TOLERANCE_MM = 1e-9


class ImplicitSurface(Protocol):
    """A surface without borders."""

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Signed distance (n,), mm, of points (n, 3), and its gradient (n, 3), of unit length."""
        ...


@dataclass(frozen=True)
class ImplicitPlane:
    """A plane through a point (mm)."""

    origin: Float
    direction: Float

    def distance(self, points: Float) -> tuple[Float, Float]:
        """See :class:`ImplicitSurface`."""
        return (points - self.origin) @ self.direction, np.broadcast_to(self.direction, points.shape)

    @property
    def axis(self) -> int | None:
        """The coordinate that is constant on the plane, if there is one."""
        along = int(np.argmax(np.abs(self.direction)))
        return along if abs(self.direction[along]) > 1.0 - 1e-12 else None


@dataclass(frozen=True)
class ImplicitCylinder:
    """A round cylinder (mm)."""

    origin: Float
    direction: Float
    radius: float

    def distance(self, points: Float) -> tuple[Float, Float]:
        """See :class:`ImplicitSurface`."""
        out = points - self.origin
        return _round(out - np.outer(out @ self.direction, self.direction), self.radius)


@dataclass(frozen=True)
class ImplicitSphere:
    """A sphere (mm)."""

    origin: Float
    radius: float

    def distance(self, points: Float) -> tuple[Float, Float]:
        """See :class:`ImplicitSurface`."""
        return _round(points - self.origin, self.radius)


def _round(out: Float, radius: float) -> tuple[Float, Float]:
    length = np.linalg.norm(out, axis=1)
    return length - radius, out / np.maximum(length, 1e-300)[:, None]


@dataclass(frozen=True)
class Freeform:
    """Another CAD surface, by projection in 0.1 to 0.5 ms a point; beyond its border it continues along tangents."""

    geometry: Geom_Surface

    @cached_property
    def _nearest(self) -> ShapeAnalysis_Surface:
        from OCP.ShapeAnalysis import ShapeAnalysis_Surface

        return ShapeAnalysis_Surface(self.geometry)

    def distance(self, points: Float) -> tuple[Float, Float]:
        """See :class:`ImplicitSurface`."""
        from OCP.GeomLProp import GeomLProp_SLProps
        from OCP.gp import gp_Pnt

        distance, normal = np.zeros(len(points)), np.zeros_like(points)
        for i, p in enumerate(points):
            at = self._nearest.ValueOfUV(gp_Pnt(*map(float, p)), _PROJECTION_TOLERANCE_MM)
            local = GeomLProp_SLProps(self.geometry, at.X(), at.Y(), 1, 1e-9)
            near = local.Value()
            if local.IsNormalDefined():  # not at the tip of a cone
                normal[i] = _vector(local.Normal())
            distance[i] = (p - _vector(near)) @ normal[i]
        return distance, normal


def surface_of(face: Face, exact: tuple[float, ...] = (0.0,)) -> ImplicitSurface:
    """Return the surface of a build123d face; a plane's constant coordinate is rounded to the nearest of `exact`."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane, GeomAbs_Sphere

    adaptor = BRepAdaptor_Surface(face.wrapped)
    kind = adaptor.GetType()
    if kind == GeomAbs_Plane:
        plane = adaptor.Plane()
        origin, direction = _vector(plane.Location()), _vector(plane.Axis().Direction())
        for axis in range(3):
            if abs(direction[axis]) > 1.0 - 1e-9:
                direction = np.eye(3)[axis] * np.sign(direction[axis])
                near = min(exact, key=lambda value: abs(value - origin[axis]))
                origin[axis] = near if abs(near - origin[axis]) < 1e-9 else origin[axis]
        return ImplicitPlane(origin, direction)
    if kind == GeomAbs_Cylinder:
        cylinder = adaptor.Cylinder()
        axis_line = cylinder.Axis()
        return ImplicitCylinder(_vector(axis_line.Location()), _vector(axis_line.Direction()), float(cylinder.Radius()))
    if kind == GeomAbs_Sphere:
        sphere = adaptor.Sphere()
        return ImplicitSphere(_vector(sphere.Location()), float(sphere.Radius()))
    return Freeform(BRep_Tool.Surface_s(face.wrapped))


def _vector(v: gp_Pnt | gp_Dir) -> Float:
    return np.array([v.X(), v.Y(), v.Z()])


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
    a, b, edges = Triangles(np.zeros((count, 3)), triangles).neighbours
    return np.bincount(np.unique(edges[face[a] != face[b]], axis=0).ravel(), minlength=count)


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
    good = has_three_corners(triangles)  # a sphere's pole is an edge without length
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
