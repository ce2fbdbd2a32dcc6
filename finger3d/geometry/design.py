"""Shape of a finger: the protocol of designs, their base classes and checks, and the designs of geometries/ by name."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from finger3d._ranges import LARGEST_MM, SMALLEST_MM, at_most
from finger3d._types import Float
from finger3d.errors import Finger3dError, MissingError
from finger3d.geometry.section import Arc, Section, largest_core_mm, largest_layer_mm

if TYPE_CHECKING:
    from build123d import Compound, Solid

    from finger3d.geometry.tessellate import Tessellation


def lacks_section(design: Design) -> str:
    """Return why a design has no section that could be meshed."""
    if hasattr(design, "surface"):
        return "a file, of which no section is known (only designs of geometries/ have one)"
    return "a design without a constant section"


class Design(ABC):
    """Shape of a body in mm, a frozen dataclass: y points up, the base lies on y = 0, and its middle is the origin.

    Attributes
    ----------
    name : in scenes and messages
    height_mm : largest height above the base
    half_length_mm : largest abs(x)
    width_mm : twice the largest abs(z)
    volume_mm3 : of the whole body
    """

    if TYPE_CHECKING:  # fields, class variables or properties
        __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[object]]]

        @property
        def name(self) -> str: ...
        @property
        def height_mm(self) -> float: ...
        @property
        def half_length_mm(self) -> float: ...
        @property
        def width_mm(self) -> float: ...
        @property
        def volume_mm3(self) -> float: ...

    @property
    @abstractmethod
    def cache_fields(self) -> Mapping[str, object]:
        """Key of the body's meshes in the cache: equal for equal shapes only."""

    @property
    def part_labels(self) -> tuple[str, ...]:
        """Labels of the solids beside the main body; empty for a body of one solid."""
        return ()

    def section(self) -> Section | None:
        """Return the section x >= 0 of a body extruded along z; None if the section is not constant or not known."""
        return None

    @abstractmethod
    def top(self, x: Float, z: Float) -> Float:
        """Return the height y (n,) of the contact surface at x, z (n,), mm; nan outside the body."""

    def landmarks(self) -> Float | None:
        """Return places (k, 2), x and z in mm, where an edge or a tip may touch first; None for a smooth surface."""
        return None

    def mirrors(self) -> tuple[str, ...]:
        """Return the axes, of "x" and "z", normal to planes of symmetry through the origin."""
        return ()

    @abstractmethod
    def solid(self) -> Solid:
        """Return the build123d solid of the whole body, its faces labelled."""

    def solids(self) -> Mapping[str, Solid | Compound]:
        """Return the build123d solids of the parts by their labels, "" the main body; together they are `solid()`."""
        return {"": self.solid()}

    def tessellation(self) -> Tessellation | None:
        """Return the body's own triangles if it has no CAD; None for a body that is meshed from CAD, or not meshed."""
        return None


class ParametricDesign(Design):
    """Base of the designs in geometries/: frozen dataclasses of dimensions, mirror images of themselves about x and z.

    A subclass states the attributes of :class:`Design`, as fields or as properties, and `top` and `solid`.
    """

    name: ClassVar[str]
    may_be_zero: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        check_dimensions(self.name, self.dimensions, self.may_be_zero)

    @property
    def dimensions(self) -> dict[str, float]:
        """The fields, mm."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @property
    def cache_fields(self) -> Mapping[str, object]:
        """Name and dimensions; the cache adds a hash of the design's file."""
        return {"design": self.name, "dimensions": {key: repr(value) for key, value in self.dimensions.items()}}

    def mirrors(self) -> tuple[str, ...]:
        """Return both axes."""
        return ("x", "z")


class ExtrudedDesign(ParametricDesign):
    """Base of the designs with a constant section: `section` determines all but the width."""

    width_mm: float

    @abstractmethod
    def section(self) -> Section:
        """Return the section x >= 0."""

    @property
    def part_labels(self) -> tuple[str, ...]:
        """Labels of the section's parts."""
        return self.section().part_labels

    @property
    def volume_mm3(self) -> float:
        """Volume in closed form."""
        return self.section().area_mm2 * self.width_mm

    def top(self, x: Float, z: Float) -> Float:
        """Return the exact height y (n,) of the contact surface at x, z (n,), mm; nan outside the footprint."""
        return self.section().top(x, z, self.width_mm)

    def solid(self) -> Solid:
        """Return the extruded solid."""
        from finger3d.geometry.cad import extruded

        return extruded(self.section(), self.width_mm, self.name)

    def solids(self) -> Mapping[str, Solid | Compound]:
        """Return the extruded solids of the parts."""
        from finger3d.geometry.cad import extruded_parts

        return extruded_parts(self.section(), self.width_mm, self.name)


