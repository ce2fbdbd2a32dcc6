"""Path of the object: the stations at the ends of all increments."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from finger3d._types import Float
from finger3d.mechanics.model import Leg, ways
from finger3d.objects import ObjectPose

AUTO_START = 10
"""Increments that ``steps = "auto"`` begins with."""


@dataclass(frozen=True)
class Load:
    """Forces prescribed at the end of an increment.

    Attributes
    ----------
    forces : (7,) N and N mm at the end of the leg, as `finger3d.mechanics.generalised.forces_on`; NaN where none is
        prescribed
    share : of the way to them from the forces at the start of the leg
    begins : whether the increment is the first of its leg
    """

    forces: Float
    share: float
    begins: bool


@dataclass(frozen=True)
class Station:
    """End of an increment.

    Attributes
    ----------
    pose : of the object
    load : the forces to which the pose is found, if any is prescribed
    share : of the leg that ends here
    """

    pose: ObjectPose
    load: Load | None = None
    share: float = 1.0


def stations(legs: tuple[Leg, ...]) -> list[Station]:
    """Return the stations at the ends of all increments of the legs, in order."""
    out: list[Station] = []
    for leg, way in ways(legs):
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        shares = tuple(k / count for k in range(1, count + 1))
        for share in shares:
            pose = way.at(share) if share < 1.0 else way.end
            load = Load(np.array(leg.forces, dtype=float), share, share == shares[0]) if leg.is_under_force else None
            out.append(Station(pose, load, share))
    return out


def targets(legs: tuple[Leg, ...]) -> list[ObjectPose]:
    """Return the pose at the end of every increment of the legs, in order."""
    return [station.pose for station in stations(legs)]


_COORDINATES = ("depth_mm", "slide_x_mm", "slide_z_mm", "turn_x", "turn_y", "turn_z")
_SHORTEST = 1e-6
"""Share of a leg below which it is not cut."""


def ending_at(legs: tuple[Leg, ...], name: str, values: Float) -> tuple[Leg, ...]:
    """Return the legs cut where a coordinate of the pose has given values, with increments no longer than before.

    Legs with prescribed forces are kept, since their poses are unknown.

    Parameters
    ----------
    name : of a field of `ObjectPose`, such as ``depth_mm``
    values : (n,) of it
    """
    out: list[Leg] = []
    for leg, way in ways(legs):
        begin, change = getattr(way.start, name), getattr(way.end, name) - getattr(way.start, name)
        shares = (values - begin) / change if change and not leg.is_under_force else np.zeros(0)
        inner = np.unique(shares[(shares > _SHORTEST) & (shares < 1.0 - _SHORTEST)])
        for before, share in pairwise([0.0, *inner.tolist(), 1.0]):
            pose = way.at(share) if share < 1.0 else way.end
            part = replace(leg, **{key: getattr(pose, key) for key in _COORDINATES})
            if leg.duration_s is not None:
                part = replace(part, duration_s=(share - before) * leg.duration_s)
            if len(inner):
                count = leg.steps if isinstance(leg.steps, int) else AUTO_START
                part = replace(part, steps=max(1, math.ceil((share - before) * count - _SHORTEST)))
            out.append(part)
    return tuple(out)
