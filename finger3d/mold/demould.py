"""Undercuts: whether the halves of a mold can be removed from the cast body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float

if TYPE_CHECKING:
    from build123d import Face, Shape, Solid


_ON_PLANE_MM = 1e-6  # distance at which a face lies on a plane
_NORMAL_TOLERANCE = 1e-6  # component of a unit normal against the opening direction


def box(body: Shape) -> tuple[Float, Float]:
    """Return the lowest and highest corner (3,), mm, of a build123d shape."""
    found = body.bounding_box(optimal=True)
    return np.array([*found.min]), np.array([*found.max])


def is_base(face: Face) -> bool:
    """Return whether a face is the finger's base, which the lid covers."""
    return bool(face.is_planar) and abs(face.center().Y) < _ON_PLANE_MM and face.normal_at(face.center()).Y < -0.5


def undercuts(solid: Solid, split: str, at_mm: float) -> str:
    """Return a description of the worst undercut of a body whose halves open along an axis; empty without undercut.

    A half can be removed along d if the normals n of the body inside it satisfy n . d >= 0 everywhere but on the base.
    The normals are those of CAD at the points of a tessellation.
    """
    from build123d import Axis, Box, Pos

    low, high = box(solid)
    axis = 0 if split == "x" else 2
    direction = Axis.X if split == "x" else Axis.Z
    reach = 4.0 * float(np.linalg.norm(high - low))
    for sign in (1.0, -1.0):
        middle = np.zeros(3)
        middle[axis] = at_mm + sign * reach / 2.0
        for piece in (solid & Pos(*map(float, middle)) * Box(reach, reach, reach)).solids():
            for face in piece.faces():
                centre = np.array([*face.center()])
                on_split = bool(face.is_planar) and abs(centre[axis] - at_mm) < _ON_PLANE_MM
                if is_base(face) or (on_split and abs(face.normal_at(face.center()).dot(direction.direction)) > 0.5):
                    continue
                points, normals = _normals(face)
                depth = sign * normals[:, axis]
                if depth.min() < -_NORMAL_TOLERANCE:
                    where = ", ".join(f"{c:.4g}" for c in points[int(np.argmin(depth))])
                    side = f"{'+' if sign > 0 else '-'}{split}"
                    return f"the half on the {side} side is locked by the body near ({where}) mm"
    return ""


def _normals(face: Face) -> tuple[Float, Float]:
    """Points (n, 3) mm of a face, and outward unit normals (n, 3)."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepGProp import BRepGProp_Face
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(face.wrapped, 0.05, False, 0.2, False)
    mesh = BRep_Tool.Triangulation_s(face.wrapped, TopLoc_Location())
    surface, point, normal = BRepGProp_Face(face.wrapped), gp_Pnt(), gp_Vec()
    points, normals = [], []
    for i in range(1, mesh.NbNodes() + 1):
        uv = mesh.UVNode(i)
        surface.Normal(uv.X(), uv.Y(), point, normal)
        if normal.Magnitude() > 1e-9:  # a sphere's pole has none
            points.append([point.X(), point.Y(), point.Z()])
            normals.append([normal.X(), normal.Y(), normal.Z()])
    n = np.array(normals)
    return np.array(points), n / np.linalg.norm(n, axis=1, keepdims=True)
