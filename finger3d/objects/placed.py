"""A rigid object in a pose: its distances, heights and material points in the scene; distances of moving points.

A pose is the depth, the slides and the turns since first touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int, freeze_arrays
from finger3d.geometry.surface import Triangles
from finger3d.objects.rigid import RigidObject, rotation
from finger3d.objects.triangulated import MeshObject

TIME = 3
"""Place of the time among the coordinates of a pose."""


_SAME = 0.1
"""Largest change of direction (rad) between two moves along one path."""


@dataclass(frozen=True)
class ObjectPose:
    """Pose of the object: depth, slides along x and z, and turns (rad) about its reference point, at a time (s).

    It is turned about x, then y, then z, all fixed axes, from its orientation at the start.  Between two fingers the
    depth is the distance by which each of them has closed, and `rise_mm` how far the object has moved from the middle
    between them towards the second one.
    """

    depth_mm: float
    slide_x_mm: float = 0.0
    slide_z_mm: float = 0.0
    time_s: float = 0.0
    turn_x: float = 0.0
    turn_y: float = 0.0
    turn_z: float = 0.0
    rise_mm: float = 0.0

    @property
    def displacement(self) -> Float:
        """Displacement (3,) mm of the reference point along x, y and z since first touch."""
        return np.array([self.slide_x_mm, self.rise_mm - self.depth_mm, self.slide_z_mm])

    @property
    def turns(self) -> tuple[float, float, float]:
        """Turns about x, y and z, rad."""
        return self.turn_x, self.turn_y, self.turn_z

    @property
    def is_turned(self) -> bool:
        """Whether the object is turned."""
        return any(self.turns)

    @property
    def turn(self) -> Float:
        """Rotation (3, 3) from the object's orientation at the start."""
        return rotation(*self.turns)

    @property
    def coordinates(self) -> Float:
        """Depth and slides (mm), time (s), turns (rad) and rise (mm): array (8,)."""
        return np.array([self.depth_mm, self.slide_x_mm, self.slide_z_mm, self.time_s, *self.turns, self.rise_mm])

    def changed(self, numbers: Sequence[int] | Int, change: Sequence[float] | Float) -> ObjectPose:
        """Return the pose with some of its `coordinates` changed."""
        coordinates = self.coordinates
        coordinates[numbers] += change
        return ObjectPose(*coordinates.tolist())


@dataclass(frozen=True)
class Move:
    """Motion of the object from one pose to another, during which its coordinates change in proportion."""

    start: ObjectPose
    end: ObjectPose

    @property
    def change(self) -> Float:
        """Change of the coordinates: array (8,)."""
        return self.end.coordinates - self.start.coordinates

    @property
    def duration_s(self) -> float:
        """Time that it takes, s."""
        return self.end.time_s - self.start.time_s

    @property
    def may_close_gaps(self) -> bool:
        """Whether the object moves, and does not rise."""
        at_rest = replace(self.end, time_s=self.start.time_s) == self.start
        return self.end.depth_mm >= self.start.depth_mm and not at_rest

    def at(self, share: float) -> ObjectPose:
        """Return the pose a share of the way from the start to the end."""
        return ObjectPose(*(self.start.coordinates + share * self.change).tolist())

    def cut(self, *shares: float) -> tuple[Move, ...]:
        """Return its parts between ascending shares of it."""
        poses = [self.start, *map(self.at, shares), self.end]
        return tuple(Move(start, end) for start, end in pairwise(poses))

    def length_ratio(self, before: Move) -> float | None:
        """Return its length over that of the move before; None if the direction changes, or nothing moved before.

        Time is compared only where the object rested before.  The direction of a slide along an arc counts as the same.
        """
        last, now = before.change, self.change
        in_space = np.arange(len(last)) != TIME
        if last[in_space].any():
            last, now = last[in_space], now[in_space]
        if not last.any():
            return None
        ratio = float(now @ last) / float(last @ last)
        return None if ratio <= 0.0 or np.linalg.norm(now - ratio * last) > _SAME * np.linalg.norm(now) else ratio


_SURFACE = 1e-13
"""Distance at which a point on a vertical line counts as on the surface, over the coordinates."""

_MOST_STRIDES = 200
"""Largest number of steps along a vertical line."""

_LOWEST_START = 1e7
"""Depth (mm) from which a vertical line starts; a body that is there extends downwards without end."""


