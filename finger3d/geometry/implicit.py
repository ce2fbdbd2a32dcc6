"""Surfaces as implicit functions: signed distance and normal, for labels and for moving nodes onto CAD."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from finger3d._types import Float

if TYPE_CHECKING:
    from build123d import Face
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
