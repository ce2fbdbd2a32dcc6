"""Triangulated rigid objects: closed bodies whose lower side touches the finger."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from finger3d._ranges import PathName, Scale
from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.objects.shapes import RigidObject

_LEVEL = 1e-6  # of the size: points this little above the lowest one count as lowest too (STL has single precision)
_MIRROR = 1e-6
_MOST = 2_000  # points that are compared with their mirror images


@dataclass(frozen=True)
class MeshObject(RigidObject):
    """A closed triangulated body, y up as in the scene, moved so that its lowest point lies over (x_mm, z_mm).

    Where several points are lowest, the middle of the box around them counts.

    Attributes
    ----------
    surface : the body as it was drawn, mm; :func:`finger3d.geometry.files.read_surface` reads and checks a file
    path, scale : the file it came from, and what its numbers were multiplied with
    """

    surface: Triangles = field(kw_only=True)
    path: str | None = field(default=None, kw_only=True, compare=False)
    scale: float = field(default=1.0, kw_only=True, compare=False)

    @cached_property
    def origin(self) -> Float:
        """The lowest point (3,) in the drawing's coordinates, mm."""
        used = self.surface.points[np.unique(self.surface.faces)]
        low = used[used[:, 1] <= used[:, 1].min() + _LEVEL * self.surface.size]
        middle = 0.5 * (low.min(axis=0) + low.max(axis=0))
        return np.array([middle[0], used[:, 1].min(), middle[2]])

    @cached_property
    def moved(self) -> Triangles:
        """The surface with its lowest point at (x_mm, 0, z_mm)."""
        shift = np.array([self.x_mm, 0.0, self.z_mm]) - self.origin
        return Triangles(self.surface.points + shift, self.surface.faces)

    def height(self, x: Float, z: Float) -> Float:
        """Return where a vertical line from below first meets the body, exact on its triangles; NaN outside it."""
        x, z = (np.ascontiguousarray(v, dtype=float) for v in np.broadcast_arrays(x, z))
        # Every increment evaluates the same points: their heights are kept until other points are given.
        key = (x.tobytes(), z.tobytes())
        if key not in self._known:
            self._known.clear()
            self._known[key] = self.moved.height(x, z)
        return self._known[key].copy()

    @cached_property
    def _known(self) -> dict[tuple[bytes, bytes], Float]:
        return {}

    def signed_distance(self, points: Float) -> tuple[Float, Float]:
        """Distance (n,) mm of points (n, 3) from the body, negative inside, and the outward unit normal (n, 3).

        The points are measured from the body's rest: lowest point at (x_mm, 0, z_mm).
        """
        return self.moved.signed_distance(points)

    def mirrors(self) -> tuple[str, ...]:
        """Return the symmetry planes of the body about the middle of the finger, tested on its points."""
        return self._mirrors

    @cached_property
    def _mirrors(self) -> tuple[str, ...]:
        at = self.landmarks()
        if len(at) > _MOST:
            at = at[:: len(at) // _MOST + 1]
        middle = self.moved.corners.mean(axis=1)[:, ::2]
        at = np.vstack([at, middle[:: len(middle) // _MOST + 1]])
        height = self.height(*at.T)
        found = []
        for axis, sign in (("x", [-1.0, 1.0]), ("z", [1.0, -1.0])):
            image = self.height(*(at * sign).T)
            if np.array_equal(np.isnan(image), np.isnan(height)):
                away = np.abs(image - height)
                if away[np.isfinite(away)].max(initial=0.0) <= _MIRROR * self.surface.size:
                    found.append(axis)
        return tuple(found)

    def landmarks(self) -> Float:
        """Return the corners of the triangles that face down."""
        down = self.surface.normals[:, 1] < 0.0
        return self.moved.points[np.unique(self.surface.faces[down])][:, ::2]


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

    def height(self, x: Float, z: Float) -> Float:
        """Raise an error: the file has not been read."""
        raise TypeError("read() the object first")

    def read(self) -> MeshObject:
        """Return the object; reads and checks its file."""
        from finger3d.geometry.files import read_surface

        surface = read_surface(self.path, self.scale)
        return MeshObject(self.x_mm, self.z_mm, surface=surface, path=self.path, scale=self.scale)