@dataclass(frozen=True)
class SecondFinger:
    """A second finger that faces the first one across the object, as its mirror image at a horizontal plane.

    It comes down as the fingers close, while its points are told where they are at rest.

    Attributes
    ----------
    above_mm : height above which points belong to it
    lowered_mm : by which it has come down at first touch
    centre : (3,) mm, place at first touch of the object's centre of mass, about which the object turns
    """

    above_mm: float
    lowered_mm: float
    centre: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class PlacedObject:
    """A rigid object in a pose.

    Attributes
    ----------
    object : RigidObject
    turned : (3, 3) rotation of the object's own coordinates, that of its initial pose included
    place : (3,) mm, where the origin of its own coordinates is
    second : the finger that faces the first one, as far down as it is; None without it
    """

    object: RigidObject
    turned: Float
    place: Float
    second: SecondFinger | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def of(
        cls,
        obj: RigidObject,
        first_contact_mm: float,
        pose: ObjectPose | None = None,
        second: SecondFinger | None = None,
    ) -> PlacedObject:
        """Return an object in a pose.

        Parameters
        ----------
        first_contact_mm : height of its lowest point at first touch
        pose : since first touch; that of first touch unless given
        second : the finger that faces the first one at first touch, if there is one
        """
        pose = pose or ObjectPose(0.0)
        initial = obj.initial_rotation
        turned = pose.turn @ initial if pose.is_turned else initial
        lowest = np.array([obj.x_mm, first_contact_mm, obj.z_mm])
        if second is None:
            return cls(obj, turned, lowest + pose.displacement - turned @ obj.lowest_point(initial))
        from_centre = lowest - second.centre - initial @ obj.lowest_point(initial)
        place = second.centre + pose.displacement + pose.turn @ from_centre
        down = replace(second, lowered_mm=second.lowered_mm + 2.0 * pose.depth_mm)
        return cls(obj, turned, place, down)

    def of_second(self, points: Float) -> NDArray[np.bool_]:
        """Return which points (n, d) belong to the second finger."""
        return points[:, 1] > (np.inf if self.second is None else self.second.above_mm)

    def brought_together(self, points: Float) -> Float:
        """Return points (n, d) with those of the second finger where it has come down to."""
        if self.second is None:
            return points
        return points - np.outer(self.of_second(points), self.second.lowered_mm * np.eye(points.shape[1])[1])

    @property
    def is_upright(self) -> bool:
        """Whether the object is not turned."""
        return bool((self.turned == np.eye(3)).all())

    def to_own(self, points: Float) -> Float:
        """Return points (n, 3) in the object's own coordinates."""
        points = self.brought_together(points)
        return (points - self.place) if self.is_upright else (points - self.place) @ self.turned

    def to_scene(self, points: Float) -> Float:
        """Return points (n, 3), given in the object's own coordinates, in those of the scene."""
        return points @ self.turned.T + self.place

    def to_scene_direction(self, vectors: Float) -> Float:
        """Return vectors (n, 3), given in the object's own coordinates, in those of the scene."""
        return vectors if self.is_upright else vectors @ self.turned.T

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Return the signed distance (n,) mm of points (n, d), negative inside, and its gradient (n, d), a unit vector.

        In two dimensions it is that from the section z = 0: exact on the surface and wherever the section is the same
        along z, else to first order.
        """
        in_space = points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])
        value, gradient = self.object.distance(self.to_own(in_space))
        gradient = self.to_scene_direction(gradient)
        return (value, gradient) if points.shape[1] == 3 else in_section(value, gradient)

    def height(self, x: Float, z: Float) -> Float:
        """Return the height (n,) mm where vertical lines first meet the object from below; nan where they miss it."""
        x, z = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
        if self.is_upright:
            return np.asarray(self.object.profile(x - self.place[0], z - self.place[2]) + self.place[1])
        if isinstance(self.object, MeshObject):
            return np.asarray(self._triangles.height(x - self.place[0], z - self.place[2]) + self.place[1])
        return self._traced(x.ravel(), z.ravel()).reshape(x.shape)

    @cached_property
    def _triangles(self) -> Triangles:
        assert isinstance(self.object, MeshObject)
        own = self.object.triangles
        return Triangles(own.points @ self.turned.T, own.faces)

    def _traced(self, x: Float, z: Float) -> Float:
        """Follow vertical lines up to the surface by steps that cannot pass it.

        Steps have the length of a lower bound of the distance; for a convex body they are Newton steps, which never
        overshoot the zero of a convex function.
        """
        points = np.stack([x, np.full(len(x), -_LOWEST_START), z], axis=1)
        out = np.full(len(x), np.nan)
        inside = self.object.clearance(self.to_own(points)) < 0.0
        out[inside] = -np.inf
        moving = np.flatnonzero(~inside)
        for _ in range(_MOST_STRIDES):
            if self.object.is_convex:
                value, gradient = self.distance(points[moving])
                rate = -gradient[:, 1]
                step = np.where(rate > _SURFACE, value / np.where(rate > _SURFACE, rate, 1.0), np.inf)
            else:
                step = self.object.clearance(self.to_own(points[moving]))
            arrived = np.abs(step) <= _SURFACE * (1.0 + np.abs(points[moving, 1]))
            missed = ~(points[moving, 1] + step < _LOWEST_START)
            out[moving[arrived]] = points[moving[arrived], 1]
            moving, step = moving[~(arrived | missed)], step[~(arrived | missed)]
            points[moving, 1] += step
            if not len(moving):
                break
        out[moving] = points[moving, 1]
        return out

    @property
    def lowest(self) -> tuple[float, float]:
        """Place (x, z) mm of the lowest point; of a plane, which may be shifted in itself, the place in the scene."""
        if self.object.is_flat:
            return self.object.x_mm, self.object.z_mm
        x, _, z = self.to_scene(self.object.lowest_point(self.turned)[None])[0]
        return float(x), float(z)

    def overlap(self, x: Float, y: Float, z: Float) -> Float:
        """Return the vertical overlap (n,), mm, of the object with points at heights y; -inf outside the object."""
        return np.nan_to_num(y - self.height(x, z), nan=-np.inf, posinf=np.inf, neginf=-np.inf)

    def moved_from(self, before: PlacedObject, points: Float) -> Float:
        """Return how far (n, 3) mm the object's material at points (n, 3) has moved since a pose before."""
        now = self.brought_together(points)
        moved = now - before.to_scene(self.to_own(points))
        if self.second is not None and before.second is not None:  # as seen from its finger, which has come down
            moved[self.of_second(points), 1] += self.second.lowered_mm - before.second.lowered_mm
        return moved

    def mirrors(self) -> tuple[str, ...]:
        """Return the axes, "x" and "z", along which the object is its own mirror image about the finger's middle."""
        probes = self.to_scene(self.object.probes())
        value = self.distance(probes)[0]
        bound = 1e-6 if isinstance(self.object, MeshObject) else 1e-10
        scale = bound * max(self.object.probe_reach, float(np.abs(self.place).max()))
        axes = []
        for axis, image in (("x", [-1.0, 1.0, 1.0]), ("z", [1.0, 1.0, -1.0])):
            if np.abs(self.distance(probes * image)[0] - value).max() <= scale:
                axes.append(axis)
        return tuple(axes)


