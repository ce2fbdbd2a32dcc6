"""Path of the object: the poses at the end of every increment."""

from __future__ import annotations

from finger3d.mechanics.model import Leg
from finger3d.objects import Move, ObjectPose

AUTO_START = 10
"""Increments that ``steps = "auto"`` begins with."""


def targets(legs: tuple[Leg, ...]) -> list[ObjectPose]:
    """Return the pose at the end of every increment of the legs, in order."""
    out: list[ObjectPose] = []
    at = ObjectPose(0.0)
    for leg in legs:
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        end = leg.end(at)
        out += [Move(at, end).at(k / count) for k in range(1, count)] + [end]
        at = end
    return out


def prescribed_forces(legs: tuple[Leg, ...]) -> list[tuple[int, int, float] | None]:
    """Return the number of every increment in its leg, the leg's count and force (N); None in a leg with a depth."""
    out: list[tuple[int, int, float] | None] = []
    for leg in legs:
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        force = leg.force_N
        out += [None if force is None else (k, count, force) for k in range(1, count + 1)]
    return out
