"""The body that a mold casts: a CAD solid, or closed triangles of a body without CAD."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.mold.shell import Shell, shell, volume

if TYPE_CHECKING:
    from build123d import Shape, Solid

_TURN = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # about y by -90 degrees: x becomes z


@dataclass(frozen=True)
class Body:
    """A body to be cast.

    Attributes
    ----------
    surface : closed triangles, mm: a tessellation of `cad`, or the body itself
    cad : the build123d solid; None for a body of triangles
    """

    surface: Triangles
    cad: Solid | None

    @classmethod
    def of(cls, shape: Solid | Triangles, tolerance_mm: float, name: str = "finger") -> Body:
        """Return the body of a solid or of closed triangles."""
        if isinstance(shape, Triangles):
            return cls(shape, None)
        return cls(shell(shape, tolerance_mm, name).surface, shape)

    @property
    def solid(self) -> Solid:
        """The CAD solid of a body that has one."""
        assert self.cad is not None
        return self.cad

    @property
    def volume_mm3(self) -> float:
        """Volume, by CAD where there is CAD."""
        return self.surface.volume if self.cad is None else volume(self.cad)

    @property
    def box(self) -> tuple[Float, Float]:
        """Lowest and highest corner (3,), mm."""
        if self.cad is None:
            return self.surface.low, self.surface.high
        bounds = self.cad.bounding_box(optimal=True)
        return np.array([*bounds.min]), np.array([*bounds.max])

    def scaled(self, factor: float) -> Body:
        """Return the body enlarged about the middle of its base."""
        if factor == 1.0:
            return self
        from finger3d.geometry.cad import enlarged

        cad = None if self.cad is None else enlarged(self.cad, factor)
        return Body(Triangles(self.surface.points * factor, self.surface.faces), cad)

    def opening_along_z(self, split: str) -> Body:
        """Return the body rotated about y so that its axis `split` becomes z."""
        if split == "z":
            return self
        from build123d import Rot

        cad = None if self.cad is None else (Rot(0, -90, 0) * self.cad)
        return Body(Triangles(self.surface.points @ _TURN.T, self.surface.faces), cad)

    def at(self, x: float) -> Body:
        """Return the body moved along x."""
        if x == 0.0:
            return self
        from build123d import Pos

        cad = None if self.cad is None else (Pos(float(x), 0, 0) * self.cad)
        return Body(Triangles(self.surface.points + [x, 0.0, 0.0], self.surface.faces), cad)

    def shared(self, shape: Shape, tolerance_mm: float = 0.05) -> float:
        """Return the volume (mm3) that a CAD solid shares with the body."""
        from finger3d.mold import regions, solids

        if self.cad is not None:
            return solids.common(shape, self.cad)
        pieces = shape.solids()
        return sum(regions.common(_triangles(piece, tolerance_mm), self.surface) for piece in pieces)

    def cut_from(self, part: Shell) -> Shell:
        """Return a tessellated part without the body."""
        from finger3d.mold.regions import difference

        return Shell(difference(part.surface, [self.surface]), part.tolerance_mm, part.angle)


def _triangles(solid: Solid, tolerance_mm: float) -> Triangles:
    from finger3d.geometry.tessellate import triangulated

    points, faces, _ = triangulated(solid, list(solid.faces()), tolerance_mm, 0.2)
    return Triangles(points, faces)
