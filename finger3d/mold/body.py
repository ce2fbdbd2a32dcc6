"""The body that a mold casts, by CAD or as closed triangles; tessellation for printing; STL, 3MF and STEP files, mm."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from finger3d.io import atomic

if TYPE_CHECKING:
    from build123d import Shape, Solid


ANGLE = 0.2
"""First tessellation's largest angle between facets, radians; it keeps pegs and holes round."""

_VOLUME_TOLERANCE = 8e-4  # relative error of the tessellated volume; the documentation states 1e-3
_MAX_REFINEMENTS = 14
_QUADRATURE_TOLERANCE = 1e-4  # relative, of the Gauss-Kronrod volume
_SHARED_MM = 0.05  # tolerance of triangles of which common volumes are taken
_EXACTLY_INTEGRATED = ("PLANE", "CYLINDER", "CONE", "SPHERE")


@dataclass(frozen=True)
class Shell:
    """Closed surface of a solid, with the tolerance (mm) and the largest angle (radians) of its tessellation."""

    surface: Triangles
    tolerance_mm: float
    angle: float

    @property
    def extent(self) -> Float:
        """Size (3,) of the box around it, mm."""
        return self.surface.high - self.surface.low

    def moved(self, rotation: Float, shift: Float) -> Shell:
        """Return the surface rotated, then translated."""
        return replace(self, surface=Triangles(self.surface.points @ rotation.T + shift, self.surface.faces))


def shell(solid: Solid, tolerance_mm: float, name: str, angle: float = ANGLE) -> Shell:
    """Tessellate a build123d solid within `tolerance_mm` and `angle`, and finer until the volume is within 1e-3.

    CAD integrates the volume under planes, cylinders, cones and spheres exactly; under splines errors of 42 % occur.
    With other faces the tolerance is therefore halved until the volume changes by less than 4e-4.

    Raises
    ------
    Finger3dError
        If the triangles do not close, or their volume does not settle.
    """
    exact = known_volume(solid)
    coarse = _triangles(solid, tolerance_mm, angle, name)
    for _ in range(_MAX_REFINEMENTS):
        if exact is not None and abs(coarse.volume - exact) <= _VOLUME_TOLERANCE * exact:
            return Shell(coarse, tolerance_mm, angle)
        # Facets on small radii are limited by the angle, not by the tolerance.
        fine = _triangles(solid, tolerance_mm / 2.0, angle / 2.0**0.5, name)
        if exact is None and abs(coarse.volume - fine.volume) <= _VOLUME_TOLERANCE / 2.0 * fine.volume:
            return Shell(coarse, tolerance_mm, angle)
        coarse, tolerance_mm, angle = fine, tolerance_mm / 2.0, angle / 2.0**0.5
    raise Finger3dError(f"{name}: the volume of its triangles does not settle; mend the body where it was drawn")


def known_volume(solid: Solid) -> float | None:
    """Return CAD's volume (mm3) of a build123d solid; None if CAD does not integrate all its faces exactly."""
    exact = all(face.geom_type.name in _EXACTLY_INTEGRATED for face in solid.faces())
    return float(solid.volume) if exact else None


def volume(solid: Solid) -> float:
    """Return the volume (mm3) of a build123d solid, by Gauss-Kronrod integration where CAD's own is not exact."""
    exact = known_volume(solid)
    if exact is not None:
        return exact
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumePropertiesGK_s(solid.wrapped, properties, _QUADRATURE_TOLERANCE)
    return float(properties.Mass())


def _triangles(solid: Solid, tolerance_mm: float, angle: float, name: str) -> Triangles:
    from finger3d.geometry.tessellate import triangulated

    points, faces, _ = triangulated(solid, list(solid.faces()), tolerance_mm, angle)
    surface = Triangles(points, faces)
    if reason := mistake(surface):
        raise Finger3dError(f"{name}: as triangles, the body {reason}; try another --tolerance-mm")
    return surface


def write_stl(path: Path, surface: Triangles) -> None:
    """Write a closed surface, mm, as binary STL."""
    import trimesh

    with atomic(path) as temporary:
        trimesh.Trimesh(surface.points, surface.faces, process=False).export(temporary, file_type="stl")


def write_step(path: Path, shape: Shape) -> None:
    """Write a build123d shape as STEP, mm."""
    from build123d import export_step

    with atomic(path) as temporary:
        temporary.parent.joinpath(temporary.name).touch()  # CAD reports no error of a folder that cannot be written
        export_step(shape, str(temporary))


def write_3mf(path: Path, shells: Mapping[str, Shell]) -> None:
    """Write named closed surfaces as one 3MF file, mm, each an object of its own on the plate."""
    from lib3mf import Lib3MF  # on Linux for ARM build123d brings it as py-lib3mf

    library = Path(Lib3MF.__file__).with_name("lib3mf")
    wrapper = Lib3MF.Wrapper(str(library))
    model = wrapper.CreateModel()
    model.SetUnit(Lib3MF.ModelUnit.MilliMeter)
    for name, part in shells.items():
        mesh = model.AddMeshObject()
        mesh.SetName(name)
        points = [Lib3MF.Position((ctypes.c_float * 3)(*p)) for p in part.surface.points.tolist()]
        faces = [Lib3MF.Triangle((ctypes.c_uint * 3)(*t)) for t in part.surface.faces.tolist()]
        mesh.SetGeometry(points, faces)
        model.AddBuildItem(mesh, wrapper.GetIdentityTransform())
    with atomic(path) as temporary:
        temporary.write_bytes(bytes(model.QueryWriter("3mf").WriteToBuffer()))


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

    def shared(self, shape: Shape) -> float:
        """Return the volume (mm3) that a CAD solid shares with the body."""
        from finger3d.geometry.tessellate import triangulated
        from finger3d.mold import regions, solids

        if self.cad is not None:
            return solids.common(shape, self.cad)
        pieces = shape.solids()
        meshed = (triangulated(piece, list(piece.faces()), _SHARED_MM, ANGLE) for piece in pieces)
        return sum(regions.common(Triangles(points, faces), self.surface) for points, faces, _ in meshed)

    def cut_from(self, part: Shell) -> Shell:
        """Return a tessellated part without the body."""
        from finger3d.mold.regions import difference

        return Shell(difference(part.surface, self.surface), part.tolerance_mm, part.angle)