def in_section(value: Float, gradient: Float) -> tuple[Float, Float]:
    """Return the distance (n,) from a section, to first order, and its gradient (n, 2), from those in space."""
    flat = gradient[:, :2]
    length = np.linalg.norm(flat, axis=1)
    known = length > _SURFACE
    divisor = np.where(known, length, _SURFACE)
    return value / divisor, np.where(known[:, None], flat / divisor[:, None], [0.0, -1.0])


class DistanceTracker:
    """Signed distances of the same points at one place after another.

    A distance changes by no more than the point moves relative to the object.  Points that stay farther than a bound
    keep the distance and gradient of their last evaluation, continued linearly; before the first, those of the box
    around the object.
    """

    def __init__(self) -> None:
        """Start without known distances."""
        self._at: Float | None = None
        self._value = self._gradient = np.zeros(0)
        self._known = np.zeros(0, dtype=bool)

    def distance(self, placed: PlacedObject, points: Float, within_mm: float) -> tuple[Float, Float]:
        """Return the signed distance (n,) of points (n, d), 2D ones in the section z = 0, and its gradient (n, d).

        Both are exact for points within `within_mm` of the object.
        """
        if not isinstance(placed.object, MeshObject):  # a formula is as quick as a comparison
            return placed.distance(points)
        own = placed.to_own(points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))]))
        if self._at is None or len(self._at) != len(own):
            self._at = own.copy()
            self._value, self._gradient = _box_distance(placed.object.triangles, own)
            self._known = np.zeros(len(own), dtype=bool)
        moved = own - self._at
        changed = moved.any(axis=1) | ~self._known
        due = np.flatnonzero((self._value - np.linalg.norm(moved, axis=1) <= within_mm) & changed)
        if len(due):
            self._at[due] = own[due]
            self._value[due], self._gradient[due] = placed.object.distance(own[due])
            self._known[due] = True
            moved[due] = 0.0
        value = self._value + np.einsum("ni,ni->n", self._gradient, moved)
        gradient = placed.to_scene_direction(self._gradient)
        return (value, gradient) if points.shape[1] == 3 else in_section(value, gradient)


def _box_distance(triangles: Triangles, points: Float) -> tuple[Float, Float]:
    """Return the distance (n,) of points (n, 3) from the box around triangles, 0 inside, and its gradient (n, 3)."""
    out = points - np.clip(points, triangles.low, triangles.high)
    value = np.linalg.norm(out, axis=1)
    gradient = np.where((value > 0.0)[:, None], out / np.where(value > 0.0, value, 1.0)[:, None], [0.0, -1.0, 0.0])
    return value, gradient
