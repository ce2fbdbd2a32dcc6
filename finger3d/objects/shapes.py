"""Rigid objects: the shape of the surface that is pressed on the finger.

An object is a height function over the x-z plane, 0 at its lowest point, and one frame of directions.  In small
strain the gap is measured along the frame's normal: vertical, as in the paper, and a plane's own normal when it tilts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Axis = Literal["x", "z"]


class RigidObject(Protocol):
    """What the contact problem asks of an object."""

    @property
    def x_mm(self) -> float:
        """Place of the lowest point along x, mm."""
        ...

    @property
    def z_mm(self) -> float:
        """Place of the lowest point along z, mm."""
        ...

    def height(self, x: Float, z: Float) -> Float:
        """Height (n,) mm of the surface above its lowest point, at x (n,), z (n,) mm; nan where there is no surface."""
        ...

    def frame(self, dim: int) -> Float:
        """Directions (d, d): row 0 the normal into the finger, then the tangents."""
        ...

    def mirrors(self) -> tuple[str, ...]:
        """Axes along which the object is its own mirror image about the finger's middle."""
        ...

    def lowest(self, slide_x: float, slide_z: float) -> tuple[float, float]:
        """Place (x, z) mm of the lowest point after a slide."""
        ...

    def landmarks(self) -> Float:
        """Places (k, 2), x and z mm, of tips and corners that may touch first and that a search could step over."""
        ...


def vertical_frame(dim: int) -> Float:
    """Normal -y, tangents +x and +z."""
    return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]


def _circle(r: Float, radius: float) -> Float:
    # Beyond the equator there is no surface; a steep cone keeps the gap finite and open there.
    inside = np.minimum(r, radius)
    return radius - np.sqrt(radius**2 - inside**2) + 10.0 * np.maximum(r - radius, 0.0)


@dataclass(frozen=True)
class Placed:
    """What objects share: the place (mm) of their lowest point, and the vertical frame."""

    x_mm: float = 0.0
    z_mm: float = 0.0

    def frame(self, dim: int) -> Float:
        """Vertical normal."""
        return vertical_frame(dim)

    def lowest(self, slide_x: float, slide_z: float) -> tuple[float, float]:
        """The placed point, carried along."""
        return self.x_mm + slide_x, self.z_mm + slide_z

    def landmarks(self) -> Float:
        """The lowest point."""
        return np.array([[self.x_mm, self.z_mm]])

    def _across(self, x: Float, z: Float, axis: Axis) -> Float:
        """Distance (n,) from the object's line along `axis`."""
        return np.abs(x - self.x_mm) if axis == "z" else np.abs(z - self.z_mm)

    def mirrors(self) -> tuple[str, ...]:
        """Mirror axes of a centred object."""
        return tuple(a for a, c in (("x", self.x_mm), ("z", self.z_mm)) if c == 0.0)


@dataclass(frozen=True)
class Plane(Placed):
    """A plane, turned by `tilt` (radians) about z."""

    tilt: float = 0.0

    def height(self, x: Float, z: Float) -> Float:
        """Height above the point (x_mm, z_mm)."""
        return math.tan(self.tilt) * (x - self.x_mm) + 0.0 * z

    def frame(self, dim: int) -> Float:
        """The plane's own normal and tangents."""
        c, s = math.cos(self.tilt), math.sin(self.tilt)
        return np.array([[s, -c, 0.0], [c, s, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]

    def mirrors(self) -> tuple[str, ...]:
        """A level plane is the same everywhere, a tilted one along z."""
        return ("x", "z") if self.tilt == 0.0 else ("z",)

    def lowest(self, slide_x: float, slide_z: float) -> tuple[float, float]:
        """A plane that slides in itself has no point to carry along."""
        return self.x_mm, self.z_mm


@dataclass(frozen=True)
class Cylinder(Placed):
    """A round bar along `axis`."""

    radius_mm: float = 1.0
    axis: Axis = "z"

    def height(self, x: Float, z: Float) -> Float:
        """Circle across the axis."""
        return _circle(self._across(x, z, self.axis), self.radius_mm)

    def mirrors(self) -> tuple[str, ...]:
        """Invariant along its axis."""
        return tuple(sorted({self.axis, *super().mirrors()}))


@dataclass(frozen=True)
class Sphere(Placed):
    """A ball."""

    radius_mm: float = 1.0

    def height(self, x: Float, z: Float) -> Float:
        """Circle around the lowest point."""
        return _circle(np.hypot(x - self.x_mm, z - self.z_mm), self.radius_mm)


@dataclass(frozen=True)
class Wedge(Placed):
    """An edge along `axis`; `angle` (radians) between a face and the horizontal, tip rounded by a circle."""

    angle: float = math.pi / 6
    tip_radius_mm: float = 0.0
    axis: Axis = "z"

    def height(self, x: Float, z: Float) -> Float:
        """Tip circle, then the tangent face."""
        r = self._across(x, z, self.axis)
        edge = self.tip_radius_mm * math.sin(self.angle)
        tip = self.tip_radius_mm - np.sqrt(self.tip_radius_mm**2 - np.minimum(r, edge) ** 2)
        return tip + math.tan(self.angle) * np.maximum(r - edge, 0.0)

    def mirrors(self) -> tuple[str, ...]:
        """Invariant along its axis."""
        return tuple(sorted({self.axis, *super().mirrors()}))


@dataclass(frozen=True)
class Wave(Placed):
    """A cosine of `amplitude_mm` (half of peak to valley) with crests along `axis`, lowest at (x_mm, z_mm)."""

    wavelength_mm: float = 1.0
    amplitude_mm: float = 0.1
    axis: Axis = "z"

    def height(self, x: Float, z: Float) -> Float:
        """amplitude (1 - cos(2 pi r / wavelength))."""
        r = self._across(x, z, self.axis)
        return self.amplitude_mm * (1.0 - np.cos(2.0 * math.pi * r / self.wavelength_mm))

    def mirrors(self) -> tuple[str, ...]:
        """Invariant along its crests."""
        return tuple(sorted({self.axis, *super().mirrors()}))
