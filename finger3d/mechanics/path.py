"""Path of the object: the poses at the end of every increment."""

from __future__ import annotations

import numpy as np

from finger3d.mechanics.history import ObjectPose
from finger3d.mechanics.model import Leg

AUTO_START = 10
"""Increments that ``steps = "auto"`` begins with."""


def targets(legs: tuple[Leg, ...]) -> list[ObjectPose]:
    """Return the pose at the end of every increment of the legs, in order."""
    out: list[ObjectPose] = []
    at = ObjectPose(0.0)
    for leg in legs:
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        end = ObjectPose(leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm, at.time_s + (leg.duration_s or 0.0))
        out += [between(at, end, k / count) for k in range(1, count)] + [end]
        at = end
    return out


def between(a: ObjectPose, b: ObjectPose, share: float) -> ObjectPose:
    """Return the pose a share of the way from a to b."""
    return ObjectPose(*(a.coordinates + share * (b.coordinates - a.coordinates)).tolist())


def stride_ratio(before: ObjectPose, a: ObjectPose, b: ObjectPose) -> float | None:
    """Return the length of the increment from a to b over that from `before` to a; None if the direction changes."""
    last, now = a.coordinates - before.coordinates, b.coordinates - a.coordinates
    ratio = float(now @ last) / float(last @ last)
    return None if ratio <= 0.0 or not np.allclose(now, ratio * last) else ratio
