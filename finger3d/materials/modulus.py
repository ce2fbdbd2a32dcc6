"""Young's modulus of a silicone at small strain, and its spread, from what its sources measured.

A data sheet gives the engineering stress s at 100 % strain. A linear curve up to there has E = s; a
neo-Hookean one, s = G (l - 1 / l^2) at the stretch l = 2 with E = 3 G, has E = 12 s / 7. The estimate is the geometric
mean of both.

The tensile curves of the Soft Robotics Materials Database measure strain by the crosshead, over the 33 mm of the narrow
section, although the shoulders of the dumbbell stretch too. From their width, the shoulders extend by up to 0.83 times
as much as the section, if clamped where the tabs begin; the modulus is therefore 1 to 1.83 times the slope. The
estimate is the geometric mean.

Compression tests and published hyperelastic laws are taken as they are. The modulus of a silicone is the geometric mean
of its estimates, with the standard error of their logarithms; that of a single estimate is the standard deviation of a
uniform distribution between its bounds. A batch differs from the modulus by `BATCH` besides: the standard deviation,
within a family, of the logarithm of the ratio of the measured stress at 100 % strain to that of the data sheet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from finger3d.materials.shore import SOFTER_A, SPREAD_00, SPREAD_A, modulus_of_shore_00, modulus_of_shore_A
from finger3d.materials.silicones import Silicone

NEO_HOOKEAN = 12.0 / 7.0
"""Young's modulus of a neo-Hookean law over its engineering stress at 100 % strain."""

SHOULDERS = 1.83
"""Extension of a dumbbell (ASTM D412, die C) between its tabs over that of its narrow section."""

BATCH = 0.25
"""Relative standard deviation of the modulus of a batch, from six silicones in two families."""


@dataclass(frozen=True)
class YoungsModulus:
    """Young's modulus in MPa, its relative standard deviation, None if not known, and where it comes from."""

    E_MPa: float
    spread: float | None
    origin: str


def youngs_modulus(silicone: Silicone) -> YoungsModulus:
    """Return the modulus of a silicone: from its sources, or from its Shore hardness if no source measured it.

    Examples
    --------
    >>> from finger3d.materials.silicones import silicone_named
    >>> modulus = youngs_modulus(silicone_named("Dragon Skin 20"))
    >>> round(modulus.E_MPa, 2), round(modulus.spread, 2)
    (0.42, 0.25)
    """
    estimates = _estimates(silicone)
    if not estimates:
        by_hardness = of_shore(silicone.scale, silicone.shore)
        return YoungsModulus(by_hardness.E_MPa, by_hardness.spread, f"{silicone.name}, {by_hardness.origin}")
    logarithms = [math.log(value) for value, _, _ in estimates]
    mean = math.fsum(logarithms) / len(estimates)
    if len(estimates) == 1:
        error = estimates[0][1]
    else:
        error = math.sqrt(math.fsum((x - mean) ** 2 for x in logarithms) / (len(estimates) - 1) / len(estimates))
    *others, last = (origin for _, _, origin in estimates)
    origin = f"{silicone.name}, {', '.join(others)}{' and ' if others else ''}{last}"
    return YoungsModulus(math.exp(mean), math.hypot(BATCH, error), origin)


def of_shore(scale: str, shore: float) -> YoungsModulus:
    """Return the modulus of a Shore hardness; the scale is "A" or "00"."""
    if scale == "A":
        origin = f"Shore A {shore:g} by Gent 1958; cast silicones are {SOFTER_A:g} times softer on average"
        return YoungsModulus(modulus_of_shore_A(shore), SPREAD_A, origin)
    return YoungsModulus(modulus_of_shore_00(shore), SPREAD_00, f"Shore 00-{shore:g} by Hertz's solution")


def _estimates(silicone: Silicone) -> list[tuple[float, float, str]]:
    """Return every estimate of the modulus, MPa, its relative standard deviation, and its origin."""
    estimates = []
    if silicone.modulus_100_MPa is not None:
        estimates.append((*_between(silicone.modulus_100_MPa, NEO_HOOKEAN), "100 % modulus of the data sheet"))
    if silicone.tangent_tension_MPa is not None:
        estimates.append((*_between(silicone.tangent_tension_MPa, SHOULDERS), "a tensile test"))
    if silicone.modulus_compression_MPa is not None:
        estimates.append((silicone.modulus_compression_MPa, 0.0, "a compression test"))
    if silicone.modulus_fit_MPa is not None:
        estimates.append((silicone.modulus_fit_MPa, 0.0, "a published hyperelastic law"))
    if silicone.modulus_range_MPa is not None:
        low, high = silicone.modulus_range_MPa
        estimates.append((*_between(low, high / low), "tensile tests of several cure temperatures"))
    return estimates


def _between(low: float, ratio: float) -> tuple[float, float]:
    """Return the geometric mean of `low` and `ratio low`, and the standard deviation of a uniform logarithm between."""
    return low * math.sqrt(ratio), math.log(ratio) / math.sqrt(12.0)