@dataclasses.dataclass(frozen=True)
class DesignSummary(Design):
    """Height and width (mm) of a body whose shape is not known, as in a reduced model."""

    name: ClassVar[str] = "reduced"
    half_length_mm: ClassVar[float] = math.nan
    volume_mm3: ClassVar[float] = math.nan
    height_mm: float
    width_mm: float

    @property
    def cache_fields(self) -> Mapping[str, object]:
        """No key: there are no meshes."""
        return {}

    def top(self, x: Float, z: Float) -> Float:
        """Return nan (n,)."""
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(z)), np.nan)

    def solid(self) -> Solid:
        """Raise a Finger3dError."""
        raise Finger3dError("a reduced model has no solid; use the scene that it was made of")


def check_dimensions(design: str, dimensions: Mapping[str, object], may_be_zero: Collection[str] = ()) -> None:
    """Raise a Finger3dError unless every dimension is a number from 1e-2 to 1e4 mm, or 0 where that is allowed."""
    for key, value in dimensions.items():
        zero = key in may_be_zero
        allowed = f"{'0 or ' if zero else ''}{SMALLEST_MM:g} to {LARGEST_MM:g} mm"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Finger3dError(f"{design}: {key} = {value!r} is not a number; allowed: {allowed}")
        if zero and value == 0:
            continue
        if not math.isfinite(value) or not SMALLEST_MM <= value <= LARGEST_MM:
            raise Finger3dError(f"{design}: {key} = {value:g} is out of range; allowed: {allowed}")


def check_at_most(design: str, dimensions: Mapping[str, float], key: str, other: str) -> None:
    """Raise a Finger3dError if the dimension `key` is larger than the dimension `other`."""
    value, limit = dimensions[key], dimensions[other]
    if value > limit:
        raise Finger3dError(f"{design}: {key} = {value:g} is too large; allowed: at most {other} = {at_most(limit)}")


def check_layer(design: str, outline: Section, skin_mm: float) -> None:
    """Raise a Finger3dError for a skin (mm) that does not end on the section's walls, or without walls on its base."""
    limit = largest_layer_mm(outline)
    if skin_mm and not skin_mm < limit:
        walls = outline.edge_height_mm > 0.0 and isinstance(outline.contact, Arc)
        end = "does not end on the walls" if walls else "reaches the base"
        allowed = f"0, or below {at_most(limit)} mm" if limit > SMALLEST_MM else "0, or half_length_mm below radius_mm"
        raise Finger3dError(f"{design}: skin_mm = {skin_mm:g}: the skin {end}; allowed: {allowed}")


def check_core(design: str, section: Section, half_length_mm: float, height_mm: float) -> None:
    """Raise a Finger3dError for a core (mm) with one dimension zero, or one that leaves the section below its skin."""
    if bool(half_length_mm) != bool(height_mm):
        zero, other = ("core_height_mm", "core_half_length_mm")[:: 1 if half_length_mm else -1]
        raise Finger3dError(f"{design}: {zero} = 0, but {other} is not; allowed: both 0, or neither")
    if not half_length_mm:
        return
    longest = section.inner.half_length_mm
    if half_length_mm > longest:
        raise Finger3dError(
            f"{design}: core_half_length_mm = {half_length_mm:g} is too long; allowed: at most {at_most(longest)} mm"
        )
    limit = largest_core_mm(section, half_length_mm)
    if not height_mm < limit:
        what = "runs into the skin" if section.layer else "reaches the contact face"
        allowed = f"below {at_most(limit)} mm for core_half_length_mm = {half_length_mm:g}"
        raise Finger3dError(f"{design}: core_height_mm = {height_mm:g}: the core {what}; allowed: {allowed}")


def import_from(folder: Path, package: str, name: str) -> ModuleType:
    """Import the file `name`.py of a folder as the module `package`.`name`; its relative imports find its neighbours.

    The folder becomes a namespace package, as if its parent were on the module path. A package of that name from
    another folder is dropped.
    """
    known = sys.modules.get(package)
    if known is None or list(known.__path__) != [str(folder)]:
        for module in [m for m in sys.modules if m == package or m.startswith(f"{package}.")]:
            del sys.modules[module]
        spec = ModuleSpec(package, None, is_package=True)
        spec.submodule_search_locations = [str(folder)]
        sys.modules[package] = module_from_spec(spec)
    return importlib.import_module(f"{package}.{name}")


@functools.cache
def designs() -> dict[str, type]:
    """Return the designs by name: one file each in geometries/, beside the package in a checkout, inside it in a wheel.

    Raises
    ------
    MissingError
        If there is no such folder.
    """
    package = Path(__file__).resolve().parents[1]
    folders = [package / "geometries", package.parent / "geometries"]
    folder = next((f for f in folders if f.is_dir()), None)
    if folder is None:
        raise MissingError(f"no folder of designs: looked for {folders[0]} and {folders[1]}; reinstall finger3d")
    found: dict[str, type] = {}
    for file in sorted(folder.glob("[a-z]*.py")):
        module = import_from(folder, "finger3d.geometries", file.stem)
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__ and issubclass(value, ParametricDesign):
                found[value.name] = value
    return found
