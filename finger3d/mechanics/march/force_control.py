"""Forecast of the depth at which the object presses with a prescribed force, and the largest depth of all."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.model import Leg
from finger3d.objects import ContactPath, ObjectPose, PlacedObject, first_touch

_DEEPEST = 0.99
"""Largest depth at which a force is searched for, over that at which the object would reach the finger's base."""

_GRADED = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 100)])
"""Distances from the place of first touch at which the overlap is found for a forecast, over the finger's extent."""

_ENDS = np.array([-1.0, 1.0])

_BEYOND = 1.1
"""Depth reached, over its forecast, from which the contact may lie beyond the fine part of the mesh."""


def deepest(way: ContactPath, first_contact_mm: float, height: float) -> float:
    """Return the largest depth (mm) at which a force is looked for: neither finger nor object reaches the base there.

    Parameters
    ----------
    way : the object, and the extents of the finger; its poses are not looked at
    first_contact_mm : height of the object's lowest point at first touch
    height : of the finger, mm
    """
    lowest = first_contact_mm
    if way.object.is_flat:  # it has no lowest point; over the base it is lowest at a corner
        x, z = np.meshgrid(way.half_length_mm * _ENDS, way.half_width_mm * _ENDS)
        lowest = float(PlacedObject.of(way.object, first_contact_mm).height(x.ravel(), z.ravel()).min())
    return _DEEPEST * min(height, lowest)


def forecast_depth(way: ContactPath, material: Isotropic, force: float, height: float, width: float) -> float:
    """Return a rough depth (mm) for a force (N): an elastic foundation under the overlap of object and finger.

    Its modulus is E / (1 - nu^2).  Its thickness is 1.2 times the finger's height, or b max(1.2, log(2.8 l / b) - 0.5)
    if that is less, with the half width b of the overlap and the finger's height l, or half the length of the overlap
    if that is less and ends on the finger.  These are 1.2 times those that give the depth of a layer, and that of a
    line contact (Johnson 1985, eq. 5.56).  In 13 presses of sections and solids the forecast was 0.75 to 2.3 times the
    depth, in sections under round objects 0.9 to 1.1 times.
    It serves to mesh the contact and to choose candidate points; the press finds the depth.
    """
    touch = first_touch(way)
    lines = [
        np.unique(np.clip(middle + np.outer([-1.0, 1.0], 2.0 * half * _GRADED), -half, half))
        for half, middle in zip((way.half_length_mm, way.half_width_mm), touch.place, strict=True)
    ]
    x, z = np.meshgrid(*lines, indexing="ij")
    weight = [0.5 * (np.diff(line, append=line[-1]) + np.diff(line, prepend=line[0])) for line in lines]
    plan = np.outer(weight[0], weight[1] if way.half_width_mm else [width])
    gap = PlacedObject.of(way.object, touch.height_mm, ObjectPose(0.0)).height(x, z) - way.top(x, z)
    gap = np.where(np.isfinite(gap), gap, np.inf)
    modulus = material.E_MPa / (1.0 - material.nu**2)

    def pressed(depth: float) -> float:
        overlap = np.maximum(depth - gap, 0.0)
        inside = overlap > 0.0
        halves = [0.5 * float(np.ptp(side[inside])) + 1e-6 * height if inside.any() else height for side in (x, z)]
        ends = [half for half, most in zip(halves, (way.half_length_mm, way.half_width_mm), strict=True) if half < most]
        b, length = min(ends, default=height), min(max(ends), height) if len(ends) == 2 else height
        thickness = min(b * max(1.2, math.log(2.8 * length / b) - 0.5), 1.2 * height)
        return modulus * float((overlap * plan).sum()) / thickness

    most = deepest(way, touch.height_mm, height)
    depth = brentq(lambda depth: pressed(depth) - force, 0.0, most) if pressed(most) > force else most
    return float(f"{depth:.4g}")


def at_depth_reached(legs: tuple[Leg, ...], reached_mm: float) -> tuple[Leg, ...] | None:
    """Return the legs with the depth reached in place of a forecast that was too small; None if none was."""
    forced = [leg.depth_mm for leg in legs if leg.force_N is not None]
    if not forced or reached_mm <= _BEYOND * max(forced):
        return None
    return tuple(leg if leg.force_N is None else replace(leg, depth_mm=reached_mm) for leg in legs)
