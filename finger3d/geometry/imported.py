"""A finger (or the soft half of an object) from a file: base found, moved onto it, described like the designs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d.errors import Finger3dError
from finger3d.geometry.files import STEP, content, read_named, read_surface, tessellated
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import crossings, mistake

if TYPE_CHECKING:
    from build123d import Face, Solid

    from finger3d.geometry.tessellate import Tessellation

Float = NDArray[np.float64]

SMALLEST_MM, LARGEST_MM = 0.2, 5000.0

_NAME = "base"
_LEVEL = 1e-5  # of the size: the base is what lies this near to the lowest point and looks down
_DOWN = 1.0 - 1e-6
_BASE_SHARE = 0.02  # of the footprint, at least
_MIRROR = 2e-4  # of the size: a few times what tessellation leaves
_MOST = 2_000  # points that are compared with their mirror images


@dataclass(frozen=True)
class Imported:
    """A body from a STEP or STL file, y up, with the middle of its base at the origin.

    The base is the lowest plane, or the plane of the face that a STEP file calls "base", turned down.

    Attributes
    ----------
    path : the file
    content : SHA-256 of the file; equal files are equal bodies
    scale : what an STL file's numbers were multiplied with
    upside_down : turned about z by half a turn, so that its highest plane is the base
    named_base : turned so that the face named "base" looks down
    middle : (3,) mm, the middle of the base as it was drawn (and turned)
    surface : closed triangles, mm, in place
    cad : the build123d solid in place; None for STL
    """

    path: str = field(compare=False)
    content: str
    scale: float
    upside_down: bool
    named_base: bool
    middle: Float = field(compare=False, repr=False)
    surface: Triangles = field(compare=False, repr=False)
    cad: Solid | None = field(compare=False, repr=False)

    @property
    def name(self) -> str:
        """The file's name."""
        return Path(self.path).name

    @property
    def cache_fields(self) -> Mapping[str, object]:
        """Content of the file and how it was turned; the file's name does not matter."""
        turned = {"named_base": "True"} if self.named_base else {}
        dimensions = {"content": self.content, "scale": repr(self.scale), "upside_down": repr(self.upside_down)}
        return {"design": "imported", "dimensions": {**dimensions, **turned}}

    @property
    def height_mm(self) -> float:
        """Height above the base."""
        return float(self.surface.high[1])

    @property
    def half_length_mm(self) -> float:
        """Farthest reach along x from the middle of the base."""
        return float(max(-self.surface.low[0], self.surface.high[0]))

    @property
    def width_mm(self) -> float:
        """Twice the farthest reach along z from the middle of the base."""
        return 2.0 * float(max(-self.surface.low[2], self.surface.high[2]))

    @property
    def volume_mm3(self) -> float:
        """Volume inside the triangles."""
        return self.surface.volume

    def section(self) -> None:
        """Return None: no constant section is known of a file."""

    def top(self, x: Float, z: Float) -> Float:
        """Height y (n,) of the highest point at x, z (n,), mm; nan beside the body."""
        return self.surface.height(x, z, lowest=False)

    def landmarks(self) -> Float:
        """Corners (k, 2), x and z mm, of the triangles that look up: one of them may touch first."""
        up = self.surface.normals[:, 1] > 0.0
        return self.surface.points[np.unique(self.surface.faces[up])][:, ::2]

    def mirrors(self) -> tuple[str, ...]:
        """Planes about which the body is its own image; none for STL, which cannot be cut exactly."""
        return () if self.cad is None else self._mirrors

    @cached_property
    def _mirrors(self) -> tuple[str, ...]:
        points = self.surface.points[np.unique(self.surface.faces)]
        points = points[:: len(points) // _MOST + 1]
        found = []
        for axis, name in ((0, "x"), (2, "z")):
            image = points.copy()
            image[:, axis] *= -1.0
            if np.abs(self.surface.signed_distance(image)[0]).max() <= _MIRROR * self.surface.size:
                found.append(name)
        return tuple(found)

    def solid(self) -> Solid:
        """Return the build123d solid, its faces labelled."""
        from finger3d.geometry.cad import sound

        if self.cad is None:
            raise Finger3dError(f"{self.path}: an STL file has triangles, and no CAD solid; export it as STL again")
        return sound(self.cad, self.name)

    def tessellation(self) -> Tessellation | None:
        """Return the triangles of an STL file in labelled patches; None for STEP, which is meshed from CAD."""
        from finger3d.geometry.faceted import body

        return body(self.surface) if self.cad is None else None


def imported(path: str | Path, upside_down: bool = False, scale: float = 1.0) -> Imported:
    """Read a body from a file and put it on its base.

    Parameters
    ----------
    path : .stl (mm) or .step; a plane face named "base" in a STEP file (the name of its ADVANCED_FACE) is turned down
    upside_down : turn it, so that its highest plane becomes the base
    scale : for STL only

    Raises
    ------
    Finger3dError
        If the file is none, the body not closed, or there is no level base or nothing above it.

    Notes
    -----
    A texture wants edges of less than half its radius: of five ridges of radius 0.7 mm, pressed by 0.25 mm, STEP and
    STL gave forces 0.5 % apart with `mesh.size_mm` = 0.3, and up to 2 % with 0.45.
    """
    path = Path(path)
    solid = None
    base: list[Face] = []
    if path.suffix.lower() in STEP:
        solid, named = read_named(path)
        if base := named.get(_NAME, []):
            solid = _turned(path, solid, base)
        if scale != 1.0:
            solid = solid.scale(scale)
        if upside_down and not base:
            from build123d import Axis

            solid = solid.rotate(Axis.Z, 180.0)
        surface = tessellated(solid)
        if reason := mistake(surface):
            raise Finger3dError(f"{path}: the body {reason}")
    else:
        surface = read_surface(path, scale)
        _stl_only(path, surface)
        if upside_down:
            surface = Triangles(surface.points * [-1.0, -1.0, 1.0], surface.faces)
    found = _on_its_base(str(path), content(path), scale, upside_down, surface, solid)
    return replace(found, named_base=True) if base else found


def of_surface(surface: Triangles, name: str, upside_down: bool = False) -> Imported:
    """A closed surface as a body, like :func:`imported`."""
    if upside_down:
        surface = Triangles(surface.points * [-1.0, -1.0, 1.0], surface.faces)
    return _on_its_base(name, surface.digest, 1.0, upside_down, surface, None)


def _on_its_base(
    path: str, told_by: str, scale: float, upside_down: bool, surface: Triangles, solid: Solid | None
) -> Imported:
    _check_size(path, surface)
    base = _base(path, surface, "highest" if upside_down else "lowest")
    corners = surface.corners[base].reshape(-1, 3)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    middle[1] = surface.low[1]
    points = surface.points - middle
    points[np.unique(surface.faces[base]), 1] = 0.0
    if solid is not None:
        from build123d import Location

        solid = solid.moved(Location(tuple(float(-m) for m in middle)))
    moved = Triangles(points, surface.faces)
    if not (moved.normals[~base, 1] > 1e-3).any():
        raise Finger3dError(f"{path}: nothing of the body looks up; is it drawn with y up?")
    return Imported(path, told_by, scale, upside_down, False, middle, moved, solid)


def _turned(path: Path, solid: Solid, base: list[Face]) -> Solid:
    """The solid, turned the shortest way (about z, if by half a turn) so that the faces named base look down."""
    normals = np.array([[*face.normal_at(face.center())] for face in base])
    out = normals[0]
    if not all(face.is_planar for face in base) or (normals @ out).min() < _DOWN:
        raise Finger3dError(f"{path}: the {len(base)} faces named '{_NAME}' are not one plane; name one plane face so")
    if out[1] > -_DOWN:
        from build123d import Axis

        around = np.cross(out, [0.0, -1.0, 0.0])
        axis = around / np.linalg.norm(around) if out[1] < _DOWN else np.array([0.0, 0.0, 1.0])
        solid = solid.rotate(Axis((0, 0, 0), tuple(axis)), float(np.degrees(np.arccos(np.clip(-out[1], -1.0, 1.0)))))
    surface = tessellated(solid)
    level = -out @ np.array([*base[0].center()])
    if abs(surface.low[1] - level) > _LEVEL * surface.size:
        raise Finger3dError(
            f"{path}: the body reaches {level - surface.low[1]:.4g} mm beyond the face named '{_NAME}'; the base "
            "must be its outermost plane"
        )
    return solid


def _check_size(path: str, surface: Triangles) -> None:
    if not SMALLEST_MM <= surface.size <= LARGEST_MM:
        extent = " x ".join(f"{e:.4g}" for e in surface.high - surface.low)
        raise Finger3dError(
            f"{path}: the body is {extent} mm large, allowed: a diagonal of {SMALLEST_MM:g} to {LARGEST_MM:g} mm; was "
            "it drawn in another unit? An STL file's numbers are read as mm"
        )


def _base(path: str, surface: Triangles, which: str) -> NDArray[np.bool_]:
    """Mask (m,) of the triangles of the lowest plane."""
    near = surface.corners[:, :, 1].max(axis=1) <= surface.low[1] + _LEVEL * surface.size
    base: NDArray[np.bool_] = near & (surface.normals[:, 1] < -_DOWN)
    area = float(np.linalg.norm(surface.area_vectors[base], axis=1).sum())
    footprint = float(np.maximum(-surface.area_vectors[:, 1], 0.0).sum())
    if area < _BASE_SHARE * footprint:
        raise Finger3dError(
            f"{path}: no base: the {which} point of the body lies on no level plane (area {area:.3g} of "
            f"{footprint:.3g} mm2 seen from there); draw it with y up and a flat base"
        )
    return base


def _stl_only(path: Path, surface: Triangles) -> None:
    """CAD vouches for its solids; triangles may run through each other."""
    crossed = crossings(surface)
    if len(crossed):
        at = surface.corners[crossed[0]].mean(axis=0)
        raise Finger3dError(
            f"{path}: the body's surface runs through itself at {len(crossed)} triangles, the first near "
            f"({at[0]:.4g}, {at[1]:.4g}, {at[2]:.4g}) mm; mend it where it was drawn"
        )
