"""Rigid objects with an analytic surface.

An object is a closed or endless body, given by its signed distance in coordinates of its own: y up, its reference
point, which is its lowest one, at the origin.  `finger3d.objects.placed.PlacedObject` is an object in a pose.

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

from finger3d._ranges import Length, Place, Radians, Turn, Zero
from finger3d._types import Float
from finger3d.geometry.surface import Triangles

Axis = Literal["x", "z"]


_DRAWN = 201
"""Points of a section in a picture."""


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
    """Return the directions (d, d) of an upright object: normal -y into the finger, then tangents +x and +z."""
    return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])[:dim, :dim]


def rotation(turn_x: float, turn_y: float, turn_z: float) -> Float:
    """Return the rotation (3, 3) about x, then y, then z, all fixed axes; angles in radians."""
    turned = np.eye(3)
    for axis, angle in enumerate((turn_x, turn_y, turn_z)):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        about = np.eye(3)
        about[i, i] = about[j, j] = math.cos(angle)
        about[j, i] = math.sin(angle)
        about[i, j] = -about[j, i]
        if angle:
            turned = about @ turned
    return turned


@dataclass(frozen=True)
class RigidObject(ABC):
    """A rigid object.

    Attributes
    ----------
    x_mm, z_mm : where the object's lowest point is
    turn_x, turn_y, turn_z : pose that it comes in, turned about x, then y, then z, all fixed axes
    """

    x_mm: Place = 0.0
    z_mm: Place = 0.0
    turn_x: Turn = field(default=0.0, kw_only=True)
    turn_y: Turn = field(default=0.0, kw_only=True)
    turn_z: Turn = field(default=0.0, kw_only=True)

    @abstractmethod
    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the signed distance (n,) mm of points (n, 3), negative inside, and its gradient (n, 3), a unit vector.

        The points are given in the object's own coordinates.
        """

    def clearance(self, points: Float) -> Float:
        """Return a lower bound (n,) mm of the distance of points (n, 3), and at most it where that is negative."""
        return self.distance(points)[0]

    @abstractmethod
    def profile(self, x: Float, z: Float) -> Float:
        """Return the height (n,) mm of the lower side at x, z (n,) mm, in own coordinates; nan beside it."""

    def lowest_point(self, turned: Float) -> Float:
        """Return the point (3,) mm, in own coordinates, that is lowest after a rotation (3, 3).

        It is the reference point for a body that then extends downwards without end.
        """
        return np.zeros(3)

    def probes(self) -> Float:
        """Return points (k, 3) mm, in own coordinates, at which mirror images are compared."""
        return np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3)) * self.probe_reach

    @property
    def probe_reach(self) -> float:
        """Half edge length (mm) of the box of `probes`."""
        return self.detail.length_mm if self.detail else 10.0

    @property
    def initial_rotation(self) -> Float:
        """Rotation (3, 3) of the pose that the object comes in."""
        return rotation(self.turn_x, self.turn_y, self.turn_z)

    @property
    def is_turned(self) -> bool:
        """Whether the object comes in a pose of its own."""
        return bool(self.turn_x or self.turn_y or self.turn_z)

    def landmarks(self) -> Float:
        """Return points (k, 3) mm, in own coordinates, of tips and corners that may touch first."""
        return np.zeros((1, 3))

    @property
    def is_flat(self) -> bool:
        """Whether the surface is one plane."""
        return False

    @property
    def is_convex(self) -> bool:
        """Whether the body is convex."""
        return True

    @property
    def detail(self) -> Detail | None:
        """The shortest length of the surface, or None."""
        return None

    @abstractmethod
    def drawing(self, reach_mm: float) -> Triangles:
        """Return triangles, in own coordinates, for pictures: of an endless surface, the part within +-reach_mm."""

    def read(self) -> RigidObject:
        """Return the object that a scene's table stands for: the object itself, unless a file holds it."""
        return self


