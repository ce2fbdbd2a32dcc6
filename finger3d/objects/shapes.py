"""Rigid objects with an analytic surface.

An object is a height function over the x-z plane, 0 at its lowest point, and one frame of directions.  In small
strain the gap is measured along the frame's normal: vertical, as in the paper, and a plane's own normal when it tilts.

The fields of an object's dataclass are its keys under ``[object]`` in a scene; an angle (`Radians`) is given there in
degrees.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Annotated, Literal, NamedTuple

import numpy as np
from annotated_types import Gt, Lt

from finger3d._ranges import Length, Place, Radians, Zero
from finger3d._types import Float

Axis = Literal["x", "z"]


class Detail(NamedTuple):
    """The shortest length of an object's surface, which the contact points must resolve.

    Attributes
    ----------
    key : name of the object's field
    length_mm : its value
    kind : radius of curvature, or wavelength
    """

    key: str
    length_mm: float
    kind: Literal["radius", "wavelength"]


def vertical_frame(dim: int) -> Float:
    """Normal -y, tangents +x and +z."""
    return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]


def _circle(r: Float, radius: float) -> Float:
    # Beyond the equator there is no surface; a steep cone keeps the gap finite and open there.
    inside = np.minimum(r, radius)
    return radius - np.sqrt(radius**2 - inside**2) + 10.0 * np.maximum(r - radius, 0.0)


@dataclass(frozen=True)
class RigidObject(ABC):
    """A rigid object, by default with a vertical gap and one lowest point.

    Attributes
    ----------
    x_mm, z_mm : where the object's lowest point is
    """

    x_mm: Place = 0.0
    z_mm: Place = 0.0

    @abstractmethod
    def height(self, x: Float, z: Float) -> Float:
        """Return the height (n,) mm of the surface above its lowest point at x (n,), z (n,) mm; nan where there is no
        surface.
        """

    def frame(self, dim: int) -> Float:
        """Return the directions (d, d): row 0 the normal into the finger, then the tangents."""
        return vertical_frame(dim)

    def mirrors(self) -> tuple[str, ...]:
        """Return the axes along which the object is its own mirror image about the finger's middle."""
        return tuple(a for a, c in (("x", self.x_mm), ("z", self.z_mm)) if c == 0.0)

    def lowest(self, slide_x: float, slide_z: float) -> tuple[float, float]:
        """Return the place (x, z) mm of the lowest point after a slide."""
        return self.x_mm + slide_x, self.z_mm + slide_z

    def landmarks(self) -> Float:
        """Return the places (k, 2), x and z mm, of tips and corners that may touch first and that a search on a grid
        could miss.
        """
        return np.array([[self.x_mm, self.z_mm]])

    @property
    def is_flat(self) -> bool:
        """Whether the surface is one plane."""
        return False

    @property
    def detail(self) -> Detail | None:
        """The shortest length of the surface, or None."""
        return None

    def read(self) -> RigidObject:
        """Return the object that a scene's table stands for: the object itself, unless a file holds it."""
        return self


class Prism(RigidObject):
    """An object whose section is the same all along its field `axis`."""

    axis: Axis

    def across(self, x: Float, z: Float) -> Float:
        """Return the distance (n,) mm from the line of lowest points."""
        return np.abs(x - self.x_mm) if self.axis == "z" else np.abs(z - self.z_mm)

    def mirrors(self) -> tuple[str, ...]:
        """Return both axes if the object is centred, else the one along which it is constant."""
        return tuple(sorted({self.axis, *super().mirrors()}))


