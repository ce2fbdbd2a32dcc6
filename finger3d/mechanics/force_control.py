"""Force control: the depth at which the object presses with a prescribed force, and a forecast of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from finger3d.errors import MissingError
from finger3d.fem.material import Isotropic
from finger3d.mechanics.model import Leg
from finger3d.objects import ContactPath, ObjectPose, PlacedObject, RigidObject, first_contact_height

_DEEPEST = 0.99
"""Largest depth at which a force is searched for, over that at which the object would reach the finger's base."""

_TOLERANCE = 1e-12
"""Error of the depth, over the largest one."""

_GRID = (81, 21)

_BEYOND = 1.1
"""Depth reached, over its forecast, from which the contact may lie beyond the fine part of the mesh."""


def deepest(obj: RigidObject, first_contact_mm: float, height: float) -> float:
    """Return the largest depth (mm) at which a force is looked for: neither finger nor object reaches the base there.

    Parameters
    ----------
    first_contact_mm : height of the object's lowest point at first touch
    height : of the finger, mm
    """
    return _DEEPEST * (height if obj.is_flat else min(height, first_contact_mm))


def depth_of_force(
    force_at: Callable[[float], float], wanted: float, start: float, guess: float, most: float, asked: float
) -> float:
    """Return the depth (mm) at which the force (N), which increases with the depth, is the one wanted.

    Parameters
    ----------
    force_at : function of a depth
    start, guess : depths, mm, between which it is looked for first
    most : largest depth, mm, see `deepest`
    asked : force at the end of the leg, N, for the message

    Raises
    ------
    MissingError
        If the force is not reached within the finger's height.
    """
    low, high = sorted((min(start, most), min(max(guess, 1e-6 * most), most)))
    stride = max(high - low, 1e-3 * most)
    above, below = force_at(high), force_at(low) if low > 0.0 else 0.0
    while above < wanted:
        if high >= most:
            raise MissingError(
                f"press.force_N = {asked:.6g}: not reached within the finger's height; the largest force is "
                f"{above:.4g} N, at a depth of {high:.4g} mm"
            )
        low, below, high, stride = high, above, min(high + stride, most), 2.0 * stride
        above = force_at(high)
    while below > wanted and low > 0.0:
        high, low, stride = low, max(low - stride, 0.0), 2.0 * stride
        below = force_at(low) if low > 0.0 else 0.0
    return float(brentq(lambda depth: force_at(depth) - wanted if depth > 0.0 else -wanted, low, high,
                        xtol=_TOLERANCE * most, rtol=4.0 * np.finfo(float).eps))  # fmt: skip


def forecast_depth(way: ContactPath, material: Isotropic, force: float, height: float, width: float) -> float:
    """Return a rough depth (mm) for a force (N): an elastic foundation under the overlap of object and finger.

    Its modulus is E / (1 - nu^2), its thickness the finger's height or half the length of the overlap, if that is less.
    It serves to mesh the contact and to choose candidate points; the press finds the depth.
    """
    half_width = way.half_width_mm or 0.5 * width
    x, z = np.meshgrid(
        np.linspace(-way.half_length_mm, way.half_length_mm, _GRID[0]),
        np.linspace(-half_width, half_width, _GRID[1]),
        indexing="ij",
    )
    plan = 4.0 * way.half_length_mm * half_width / x.size
    touch = first_contact_height(way.top, way.object, way.half_length_mm, way.half_width_mm, way.landmarks)
    level = np.zeros_like(z) if way.half_width_mm == 0.0 else z
    gap = PlacedObject.of(way.object, touch, ObjectPose(0.0)).height(x, level) - way.top(x, level)
    gap = np.where(np.isfinite(gap), gap, np.inf)
    modulus = material.E_MPa / (1.0 - material.nu**2)

    def pressed(depth: float) -> float:
        overlap = np.maximum(depth - gap, 0.0)
        inside = x[overlap > 0.0]
        half = 0.5 * float(np.ptp(inside)) if len(inside) else 0.0
        return modulus * float(overlap.sum()) * plan / max(min(height, half), 1e-3 * height)

    most = deepest(way.object, touch, height)
    depth = brentq(lambda depth: pressed(depth) - force, 0.0, most) if pressed(most) > force else most
    return float(f"{depth:.4g}")


def at_depth_reached(legs: tuple[Leg, ...], reached_mm: float) -> tuple[Leg, ...] | None:
    """Return the legs with the depth reached in place of a forecast that was too small; None if none was."""
    forced = [leg.depth_mm for leg in legs if leg.force_N is not None]
    if not forced or reached_mm <= _BEYOND * max(forced):
        return None
    return tuple(leg if leg.force_N is None else replace(leg, depth_mm=reached_mm) for leg in legs)
