"""Rigid objects with an analytic surface."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

import numpy as np
from annotated_types import Gt, Lt

from finger3d._ranges import Length, Radians, Zero
from finger3d._types import Float
from finger3d.geometry.design import Design, designs
from finger3d.geometry.surface import Triangles
from finger3d.objects.rigid import CROSSWISE, DRAWN, Axis, Detail, HeldBody, Prism, RigidObject, sheet

_LEVEL = 1e-12
"""Sine of an angle below which an edge or a face is level."""


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
        return sheet(np.stack([x, self.profile(x, z), z], axis=-1))


@dataclass(frozen=True)
class Cylinder(Prism):
    """A circular cylinder.

    Attributes
    ----------
    radius_mm : radius
    axis : direction of the cylinder's line
    length_mm : of a closed cylinder; endless unless given
    """

    is_face: ClassVar[bool] = False

    radius_mm: Length = field(kw_only=True)
    axis: Axis = field(default="z", kw_only=True)
    length_mm: Length | None = field(default=None, kw_only=True)

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance in the section across the axis, and beyond the flat ends of a closed cylinder."""
        side, gradient = super().distance(points)
        if self.length_mm is None:
            return side, gradient
        along = points @ self.direction
        end = np.abs(along) - 0.5 * self.length_mm
        outward = np.sign(along)[:, None] * self.direction
        beside_rim, beyond = (side > 0.0) & (end > 0.0), end > side
        value, to_rim = np.where(beyond, end, side), np.hypot(side, end)
        value[beside_rim] = to_rim[beside_rim]
        normal = np.where(beyond[:, None], outward, gradient)
        both = side[:, None] * gradient + end[:, None] * outward
        normal[beside_rim] = both[beside_rim] / to_rim[beside_rim, None]
        return value, normal

    def profile(self, x: Float, z: Float) -> Float:
        """Return the height of the section; nan beyond the ends."""
        along = x if self.axis == "x" else z
        return np.where(np.abs(along) <= 0.5 * (self.length_mm or np.inf), super().profile(x, z), np.nan)

    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the distance to a circle."""
        return _circle_distance(r, y, self.radius_mm)

    def mean_chord(self, direction: Float) -> float:
        """Return the mean chord of a circle, lengthened by the angle to the axis, or that of a closed cylinder."""
        along = abs(float(direction @ self.direction))
        across = math.sqrt(max(1.0 - along**2, 0.0))
        if self.length_mm is not None:
            disc = math.pi * self.radius_mm**2
            return disc * self.length_mm / (2.0 * self.radius_mm * self.length_mm * across + disc * along)
        return 0.5 * math.pi * self.radius_mm / across if across > 0.0 else math.inf

    def section_profile(self, r: Float) -> Float:
        """Return the height of the lower half of the circle."""
        return _arc(r, self.radius_mm)

    def lowest_point(self, turned: Float) -> Float:
        """Return the point of the circle that is lowest, if the axis is horizontal, or that of a closed cylinder."""
        if self.is_level(turned):
            return _lowest_of_sphere(turned, self.radius_mm)
        if self.length_mm is None:
            return np.zeros(3)
        down = -turned[1]
        along = float(down @ self.direction)
        across = down - along * self.direction
        rim = np.linalg.norm(across)
        side = across * (self.radius_mm / rim if rim > _LEVEL else 0.0)
        return np.asarray(
            [0.0, self.radius_mm, 0.0] + side + math.copysign(0.5 * self.length_mm, along) * self.direction
        )

    @property
    def detail(self) -> Detail:
        """The radius."""
        return Detail("radius_mm", self.radius_mm, "radius")

    def held_body(self, finger: Design, solid: bool) -> HeldBody:
        """Return the lower half, held on its cut; a section along the axis is a rectangle."""
        catalogue = designs()
        half, width = finger.half_length_mm, finger.width_mm
        if self.axis == "z":
            along_z = catalogue["half_cylinder"](radius_mm=self.radius_mm, width_mm=width)
            return HeldBody(design=along_z, place=np.array([self.x_mm, 0.0, 0.0]))
        if not solid:
            return HeldBody(design=catalogue["block"](half_length_mm=half, height_mm=self.radius_mm, width_mm=width))
        along_x = catalogue["half_cylinder"](radius_mm=self.radius_mm, width_mm=2.0 * half)
        return HeldBody(design=along_x, turn=CROSSWISE, place=np.array([0.0, 0.0, self.z_mm]))

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the mantle, all around if its radius is within the reach, and the ends of a closed cylinder."""
        polar = _polar(self.radius_mm, reach_mm)
        r, y = self.radius_mm * np.sin(polar), self.radius_mm * (1.0 - np.cos(polar))
        if self.length_mm is None:
            return self._swept(r, y, reach_mm)
        half = 0.5 * self.length_mm
        # shares of the radius, from the middle of one end over the mantle to that of the other
        shares = np.array([[0.0], [1.0], [1.0], [0.0]])
        level = self.radius_mm + shares * (y - self.radius_mm)
        along = np.broadcast_to(np.array([-half, -half, half, half])[:, None], level.shape)
        ring = np.stack([shares * r, level, along], axis=-1)
        return sheet(ring[::-1] if self.axis == "z" else ring[..., ::-1])