class Prism(RigidObject):
    """An object whose section is the same all along its field `axis`."""

    axis: Axis

    @property
    def direction(self) -> Float:
        """Unit vector (3,) of the axis."""
        return np.array([1.0, 0.0, 0.0] if self.axis == "x" else [0.0, 0.0, 1.0])

    @abstractmethod
    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the signed distance (n,) and its derivatives (n,) by r and y, in the section across the axis."""

    @abstractmethod
    def section_profile(self, r: Float) -> Float:
        """Return the height (n,) of the lower side at a distance r (n,) from the line of lowest points."""

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance in the section across the axis."""
        across = 2 if self.axis == "x" else 0
        value, by_r, by_y = self.section_distance(points[:, across], points[:, 1])
        gradient = np.zeros_like(points)
        gradient[:, across], gradient[:, 1] = by_r, by_y
        return value, gradient

    def profile(self, x: Float, z: Float) -> Float:
        """Return the height of the section."""
        return self.section_profile(x + 0.0 * z if self.axis == "z" else z + 0.0 * x)

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the lower side."""
        r = np.linspace(-reach_mm, reach_mm, _DRAWN)
        return self._swept(r, self.section_profile(r), reach_mm)

    def _swept(self, r: Float, y: Float, reach: float) -> Triangles:
        """Return a curve (n,) of the section, swept along the axis."""
        grid = np.stack([np.stack([r, y, 0.0 * r + end], axis=-1) for end in (-reach, reach)], axis=1)
        return _sheet(grid if self.axis == "z" else grid[..., ::-1])

    def is_level(self, turned: Float) -> bool:
        """Whether the axis is horizontal after a rotation (3, 3)."""
        return abs(float((turned @ self.direction)[1])) <= 1e-12


@dataclass(frozen=True)
class Plane(RigidObject):
    """A plane: all that is above it is the object.

    Attributes
    ----------
    tilt : about z
    """

    tilt: Annotated[float, Radians(Gt(-90), Lt(90))] = 0.0

    @property
    def normal(self) -> Float:
        """Outward unit normal (3,) in own coordinates."""
        return np.array([math.sin(self.tilt), -math.cos(self.tilt), 0.0])

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance along the plane's normal."""
        return points @ self.normal, np.broadcast_to(self.normal, points.shape)

    def profile(self, x: Float, z: Float) -> Float:
        """Return the height above the reference point."""
        return math.tan(self.tilt) * x + 0.0 * z

    @property
    def is_flat(self) -> bool:
        """Whether the surface is one plane: yes."""
        return True

    def drawing(self, reach_mm: float) -> Triangles:
        """Return a square."""
        x, z = np.meshgrid([-reach_mm, reach_mm], [-reach_mm, reach_mm], indexing="ij")
        return _sheet(np.stack([x, self.profile(x, z), z], axis=-1))


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

    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the distance to a circle."""
        return _circle_distance(r, y, self.radius_mm)

    def section_profile(self, r: Float) -> Float:
        """Return the height of the lower half of the circle."""
        return _arc(r, self.radius_mm)

    def lowest_point(self, turned: Float) -> Float:
        """Return the point of the circle that is lowest, if the axis is horizontal."""
        return _lowest_of_sphere(turned, self.radius_mm) if self.is_level(turned) else np.zeros(3)

    @property
    def detail(self) -> Detail:
        """The radius."""
        return Detail("radius_mm", self.radius_mm, "radius")

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the mantle, all around if its radius is within the reach."""
        polar = _polar(self.radius_mm, reach_mm)
        return self._swept(self.radius_mm * np.sin(polar), self.radius_mm * (1.0 - np.cos(polar)), reach_mm)


