"""Path of the object: the poses at the end of every increment."""

from __future__ import annotations

import numpy as np

from finger3d.mechanics.model import Leg
from finger3d.objects import ObjectPose, between

AUTO_START = 10
"""Increments that ``steps = "auto"`` begins with."""


def targets(legs: tuple[Leg, ...]) -> list[ObjectPose]:
    """Return the pose at the end of every increment of the legs, in order."""
    out: list[ObjectPose] = []
    at = ObjectPose(0.0)
    for leg in legs:
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        end = leg.end(at)
        out += [between(at, end, k / count) for k in range(1, count)] + [end]
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


def stride_ratio(before: ObjectPose, a: ObjectPose, b: ObjectPose) -> float | None:
    """Return the length of the increment from a to b over that from `before` to a; None if the direction changes.

    It is None, too, if the object did not move before.
    """
    last, now = a.coordinates - before.coordinates, b.coordinates - a.coordinates
    if not last.any():
        return None
    ratio = float(now @ last) / float(last @ last)
    return None if ratio <= 0.0 or not np.allclose(now, ratio * last) else ratio
