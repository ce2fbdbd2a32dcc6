"""Triangulated rigid objects: closed bodies from STL and STEP files."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal, Self

import numpy as np

from finger3d._ranges import PathName, Scale
from finger3d._types import Float
from finger3d.geometry.design import Design
from finger3d.geometry.surface import Triangles
from finger3d.objects.rigid import HALF_TURN, HeldBody, RigidObject

_LEVEL = 1e-6  # of the size: points this little above the lowest one count as lowest too (STL has single precision)
_MOST = 2_000  # points that are compared with their mirror images

_SMOOTH = math.radians(30.0)
"""Largest angle between the normals of neighbouring triangles of a smooth surface; a circle of 12 edges has it."""


@dataclass(frozen=True)
class MeshObject(RigidObject):
    """A closed triangulated body, y up as in the scene; its lowest point is its reference point.

    Where several points are lowest, the middle of the box around them counts.

    Attributes
    ----------
    surface : the body as it was drawn, mm; :func:`finger3d.geometry.files.read_surface` reads and checks a file
    path, scale : the file it came from, and what its numbers were multiplied with
    """

    has_section: ClassVar[bool] = False
    is_face: ClassVar[bool] = False
    body_mesher: ClassVar[Literal["ftetwild", "swept"]] = "ftetwild"

    surface: Triangles = field(kw_only=True)
    path: str | None = field(default=None, kw_only=True, compare=False)
    scale: float = field(default=1.0, kw_only=True, compare=False)

    @cached_property
    def origin(self) -> Float:
        """The lowest point (3,) in the drawing's coordinates, mm."""
        return _lowest(self.surface.points[np.unique(self.surface.faces)], self.surface.size)

    @cached_property
    def triangles(self) -> Triangles:
        """The surface in the object's own coordinates."""
        return Triangles(self.surface.points - self.origin, self.surface.faces)

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance from the nearest triangle."""
        if not len(points):
            return np.zeros(0), np.zeros((0, 3))
        return self.triangles.signed_distance(points)

    def mean_chord(self, direction: Float) -> float:
        """Return the volume over the area projected along a direction, overlapping parts counted separately."""
        projected = 0.5 * float(np.abs(self.surface.area_vectors @ direction).sum())
        return abs(self.surface.volume) / projected

    def profile(self, x: Float, z: Float) -> Float:
        """Return where a vertical line from below first meets the body, exact on its triangles; nan beside it."""
        return self.triangles.height(x, z)

    def lowest_point(self, turned: Float) -> Float:
        """Return the lowest point after a rotation."""
        used = self.triangles.points[np.unique(self.triangles.faces)]
        return np.asarray(_lowest(used @ turned.T, self.surface.size) @ turned)

    @property
    def middle(self) -> Float:
        """The middle of the box around the body as it was drawn."""
        return 0.5 * (self.surface.low + self.surface.high) - self.origin

    def mirrored(self, x_mm: float, z_mm: float) -> Self:
        """Return the mirror image at a horizontal plane, with its lowest point at another place."""
        surface = Triangles(self.surface.points * [1.0, -1.0, 1.0], self.surface.faces[:, ::-1])
        return replace(super().mirrored(x_mm, z_mm), surface=surface)

    def landmarks(self) -> Float:
        """Return the corners of the triangles."""
        return self.triangles.points[np.unique(self.triangles.faces)]

    def probes(self) -> Float:
        """Return corners and middles of triangles."""
        points = np.vstack([self.landmarks(), self.triangles.corners.mean(axis=1)])
        return points[:: len(points) // _MOST + 1]

    @property
    def probe_reach(self) -> float:
        """The size of the body."""
        return self.surface.size

    @property
    def held_height_mm(self) -> float:
        """Height (mm) of the body."""
        return float(self.surface.high[1] - self.surface.low[1])

    def held_body(self, finger: Design, solid: bool) -> HeldBody:
        """Return the whole body, held on its highest plane; a STEP file is read with its CAD faces."""
        from finger3d.geometry.imported import imported, of_surface

        body = imported(self.path, True, self.scale) if self.path else of_surface(self.surface, "object", True)
        # Designs are measured from the middle of the plane on which they are held, the object from its lowest point.
        origin = np.array([-self.origin[0], -self.origin[1], self.origin[2]]) - body.middle
        place = np.array([self.x_mm, 0.0, self.z_mm])
        return HeldBody(design=body, turn=HALF_TURN, origin=origin, place=place, mesher=self.body_mesher, is_whole=True)

    def drawing(self, reach_mm: float) -> Triangles:
        """Return all triangles."""
        return self.triangles

    @property
    def has_edges(self) -> bool:
        """Whether the surface is more than a smooth one in triangles."""
        return self.surface.sharpest_edge > _SMOOTH

    @property
    def is_convex(self) -> bool:
        """Whether the body is known to be convex: no."""
        return False


def _lowest(points: Float, size: float) -> Float:
    """Return the lowest of points (n, 3), in the middle of the box around all that are as low."""
    bottom = points[:, 1].min()
    low = points[points[:, 1] <= bottom + _LEVEL * size]
    middle = 0.5 * (low.min(axis=0) + low.max(axis=0))
    return np.array([middle[0], bottom, middle[2]])


@dataclass(frozen=True)
class ObjectFile(RigidObject):
    """A triangulated object in a file.

    Attributes
    ----------
    path : .stl, .step and the like, relative to the scene
    scale : what its lengths are multiplied with, to be mm
    """

    path: PathName = field(kw_only=True)
    scale: Scale = field(default=1.0, kw_only=True)

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Raise an error: the file has not been read."""
        raise TypeError("read() the object first")

    def profile(self, x: Float, z: Float) -> Float:
        """Raise an error: the file has not been read."""
        raise TypeError("read() the object first")

    def drawing(self, reach_mm: float) -> Triangles:
        """Raise an error: the file has not been read."""
        raise TypeError("read() the object first")

    def read(self) -> MeshObject:
        """Return the object; reads and checks its file."""
        from finger3d.geometry.files import read_surface

        surface = read_surface(self.path, self.scale)
        place = {name: getattr(self, name) for name in ("x_mm", "z_mm", "turn_x", "turn_y", "turn_z")}
        return MeshObject(**place, surface=surface, path=self.path, scale=self.scale)