@dataclass(frozen=True)
class Sphere(RigidObject):
    """A sphere.

    Attributes
    ----------
    radius_mm : radius
    """

    radius_mm: Length = field(kw_only=True)

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance to the sphere."""
        r = np.hypot(points[:, 0], points[:, 2])
        value, by_r, by_y = _circle_distance(r, points[:, 1], self.radius_mm)
        radial = points[:, ::2] * (by_r / np.where(r > 0.0, r, 1.0))[:, None]
        return value, np.stack([radial[:, 0], by_y, radial[:, 1]], axis=1)

    def profile(self, x: Float, z: Float) -> Float:
        """Return the height of the lower half."""
        return _arc(np.hypot(x, z), self.radius_mm)

    def lowest_point(self, turned: Float) -> Float:
        """Return the point that is lowest after a rotation."""
        return _lowest_of_sphere(turned, self.radius_mm)

    @property
    def detail(self) -> Detail:
        """The radius."""
        return Detail("radius_mm", self.radius_mm, "radius")

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the sphere, or its lowest part if its radius exceeds the reach."""
        polar, turn = _polar(self.radius_mm, reach_mm)[_DRAWN // 2 :: 4], np.linspace(0.0, 2.0 * math.pi, 49)
        r, y = self.radius_mm * np.sin(polar), self.radius_mm * (1.0 - np.cos(polar))
        level = np.broadcast_to(y[:, None], (len(polar), len(turn)))
        return _sheet(np.stack([np.outer(r, np.cos(turn)), level, np.outer(r, np.sin(turn))], axis=-1))


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

    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the distance to a sharp edge through the circle's middle, less the circle's radius."""
        c, s, side = math.cos(self.angle), math.sin(self.angle), np.where(r < 0.0, -1.0, 1.0)
        y = y - self.tip_radius_mm
        along = c * np.abs(r) + s * y
        value, by_r, by_y = _circle_distance(r, y + self.tip_radius_mm, self.tip_radius_mm)
        on_face = along > 0.0
        value = np.where(on_face, s * np.abs(r) - c * y - self.tip_radius_mm, value)
        return value, np.where(on_face, s * side, by_r), np.where(on_face, -c, by_y)

    def section_profile(self, r: Float) -> Float:
        """Return the height of the tip's circle and of the face tangent to it."""
        r = np.abs(r)
        edge = self.tip_radius_mm * math.sin(self.angle)
        return _arc(np.minimum(r, edge), self.tip_radius_mm) + math.tan(self.angle) * np.maximum(r - edge, 0.0)

    def lowest_point(self, turned: Float) -> Float:
        """Return the point of the tip's circle that is lowest, if both faces rise from it."""
        lowest = _lowest_of_sphere(turned, self.tip_radius_mm)
        down = -turned[1]
        rises = math.cos(self.angle) <= -float(down[1]) if self.is_level(turned) else False
        return lowest if rises else np.zeros(3)

    @property
    def detail(self) -> Detail | None:
        """The radius of a rounded tip."""
        return Detail("tip_radius_mm", self.tip_radius_mm, "radius") if self.tip_radius_mm > 0.0 else None


def _sheet(points: Float) -> Triangles:
    """Return the triangles of a grid of points (m, n, 3)."""
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = (number[i : i - 1 or None, j : j - 1 or None] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2)
    return Triangles(points.reshape(-1, 3), faces.reshape(-1, 3))


def _polar(radius: float, reach: float) -> Float:
    """Return angles (n,) rad from the lowest point of a circle, both ways, as far as its points are within a reach."""
    most = math.pi if radius <= reach else math.asin(reach / radius)
    return np.linspace(-most, most, _DRAWN)


def _arc(r: Float, radius: float) -> Float:
    """Return the height (n,) of the lower half of a circle above its lowest point; nan beyond the equator."""
    inside = np.where(np.abs(r) <= radius, r, np.nan)
    return inside**2 / (radius + np.sqrt(radius**2 - inside**2)) if radius > 0.0 else 0.0 * inside


def _circle_distance(r: Float, y: Float, radius: float) -> tuple[Float, Float, Float]:
    """Return the signed distance (n,) from a circle whose lowest point is the origin, and its derivatives."""
    out = y - radius
    length = np.hypot(r, out)
    known = length > 0.0
    divisor = np.where(known, length, 1.0)
    # length - radius would lose the digits of points near a large circle
    total = np.where(length + radius > 0.0, length + radius, 1.0)
    return (
        (r**2 + y**2 - 2.0 * y * radius) / total,
        np.where(known, r / divisor, 0.0),
        np.where(known, out / divisor, -1.0),
    )


def _lowest_of_sphere(turned: Float, radius: float) -> Float:
    """Return the point (3,) of a sphere above the origin that is lowest after a rotation."""
    return np.asarray([0.0, radius, 0.0] - radius * turned[1])
