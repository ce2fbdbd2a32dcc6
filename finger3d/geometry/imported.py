"""Designs from STEP and STL files; the base is found and placed on y = 0."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.cad import apart, check_gaps, glue
from finger3d.geometry.design import Design
from finger3d.geometry.files import STEP, StepBody, content, read_step, read_surface, tessellated
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake

if TYPE_CHECKING:
    from build123d import Compound, Face, Solid

    from finger3d.geometry.tessellate import Tessellation


Up: TypeAlias = Literal["y", "z"]

SMALLEST_MM, LARGEST_MM = 0.2, 5000.0

_UNIT = (
    "was it drawn in another unit? The numbers of an STL file are read as mm; give its scale in [finger], such as "
    "25.4 for inches"
)
_BASE_NAME = "base"  # of a face in a STEP file
_BASE_FLATNESS = 1e-5  # largest distance of the base from its plane, over the size
_DOWNWARD = 1.0 - 1e-6  # least component along -y of the base's unit normal
_LEAST_BASE_SHARE = 0.02  # of the footprint
_MIRROR_TOLERANCE = 2e-4  # over the size: a few times the error of the tessellation
_MAX_MIRRORED_POINTS = 2_000  # that are compared with their mirror images


def in_mm(*lengths: float) -> str:
    """Return lengths as text, such as 30 x 12 mm."""
    return " x ".join(f"{length:.4g}" for length in lengths) + " mm"


class FileDesign(Design):
    """Base of the bodies that are read from files, whose extent is that of their surface.

    Attributes
    ----------
    path : the file
    surface : closed triangles, mm
    """

    path: str
    surface: Triangles

    @property
    def name(self) -> str:
        """Name of the file."""
        return Path(self.path).name

    @property
    def height_mm(self) -> float:
        """Height above the base."""
        return float(self.surface.high[1])

    @property
    def half_length_mm(self) -> float:
        """Largest abs(x)."""
        return float(max(-self.surface.low[0], self.surface.high[0]))

    @property
    def width_mm(self) -> float:
        """Twice the largest abs(z)."""
        return 2.0 * float(max(-self.surface.low[2], self.surface.high[2]))

    @property
    def extent(self) -> str:
        """Size along x, y and z, and that of the base, in words."""
        base = self.surface.corners[(self.surface.corners[:, :, 1] == 0.0).all(axis=1)].reshape(-1, 3)
        foot = np.ptp(base, axis=0)
        return f"{in_mm(*(self.surface.high - self.surface.low))} (x, y up, z), base {in_mm(foot[0], foot[2])}"

    def top(self, x: Float, z: Float) -> Float:
        """Return the height y (n,) of the highest point at x, z (n,), mm; nan outside the body."""
        return self.surface.height(x, z, lowest=False)

    def landmarks(self) -> Float:
        """Return the corners (k, 2), x and z in mm, of the triangles that face up; one of them may touch first."""
        up = self.surface.normals[:, 1] > 0.0
        return self.surface.points[np.unique(self.surface.faces[up])][:, ::2]


def check_size(path: object, size: Float, unit: str) -> None:
    """Raise a Finger3dError for a body of a size (3,) that is too small or too large; it asks for the unit."""
    if not SMALLEST_MM <= float(np.linalg.norm(size)) <= LARGEST_MM:
        raise Finger3dError(
            f"{path}: the body is {in_mm(*size)} large, allowed: a diagonal of {SMALLEST_MM:g} to {LARGEST_MM:g} mm; "
            f"{unit}"
        )


def extent(design: Design) -> str:
    """Return the size of a finger along the axes of the scene in words, and of one from a file how it was read."""
    if isinstance(design, FileDesign):
        return design.extent
    return in_mm(2.0 * design.half_length_mm, design.height_mm, design.width_mm) + " (x, y up, z)"


@dataclass(frozen=True)
class Imported(FileDesign):
    """A body from a STEP or STL file, with the middle of its base at the origin.

    The base is the lowest plane, or the plane of the face named "base" in a STEP file, rotated to face down.

    Attributes
    ----------
    path : the file
    content : SHA-256 of the file
    scale : factor of the coordinates in the file
    upside_down : rotated about z by half a turn, so that the highest plane is the base
    named_base : rotated so that the face named "base" faces down
    middle : (3,) middle of the base in the file's coordinates after the rotation, mm
    surface : closed triangles in the final position, mm
    cad : the build123d solid in the final position; None for STL
    parts : build123d shapes of the parts in the final position, by their labels; empty for a body of one part
    up : axis of the file that is y here; z is turned to y about x
    unit : of length in the file, and how it is known
    """

    path: str = field(compare=False)
    content: str
    scale: float
    upside_down: bool
    named_base: bool
    middle: Float = field(compare=False, repr=False)
    surface: Triangles = field(compare=False, repr=False)
    cad: Solid | None = field(compare=False, repr=False)
    parts: Mapping[str, Compound] = field(default_factory=dict, compare=False, repr=False)
    up: Up = "y"
    unit: str = field(default="mm, as STL files have none", compare=False)

    @property
    def extent(self) -> str:
        """Size along x, y and z, that of the base, and how the file was read, in words."""
        scaled = f", times {self.scale:g}" if self.scale != 1.0 else ""
        turned = ", its z turned up" if self.up == "z" else ""
        return f"{super().extent}; unit of the file: {self.unit}{scaled}{turned}"

    @property
    def part_labels(self) -> tuple[str, ...]:
        """Names of the solids in a STEP file of several."""
        return tuple(label for label in self.parts if label)

    @property
    def cache_fields(self) -> Mapping[str, object]:
        """Content of the file and how it was turned; the file's name does not matter."""
        turned = ({"named_base": "True"} if self.named_base else {}) | ({"up": "z"} if self.up == "z" else {})
        dimensions = {"content": self.content, "scale": repr(self.scale), "upside_down": repr(self.upside_down)}
        return {"design": "imported", "dimensions": {**dimensions, **turned}}

    @property
    def volume_mm3(self) -> float:
        """Volume inside the triangles."""
        return self.surface.volume

    def mirrors(self) -> tuple[str, ...]:
        """Return the axes normal to planes of symmetry; none for STL, which cannot be cut exactly."""
        return () if self.cad is None else self._mirrors

    @cached_property
    def _mirrors(self) -> tuple[str, ...]:
        surfaces = [self.surface, *(tessellated(part) for part in self.parts.values())]
        return tuple(name for axis, name in ((0, "x"), (2, "z")) if all(self._mirrored(s, axis) for s in surfaces))

    def _mirrored(self, surface: Triangles, axis: int) -> bool:
        """Whether a surface is its own mirror image."""
        points = surface.points[np.unique(surface.faces)]
        image = points[:: len(points) // _MAX_MIRRORED_POINTS + 1].copy()
        image[:, axis] *= -1.0
        return bool(np.abs(surface.signed_distance(image)[0]).max() <= _MIRROR_TOLERANCE * self.surface.size)

    def solid(self) -> Solid:
        """Return the build123d solid, its faces labelled."""
        from finger3d.geometry.cad import sound

        if self.cad is None:
            raise Finger3dError(f"{self.path}: an STL file has triangles, and no CAD solid; export it as STL again")
        return sound(self.cad, self.name)

    def solids(self) -> Mapping[str, Solid | Compound]:
        """Return the parts; the solids without a name are the main body."""
        return self.parts or {"": self.solid()}

    def tessellation(self) -> Tessellation | None:
        """Return the triangles of an STL file in labelled patches; None for STEP, which is meshed from CAD."""
        from finger3d.geometry.faceted import body

        return body(self.surface) if self.cad is None else None


def imported(path: str | Path, upside_down: bool = False, scale: float = 1.0, up: Up = "y") -> Imported:
    """Read a body from a file and place its base on y = 0.

    Parameters
    ----------
    path : .stl (mm) or .step
        A plane face named "base" in a STEP file (the name of its ADVANCED_FACE) is turned down. Solids of a STEP file
        are parts with their names as labels; those without a name are the main body. A body may be hollow.
    upside_down : turn it, so that its highest plane becomes the base
    scale : factor of the lengths, which are mm before
    up : axis of the file that becomes y; z does by a quarter turn about x, before anything else

    Raises
    ------
    Finger3dError
        If the file cannot be read, the body is not closed, or it has no level base or nothing above it.

    Notes
    -----
    A texture needs an edge length below half its radius: for five ridges of radius 0.7 mm, pressed by 0.25 mm, STEP and
    STL gave forces that differ by 0.5 % with `mesh.size_mm` = 0.3, and by up to 2 % with 0.45.
    """
    path = Path(path)
    solid = None
    base: list[Face] = []
    parts: dict[str, list[Solid]] = {}
    if path.suffix.lower() in STEP:
        from build123d import Axis

        from finger3d.geometry.cad import enlarged

        read = read_step(path)
        unit = f"{read.unit}, as it says" if read.unit else "mm, as it names none"
        if up == "z":
            read = _y_up(read)
        solid, parts = united(path, read)
        moves: list[Callable[[Solid], Solid]] = []
        if base := read.faces.get(_BASE_NAME, []):
            moves.append(_turn(path, solid, base))
        if scale != 1.0:
            moves.append(lambda shape: enlarged(shape, scale))
        if upside_down and not base:
            moves.append(lambda shape: shape.rotate(Axis.Z, 180.0))
        for move in moves:
            solid, parts = move(solid), {label: [move(s) for s in found] for label, found in parts.items()}
        surface = tessellated(solid)
        if reason := mistake(surface, may_be_hollow=True):
            raise Finger3dError(f"{path}: the body {reason}")
    else:
        surface = read_surface(path, scale)
        unit = "mm, as STL files have none"
        if up == "z":
            surface = Triangles(surface.points[:, [0, 2, 1]] * [1.0, 1.0, -1.0], surface.faces)
        if upside_down:
            surface = Triangles(surface.points * [-1.0, -1.0, 1.0], surface.faces)
    found = _on_its_base(str(path), content(path), scale, upside_down, surface, solid)
    return replace(found, named_base=bool(base), parts=_moved(parts, found.middle), up=up, unit=unit)


def _y_up(read: StepBody) -> StepBody:
    """Return a body drawn with z up, turned about x so that y is up."""
    from build123d import Axis

    solids = tuple(solid.rotate(Axis.X, -90.0) for solid in read.solids)
    faces = {name: [face.rotate(Axis.X, -90.0) for face in found] for name, found in read.faces.items()}
    return replace(read, solids=solids, faces=faces)


def united(path: Path, read: StepBody) -> tuple[Solid, dict[str, list[Solid]]]:
    """Return the union of the solids of a STEP file, and the solids of each part; none if there is one part.

    Raises
    ------
    Finger3dError
        If solids overlap, do not touch, or nearly touch.
    """
    if len(read.solids) == 1:
        return read.solids[0], {}
    parts: dict[str, list[Solid]] = {}
    for label, solid in zip(read.labels, read.solids, strict=True):
        parts.setdefault(label, []).append(solid)
    from build123d import Compound

    check_gaps(glue({label: Compound(found) for label, found in parts.items()}, str(path)), read.solids, str(path))
    whole = read.solids[0].fuse(*read.solids[1:]).clean().solids()
    if len(whole) != 1:
        raise Finger3dError(
            f"{path}: the {len(read.solids)} solids make {len(whole)} bodies: {apart(*whole[:2])}; give one body"
        )
    return whole[0], parts if len(parts) > 1 else {}


def _moved(parts: Mapping[str, list[Solid]], middle: Float) -> dict[str, Compound]:
    if not parts:
        return {}
    from build123d import Compound, Location

    place = Location(tuple(float(-m) for m in middle))
    return {label: Compound([solid.moved(place) for solid in found]) for label, found in parts.items()}


def of_surface(surface: Triangles, name: str, upside_down: bool = False) -> Imported:
    """Return a closed surface as a body, like :func:`imported`."""
    if upside_down:
        surface = Triangles(surface.points * [-1.0, -1.0, 1.0], surface.faces)
    return _on_its_base(name, surface.digest, 1.0, upside_down, surface, None)


def _on_its_base(
    path: str, digest: str, scale: float, upside_down: bool, surface: Triangles, solid: Solid | None
) -> Imported:
    check_size(path, surface.high - surface.low, _UNIT)
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
        raise Finger3dError(
            f'{path}: nothing of the body looks up; is it drawn with y up? A finger with z up takes up = "z"'
        )
    return Imported(path, digest, scale, upside_down, False, middle, moved, solid)


def _turn(path: Path, solid: Solid, base: list[Face]) -> Callable[[Solid], Solid]:
    """Return the rotation by the smallest angle (about z, if by 180 degrees) that turns the named faces down."""
    normals = np.array([[*face.normal_at(face.center())] for face in base])
    out = normals[0]
    if not all(face.is_planar for face in base) or (normals @ out).min() < _DOWNWARD:
        raise Finger3dError(
            f"{path}: the {len(base)} faces named '{_BASE_NAME}' are not one plane; name one plane face so"
        )

    def turned(shape: Solid) -> Solid:
        if out[1] <= -_DOWNWARD:
            return shape
        from build123d import Axis

        around = np.cross(out, [0.0, -1.0, 0.0])
        axis = around / np.linalg.norm(around) if out[1] < _DOWNWARD else np.array([0.0, 0.0, 1.0])
        return shape.rotate(Axis((0, 0, 0), tuple(axis)), float(np.degrees(np.arccos(np.clip(-out[1], -1.0, 1.0)))))

    surface = tessellated(turned(solid))
    level = -out @ np.array([*base[0].center()])
    if abs(surface.low[1] - level) > _BASE_FLATNESS * surface.size:
        raise Finger3dError(
            f"{path}: the body reaches {level - surface.low[1]:.4g} mm beyond the face named '{_BASE_NAME}'; the base "
            "must be its outermost plane"
        )
    return turned


def _base(path: str, surface: Triangles, which: str) -> NDArray[np.bool_]:
    """Return the mask (m,) of the triangles of the lowest plane."""
    near = surface.corners[:, :, 1].max(axis=1) <= surface.low[1] + _BASE_FLATNESS * surface.size
    base: NDArray[np.bool_] = near & (surface.normals[:, 1] < -_DOWNWARD)
    area = float(np.linalg.norm(surface.area_vectors[base], axis=1).sum())
    footprint = float(np.maximum(-surface.area_vectors[:, 1], 0.0).sum())
    if area < _LEAST_BASE_SHARE * footprint:
        raise Finger3dError(
            f"{path}: no base: the {which} point of the body lies on no level plane (area {area:.3g} of "
            f"{footprint:.3g} mm2 seen from there); draw it with y up and a flat "
            'base (a finger drawn with z up takes up = "z")'
        )
    return base
