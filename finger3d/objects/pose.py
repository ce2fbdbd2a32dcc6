"""Pose of the object on its path: depth, slides and turns since first touch."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from finger3d._types import Float
from finger3d.objects.rigid import rotation

_TIME = 3
"""Place of the time among the coordinates of a pose."""


_SAME = 0.1
"""Largest change of direction (rad) between two moves along one path."""


@dataclass(frozen=True)
class ObjectPose:
    """Pose of the object: depth, slides along x and z, and turns (rad) about its reference point, at a time (s).

    It is turned about x, then y, then z, all fixed axes, from its orientation at the start.
    """

    depth_mm: float
    slide_x_mm: float = 0.0
    slide_z_mm: float = 0.0
    time_s: float = 0.0
    turn_x: float = 0.0
    turn_y: float = 0.0
    turn_z: float = 0.0

    @property
    def displacement(self) -> Float:
        """Displacement (3,) mm of the reference point along x, y and z since first touch."""
        return np.array([self.slide_x_mm, -self.depth_mm, self.slide_z_mm])

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
        """Depth and slides (mm), time (s) and turns (rad): array (7,)."""
        return np.array([self.depth_mm, self.slide_x_mm, self.slide_z_mm, self.time_s, *self.turns])


@dataclass(frozen=True)
class Move:
    """Motion of the object from one pose to another, during which its coordinates change in proportion."""

    start: ObjectPose
    end: ObjectPose

    @property
    def change(self) -> Float:
        """Change of the coordinates: array (7,)."""
        return self.end.coordinates - self.start.coordinates

    @property
    def duration_s(self) -> float:
        """Time that it takes, s."""
        return self.end.time_s - self.start.time_s

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
        in_space = np.arange(len(last)) != _TIME
        if last[in_space].any():
            last, now = last[in_space], now[in_space]
        if not last.any():
            return None
        ratio = float(now @ last) / float(last @ last)
        return None if ratio <= 0.0 or np.linalg.norm(now - ratio * last) > _SAME * np.linalg.norm(now) else ratio
