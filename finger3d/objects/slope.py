"""Slopes of the touching surfaces, and the error of the vertical gap that follows from them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.objects.shapes import RigidObject

_STEP = 1e-6  # of the finger's size: small beside curvature, large beside round-off
_MUCH_DEG = 10.0  # 1.5 % of the distance, 18 % of the force sideways


@dataclass(frozen=True)
class Slopes:
    """Largest angles (deg) between the direction of the gap and the normal of a surface, over the touching points."""

    object_deg: float
    finger_deg: float

    @property
    def advice(self) -> str:
        """What a gap measured along one direction leaves out at these slopes; empty up to 10 degrees of the object.

        The finger's slope does not matter: such a gap is exact where the object is flat, for any finger.
        """
        if self.object_deg <= _MUCH_DEG:
            return ""
        angle = math.radians(min(self.object_deg, 89.9))
        return (
            f"the object's surface slopes up to {self.object_deg:.0f} deg where it touches, and the gap is measured "
            f"vertically: it overstates the distance there by up to {100.0 * (1.0 / math.cos(angle) - 1.0):.2g} %, and "
            f"leaves out a sideways force of up to {math.tan(angle):.2g} of the local pressure"
        )


def slope_of(
    obj: RigidObject,
    top: Callable[[Float, Float], Float],
    x: Float,
    z: Float,
    slide: tuple[float, float] = (0.0, 0.0),
    dim: int = 3,
) -> Slopes:
    """Largest slopes of object and finger over points of contact.

    Parameters
    ----------
    top : the finger's height over (x, z), nan beside it: ``design.top``
    x, z : (n,) mm, the touching points at rest
    slide : mm, how far the object has slid along x and z
    """
    if len(x) == 0:
        return Slopes(0.0, 0.0)
    x, z = np.asarray(x, dtype=float), np.asarray(z, dtype=float)
    direction = -np.asarray(obj.frame(3)[0])
    step = _STEP * max(float(np.ptp(x)), float(np.ptp(z)), 1.0)

    def steepest(height: Callable[[Float, Float], Float]) -> float:
        slope = [_gradient(height, x, z, step, along) for along in ((1.0, 0.0), (0.0, 1.0 if dim == 3 else 0.0))]
        normal = np.stack([-slope[0], np.ones_like(x), -slope[1]], axis=1)
        cosine = normal @ direction / np.linalg.norm(normal, axis=1)
        return float(np.degrees(np.arccos(np.clip(cosine.min(), -1.0, 1.0))))

    return Slopes(steepest(lambda a, b: obj.height(a - slide[0], b - slide[1])), steepest(top))


def _gradient(
    height: Callable[[Float, Float], Float], x: Float, z: Float, step: float, along: tuple[float, float]
) -> Float:
    """Larger of the one-sided slopes (n,) along a direction; 0 where there is no surface on either side."""
    here = height(x, z)
    sides = [s * (height(x + s * step * along[0], z + s * step * along[1]) - here) / step for s in (-1.0, 1.0)]
    known = np.nan_to_num(np.stack(sides))
    return np.asarray(known[np.abs(known).argmax(axis=0), np.arange(len(x))])