@dataclass(frozen=True)
class Sphere(RigidObject):
    """A sphere.

    Attributes
    ----------
    radius_mm : radius
    """

    is_face: ClassVar[bool] = False
    body_mesher: ClassVar[Literal["ftetwild", "swept"]] = "ftetwild"

    radius_mm: Length = field(kw_only=True)

    @property
    def is_turned(self) -> bool:
        """False: no turn changes a sphere."""
        return False

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance to the sphere."""
        r = np.hypot(points[:, 0], points[:, 2])
        value, by_r, by_y = _circle_distance(r, points[:, 1], self.radius_mm)
        radial = points[:, ::2] * (by_r / np.where(r > 0.0, r, 1.0))[:, None]
        return value, np.stack([radial[:, 0], by_y, radial[:, 1]], axis=1)

    def mean_chord(self, direction: Float) -> float:
        """Return the mean chord of a sphere."""
        return 4.0 / 3.0 * self.radius_mm

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

    def held_body(self, finger: Design, solid: bool) -> HeldBody:
        """Return the lower half, held on its cut; in a section half a disc."""
        if solid:
            place = np.array([self.x_mm, 0.0, self.z_mm])
            return HeldBody(design=designs()["hemisphere"](self.radius_mm), place=place, mesher=self.body_mesher)
        disc = designs()["half_cylinder"](radius_mm=self.radius_mm, width_mm=finger.width_mm)
        return HeldBody(design=disc, place=np.array([self.x_mm, 0.0, self.z_mm]))

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the sphere, or its lowest part if its radius exceeds the reach."""
        polar = _polar(self.radius_mm, reach_mm)[DRAWN // 2 :: 4]
        turn = np.linspace(0.0, 2.0 * math.pi, 49)
        r, y = self.radius_mm * np.sin(polar), self.radius_mm * (1.0 - np.cos(polar))
        level = np.broadcast_to(y[:, None], (len(polar), len(turn)))
        return sheet(np.stack([np.outer(r, np.cos(turn)), level, np.outer(r, np.sin(turn))], axis=-1))


@dataclass(frozen=True)
class Box(RigidObject):
    """A box, with its lowest face at the bottom.

    Attributes
    ----------
    size_mm : lengths along x, y and z
    """

    is_face: ClassVar[bool] = False

    size_mm: tuple[Length, Length, Length] = field(kw_only=True)

    @property
    def _half(self) -> Float:
        return 0.5 * np.array(self.size_mm)

    @property
    def _centre(self) -> Float:
        return np.array([0.0, 0.5 * self.size_mm[1], 0.0])

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance to the nearest face, edge or corner."""
        from_centre = points - self._centre
        beyond, sign = np.abs(from_centre) - self._half, np.where(from_centre < 0.0, -1.0, 1.0)
        out = np.maximum(beyond, 0.0)
        length, nearest = np.linalg.norm(out, axis=1), beyond.argmax(axis=1)
        outside = length > 0.0
        face = np.eye(3)[nearest]
        towards = np.where(outside[:, None], out / np.where(outside, length, 1.0)[:, None], face)
        return np.where(outside, length, beyond.max(axis=1)), sign * towards

    def mean_chord(self, direction: Float) -> float:
        """Return the volume over the projected area."""
        volume = math.prod(self.size_mm)
        return volume / float(np.abs(direction) @ (volume / np.array(self.size_mm)))

    def profile(self, x: Float, z: Float) -> Float:
        """Return the height of the lower face, 0."""
        return np.where((np.abs(x) <= self._half[0]) & (np.abs(z) <= self._half[2]), 0.0, np.nan)

    def lowest_point(self, turned: Float) -> Float:
        """Return the lowest corner after a rotation, or the middle of the lowest edge or face."""
        down = np.where(np.abs(turned[1]) > _LEVEL, -np.sign(turned[1]), 0.0)
        return np.asarray(self._centre + down * self._half)

    def landmarks(self) -> Float:
        """Return the corners."""
        corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.asarray(self._centre + corners * self._half)

    @property
    def probe_reach(self) -> float:
        """Half edge length (mm) of the box of `probes`: the longest side."""
        return max(self.size_mm)

    @property
    def has_edges(self) -> bool:
        """Whether contact may end at sharp edges of the object: yes."""
        return True

    @property
    def held_height_mm(self) -> float:
        """Height (mm) of the box."""
        return self.size_mm[1]

    def drawing(self, reach_mm: float) -> Triangles:
        """Return the faces."""
        corners, faces = self.landmarks(), []
        for axis, step in enumerate((4, 2, 1)):
            others = [s for s in (4, 2, 1) if s != step]
            for first in (0, step):
                a, b, c, d = first, first + others[0], first + others[0] + others[1], first + others[1]
                turn = (a, b, c, d) if (first > 0) == (axis != 1) else (a, d, c, b)
                faces += [(turn[0], turn[1], turn[2]), (turn[0], turn[2], turn[3])]
        return Triangles(corners, np.array(faces))


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
        c, s = math.cos(self.angle), math.sin(self.angle)
        side = np.where(r < 0.0, -1.0, 1.0)
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


def _polar(radius: float, reach: float) -> Float:
    """Return angles (n,) rad from the lowest point of a circle, both ways, as far as its points are within a reach."""
    most = math.pi if radius <= reach else math.asin(reach / radius)
    return np.linspace(-most, most, DRAWN)


def _arc(r: Float, radius: float) -> Float:
    """Return the height (n,) of the lower half of a circle above its lowest point; nan beyond the equator."""
    inside = np.where(np.abs(r) <= radius, r, np.nan)
    return inside**2 / (radius + np.sqrt(radius**2 - inside**2)) if radius > 0.0 else 0.0 * inside


def _circle_distance(r: Float, y: Float, radius: float) -> tuple[Float, Float, Float]:
    """Return the signed distance (n,) from a circle whose lowest point is the origin, and its derivatives."""
    out = y - radius
    length = np.hypot(r, out)
    regular = length > 0.0
    divisor = np.where(regular, length, 1.0)
    # length - radius would lose the digits of points near a large circle
    total = np.where(length + radius > 0.0, length + radius, 1.0)
    return (
        (r**2 + y**2 - 2.0 * y * radius) / total,
        np.where(regular, r / divisor, 0.0),
        np.where(regular, out / divisor, -1.0),
    )


def _lowest_of_sphere(turned: Float, radius: float) -> Float:
    """Return the point (3,) of a sphere above the origin that is lowest after a rotation."""
    return np.asarray([0.0, radius, 0.0] - radius * turned[1])


_NEAREST_STARTS = 17, 65
"""Points over one wavelength from which the nearest point is searched: of a wave with slopes up to 1, and of others."""

_NEAREST_ITERATIONS = 60
"""Largest number of bisected Newton steps of that search."""


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

    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the distance to the nearest point, found by Newton's method between the best of many starts."""
        nearest = self._nearest(r, y)
        height, slope = self.section_profile(nearest), self._slope(nearest)
        out_r, out_y = r - nearest, y - height
        root = np.sqrt(1.0 + slope**2)
        sign = np.where(y > self.section_profile(r), -1.0, 1.0)
        # The normal of the nearest point is the gradient, on the surface too, where the difference is round-off.
        return sign * np.hypot(out_r, out_y), slope / root, -1.0 / root

    def clearance(self, points: Float) -> Float:
        """Return the vertical distance over that of the steepest slope: far quicker than the nearest point."""
        r = points[:, 2 if self.axis == "x" else 0]
        return np.asarray((self.section_profile(r) - points[:, 1]) / math.hypot(1.0, self._steepest))

    def section_profile(self, r: Float) -> Float:
        """Return amplitude (1 - cos(2 pi r / wavelength))."""
        return self.amplitude_mm * (1.0 - np.cos(self._wavenumber * r))

    @property
    def _wavenumber(self) -> float:
        return 2.0 * math.pi / self.wavelength_mm

    @property
    def _steepest(self) -> float:
        return self.amplitude_mm * self._wavenumber

    def _slope(self, r: Float) -> Float:
        return self._steepest * np.sin(self._wavenumber * r)

    def _nearest(self, r: Float, y: Float) -> Float:
        """Return where (n,) the curve is nearest to points: a root of f(s) = s - r + (h(s) - y) h'(s)."""
        count = _NEAREST_STARTS[bool(self._steepest > 1.0)]
        starts = r[:, None] + np.linspace(-0.5, 0.5, count) * self.wavelength_mm
        square = (starts - r[:, None]) ** 2 + (self.section_profile(starts) - y[:, None]) ** 2
        best = np.clip(square.argmin(axis=1), 1, count - 2)
        number = np.arange(len(r))
        low, high, s = (starts[number, best + i].copy() for i in (-1, 1, 0))
        for _ in range(_NEAREST_ITERATIONS):
            height, slope = self.section_profile(s), self._slope(s)
            f = s - r + (height - y) * slope
            bend = 1.0 + slope**2 + (height - y) * self._steepest * self._wavenumber * np.cos(self._wavenumber * s)
            low, high = np.where(f < 0.0, s, low), np.where(f < 0.0, high, s)
            newton = s - f / np.where(bend > 0.0, bend, 1.0)
            inside = (bend > 0.0) & (newton > low) & (newton < high)
            after = np.where(inside, newton, 0.5 * (low + high))
            change = np.abs(after - s).max(initial=0.0)
            s = after
            if change <= 1e-15 * (self.wavelength_mm + float(np.abs(r).max(initial=0.0))):
                break
        return np.asarray(s)

    @property
    def is_convex(self) -> bool:
        """Whether the body is convex: only without amplitude."""
        return self.amplitude_mm == 0.0

    @property
    def detail(self) -> Detail:
        """The wavelength."""
        return Detail("wavelength_mm", self.wavelength_mm, "wavelength")
