"""Corner singularities at clamped or bonded faces (validation/REFERENCES.md, 5.3), and extrapolation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq


def clamped_free(angle: float, nu: float, plane_stress: bool = False) -> float:
    """Smallest exponent of the displacement, u ~ r^exponent, in a wedge (radians) with one side clamped and one free.

    Williams 1952: sin^2(e w) = (k + 1)^2 / 4k - (e^2 / k) sin^2 w, with k = 3 - 4 nu, or (3 - nu)/(1 + nu).
    A load's own work, and any number that its dual field is as singular for, converges at the rate 2 e.
    """
    k = (3.0 - nu) / (1.0 + nu) if plane_stress else 3.0 - 4.0 * nu

    def equation(e: float) -> float:
        return math.sin(e * angle) ** 2 - (k + 1.0) ** 2 / (4.0 * k) + e**2 / k * math.sin(angle) ** 2

    e = np.linspace(0.3, 1.2, 901)
    sign = np.sign([equation(v) for v in e])
    first = int(np.flatnonzero(sign[1:] != sign[:-1])[0])
    return float(brentq(equation, e[first], e[first + 1]))


def extrapolated(coarse: float, fine: float, rate: float, ratio: float = 2.0) -> float:
    """Value at zero size from two whose sizes stand in `ratio`, with the error falling at `rate`."""
    return fine + (fine - coarse) / (ratio**rate - 1.0)


def observed(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Rate q with which the last three values, at these sizes, go as ``limit + c size^q``."""
    (h0, h1, h2), (v0, v1, v2) = sizes[-3:], values[-3:]
    wanted = (v0 - v1) / (v1 - v2)
    return float(brentq(lambda q: (h0**q - h1**q) / (h1**q - h2**q) - wanted, 0.05, 12.0))