@dataclass(frozen=True)
class Plane(RigidObject):
    """A plane.

    Attributes
    ----------
    tilt : about z
    """

    tilt: Annotated[float, Radians(Gt(-90), Lt(90))] = 0.0

    def height(self, x: Float, z: Float) -> Float:
        """Return the height above the point (x_mm, z_mm)."""
        return math.tan(self.tilt) * (x - self.x_mm) + 0.0 * z

    def frame(self, dim: int) -> Float:
        """Return the plane's own normal and tangents."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        return np.array([[s, -c, 0.0], [c, s, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]

    def mirrors(self) -> tuple[str, ...]:
        """Return both axes for a level plane, z for a tilted one."""
        return ("x", "z") if self.tilt == 0.0 else ("z",)

    def lowest(self, slide_x: float, slide_z: float) -> tuple[float, float]:
        """Return the placed point: a plane that slides in itself stays what it is."""
        return self.x_mm, self.z_mm

    @property
    def is_flat(self) -> bool:
        """Whether the surface is one plane: yes."""
        return True


@dataclass(frozen=True)
class Cylinder(Prism):
    """A circular cylinder.

    Attributes
    ----------
    radius_mm : radius
    axis : direction of the cylinder's line
    """

    radius_mm: Length = field(kw_only=True)
    axis: Axis = field(default="z", kw_only=True)

    def height(self, x: Float, z: Float) -> Float:
        """Return the height of the circle across the axis."""
        return _circle(self.across(x, z), self.radius_mm)

    @property
    def detail(self) -> Detail:
        """The radius."""
        return Detail("radius_mm", self.radius_mm, "radius")


@dataclass(frozen=True)
class Sphere(RigidObject):
    """A sphere.

    Attributes
    ----------
    radius_mm : radius
    """

    radius_mm: Length = field(kw_only=True)

    def height(self, x: Float, z: Float) -> Float:
        """Return the height of the circle around the lowest point."""
        return _circle(np.hypot(x - self.x_mm, z - self.z_mm), self.radius_mm)

    @property
    def detail(self) -> Detail:
        """The radius."""
        return Detail("radius_mm", self.radius_mm, "radius")


@dataclass(frozen=True)
class Wedge(Prism):
    """An edge between two faces, rounded by a circle.

    Attributes
    ----------
    angle : between a face and the horizontal
    tip_radius_mm : of the rounded edge
    axis : direction of the edge
    """

    angle: Annotated[float, Radians(Gt(0), Lt(90))] = field(kw_only=True)
    tip_radius_mm: Zero | Length = field(default=0.0, kw_only=True)
    axis: Axis = field(default="z", kw_only=True)

    def height(self, x: Float, z: Float) -> Float:
        """Return the height of the tip's circle and of the face tangent to it."""
        r = self.across(x, z)
        edge = self.tip_radius_mm * math.sin(self.angle)
        tip = self.tip_radius_mm - np.sqrt(self.tip_radius_mm**2 - np.minimum(r, edge) ** 2)
        return tip + math.tan(self.angle) * np.maximum(r - edge, 0.0)

    @property
    def detail(self) -> Detail | None:
        """The radius of a rounded tip."""
        return Detail("tip_radius_mm", self.tip_radius_mm, "radius") if self.tip_radius_mm > 0.0 else None


@dataclass(frozen=True)
class Wave(Prism):
    """A cosine, lowest at (x_mm, z_mm): height = amplitude (1 - cos(2 pi r / wavelength)).

    Attributes
    ----------
    wavelength_mm : from crest to crest
    amplitude_mm : half of crest to valley
    axis : direction of the crests
    """

    wavelength_mm: Length = field(kw_only=True)
    amplitude_mm: Zero | Length = field(kw_only=True)
    axis: Axis = field(default="z", kw_only=True)

    def height(self, x: Float, z: Float) -> Float:
        """Return amplitude (1 - cos(2 pi r / wavelength)), r the distance from a valley's line."""
        return self.amplitude_mm * (1.0 - np.cos(2.0 * math.pi * self.across(x, z) / self.wavelength_mm))

    @property
    def detail(self) -> Detail:
        """The wavelength."""
        return Detail("wavelength_mm", self.wavelength_mm, "wavelength")
