"""Rigid objects: the interface that every shape implements, and what shapes with a constant section share.

An object is a closed or endless body, given by its signed distance in coordinates of its own: y up, its reference
point, which is its lowest one, at the origin.  `finger3d.objects.placed.PlacedObject` is an object in a pose.

The fields of an object's dataclass are its keys under ``[object]`` in a scene; an angle (`Radians`) is given there in
degrees.

Where an object is elastic, its body is meshed: a design turned towards the finger.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np

from finger3d._ranges import Place, Turn
from finger3d._types import Float, freeze_arrays
from finger3d.geometry.design import Design
from finger3d.geometry.surface import Triangles

UPSIDE_DOWN = np.diag([1.0, -1.0, 1.0])
"""Reflection that turns a design's contact face down and leaves its symmetry planes."""

CROSSWISE = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
"""Rotation that turns a design's contact face down and its width along x."""

HALF_TURN = np.diag([-1.0, -1.0, 1.0])
"""Half a turn about z."""


@dataclass(frozen=True, kw_only=True)
class HeldBody:
    """Body of an object as a design, which is held on its base.

    A point p (3,) of the design is at ``turn @ (p - origin) + place`` in the scene.

    Attributes
    ----------
    design : its contact face is that of the object
    turn : (3, 3) array
        One of `UPSIDE_DOWN`, `CROSSWISE` and `HALF_TURN`.
    origin, place : (3,) arrays, mm
    mesher : of a solid
    is_whole : whether it is meshed whole even where only a part of the finger is
    """

    design: Design
    turn: Float = field(default_factory=UPSIDE_DOWN.copy)
    origin: Float = field(default_factory=lambda: np.zeros(3))
    place: Float = field(default_factory=lambda: np.zeros(3))
    mesher: Literal["ftetwild", "swept"] = "swept"
    is_whole: bool = False

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def to_design(self, points: Float) -> Float:
        """Return points (n, d) of the scene in the coordinates of the design; those of a section lie in its plane."""
        d = points.shape[1]
        return np.asarray((points - self.place[:d]) @ self.turn[:d, :d] + self.origin[:d])

    def to_scene(self, points: Float) -> Float:
        """Return points (n, d) of the design in the scene; those of a section lie in its plane."""
        d = points.shape[1]
        return np.asarray((points - self.origin[:d]) @ self.turn[:d, :d].T + self.place[:d])

    @property
    def is_crosswise(self) -> bool:
        """Whether x and z change places."""
        return bool(self.turn[0, 2])

    @property
    def is_reflected(self) -> bool:
        """Whether the body is a mirror image of the design, whose cells must be turned."""
        return bool(np.linalg.det(self.turn) < 0.0)


Axis = Literal["x", "z"]

DRAWN = 201
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
    turn_x, turn_y, turn_z : orientation at the start: turned about x, then y, then z, all fixed axes

    Constants of the class: `has_section` states whether there is a section at z = 0, `is_face` whether the object is
    the lower face of a body of any height, and `body_mesher` how `held_body` is meshed in 3D.
    """

    has_section: ClassVar[bool] = True
    is_face: ClassVar[bool] = True
    body_mesher: ClassVar[Literal["ftetwild", "swept"]] = "swept"

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
        """Return a bound (n,) mm of the signed distance of points (n, 3), of its sign and at most its magnitude."""
        return self.distance(points)[0]

    def mean_chord(self, direction: Float) -> float:
        """Return the mean length (mm) of the body's chords along a unit vector (3,): volume over projected area.

        It is infinite for a body that is not closed.
        """
        return math.inf

    @abstractmethod
    def profile(self, x: Float, z: Float) -> Float:
        """Return the height (n,) mm of the lower side at x, z (n,) mm, in own coordinates; nan beside it."""

    def lowest_point(self, turned: Float) -> Float:
        """Return the point (3,) mm, in own coordinates, that is lowest after a rotation (3, 3).

        It is the reference point for a body that then extends downwards without end.
        """
        return np.zeros(3)

    @property
    def highest_point(self) -> Float:
        """The point (3,) mm, in own coordinates, that is highest at the start."""
        return self.lowest_point(np.diag([1.0, -1.0, -1.0]) @ self.initial_rotation)

    @property
    def middle(self) -> Float:
        """The middle (3,) mm of a closed body, in own coordinates."""
        return 0.5 * (self.lowest_point(np.eye(3)) + self.lowest_point(np.diag([1.0, -1.0, -1.0])))

    def mirrored(self, x_mm: float, z_mm: float) -> Self:
        """Return the mirror image at a horizontal plane, with its lowest point at another place."""
        return replace(self, x_mm=x_mm, z_mm=z_mm, turn_x=-self.turn_x, turn_z=-self.turn_z)

    def probes(self) -> Float:
        """Return points (k, 3) mm, in own coordinates, at which mirror images are compared."""
        return np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3)) * self.probe_reach

    @property
    def probe_reach(self) -> float:
        """Half edge length (mm) of the box of `probes`."""
        return self.detail.length_mm if self.detail else 10.0

    @property
    def initial_rotation(self) -> Float:
        """Rotation (3, 3) of the object at the start."""
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
    def has_edges(self) -> bool:
        """Whether contact may end at sharp edges of the object."""
        return False

    @property
    def is_convex(self) -> bool:
        """Whether the body is convex."""
        return True

    @property
    def detail(self) -> Detail | None:
        """The shortest length of the surface, or None."""
        return None

    @property
    def held_height_mm(self) -> float:
        """Height (mm) of `held_body`, whose highest plane is held: the radius of a half ball or cylinder."""
        return math.inf if self.is_face or self.detail is None else self.detail.length_mm

    @abstractmethod
    def drawing(self, reach_mm: float) -> Triangles:
        """Return triangles, in own coordinates, for pictures: of an endless surface, the part within +-reach_mm."""

    def held_body(self, finger: Design, solid: bool) -> HeldBody | None:
        """Return the body that is meshed if the object is elastic; None for a block behind its surface.

        Parameters
        ----------
        finger : the finger; an endless object is as long or as wide
        solid : whether the model is one, or a section
        """
        return None

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
        r = np.linspace(-reach_mm, reach_mm, DRAWN)
        return self._swept(r, self.section_profile(r), reach_mm)

    def _swept(self, r: Float, y: Float, reach: float) -> Triangles:
        """Return a curve (n,) of the section, swept along the axis."""
        grid = np.stack([np.stack([r, y, 0.0 * r + end], axis=-1) for end in (-reach, reach)], axis=1)
        return sheet(grid if self.axis == "z" else grid[..., ::-1])

    def is_level(self, turned: Float) -> bool:
        """Whether the axis is horizontal after a rotation (3, 3)."""
        return abs(float((turned @ self.direction)[1])) <= 1e-12


def sheet(points: Float) -> Triangles:
    """Return the triangles of a grid of points (m, n, 3)."""
    number = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = (number[i : i - 1 or None, j : j - 1 or None] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2)
    return Triangles(points.reshape(-1, 3), faces.reshape(-1, 3))
