"""Young's modulus of a silicone at small strain, and its spread, from measurements or its Shore hardness.

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

A durometer pushes an indenter by at most 2.54 mm into the material; the reading S is 100 less 1 for every 0.0254 mm.
Type A has a truncated cone, which Gent (1958) takes for a flat rigid punch of its mean radius, 0.515 mm, on an
incompressible half-space ::

    E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S))     MPa

Type 00 has a sphere of radius R = 1.19 mm and the spring force F = 0.203 + 0.00908 S in N (ASTM D2240). With h = 2.54
(1 - S / 100) mm, Hertz's solution for an incompressible half-space (Johnson 1985, Eq. 4.23) gives ::

    E = 9 F / (16 sqrt(R) h^1.5)                                MPa

which is how Mix and Giacomin (2011) relate the readings of spherical indenters to Young's modulus. For S below 53 the
depth exceeds the radius, and Hertz's solution is extrapolated.

Gent's formula overestimates the modulus of cast silicones, by the factor `SOFTER_A` on average. That of Qi et al.
(2003), from simulated tests, log10 E = 0.0235 S - 0.6403, agrees with Gent's within a fifth for S from 20 to 40,
and exceeds it further above.

References
----------
Gent, A. N. 1958. On the relation between indentation hardness and Young's modulus. Rubber Chem. Technol. 31, 896-906.
Mix, A. W., Giacomin, A. J. 2011. Standardized polymer durometry. J. Test. Eval. 39, 696-705.
Qi, H. J., Joyce, K., Boyce, M. C. 2003. Durometer hardness and the stress-strain behavior of elastomeric materials.
Rubber Chem. Technol. 76, 419-435.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import fmean, stdev
from typing import Any

from finger3d.materials.silicones import Silicone, silicone_named

LOWEST, HIGHEST = 5.0, 90.0
"""Shore readings that are converted; a durometer is little reliable at the ends of its scale."""

SPREAD_A, SPREAD_00 = 0.6, 0.45
"""Relative standard deviation of the modulus: root mean square of the logarithm of its ratio to that of the silicones
whose modulus is known otherwise, with 5 points of tolerance of the hardness (2.9 points standard deviation)."""

SOFTER_A = 1.7
"""Geometric mean of the ratio of Gent's modulus to that of the silicones whose modulus is known otherwise."""

STROKE_MM, SPHERE_MM = 2.54, 1.19
"""Travel of a durometer's indenter, and radius of that of type 00."""


def modulus_of_shore_A(shore: float) -> float:
    """Return Young's modulus, MPa, of a Shore A hardness, by Gent (1958).

    Raises
    ------
    ValueError
        If the hardness is not within `LOWEST` and `HIGHEST`.

    Examples
    --------
    >>> round(modulus_of_shore_A(50.0), 2)
    2.46
    """
    _check(shore)
    return 0.0981 * (56.0 + 7.62336 * shore) / (0.137505 * (254.0 - 2.54 * shore))


def modulus_of_shore_00(shore: float) -> float:
    """Return Young's modulus, MPa, of a Shore 00 hardness, by Hertz's solution for the durometer's sphere.

    Raises
    ------
    ValueError
        If the hardness is not within `LOWEST` and `HIGHEST`.

    Examples
    --------
    >>> round(modulus_of_shore_00(30.0), 3)
    0.103
    """
    _check(shore)
    force_N = 0.203 + 0.00908 * shore
    depth_mm = STROKE_MM * (1.0 - shore / 100.0)
    return 9.0 * force_N / (16.0 * math.sqrt(SPHERE_MM) * depth_mm * math.sqrt(depth_mm))


def _check(shore: float) -> None:
    if not LOWEST <= shore <= HIGHEST:
        raise ValueError(f"Shore hardness {shore:g}: must be from {LOWEST:g} to {HIGHEST:g}")


NEO_HOOKEAN = 12.0 / 7.0
"""Young's modulus of a neo-Hookean law over its engineering stress at 100 % strain."""

SHOULDERS = 1.83
"""Extension of a dumbbell (ASTM D412, die C) between its tabs over that of its narrow section."""

BATCH = 0.25
"""Relative standard deviation of the modulus of a batch, from six silicones in two families."""


MODULUS_KEYS = ("E_MPa", "shore_A", "shore_00", "silicone")
"""Keys of which exactly one gives Young's modulus."""

NU = 0.49
"""Poisson's ratio of a silicone: its bulk modulus is about 50 times its shear modulus or more."""


@dataclass(frozen=True)
class ElasticConstants:
    """Young's modulus and Poisson's ratio, and where they come from.

    Attributes
    ----------
    E_MPa : Young's modulus
    spread : its relative standard deviation; None if the user gave it
    origin : where it comes from, "given" if the user gave it
    nu : Poisson's ratio
    """

    E_MPa: float
    spread: float | None
    origin: str
    nu: float = NU

    def __str__(self) -> str:
        """Young's modulus with its spread and origin, in one line."""
        spread = "" if self.spread is None else f" +- {100.0 * self.spread:.0f} %"
        return f"{self.E_MPa:.3g} MPa{spread}, {self.origin}"


def youngs_modulus(silicone: Silicone) -> ElasticConstants:
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
        return replace(by_hardness, origin=f"{silicone.name}, {by_hardness.origin}")
    logarithms = [math.log(value) for value, _, _ in estimates]
    error = estimates[0][1] if len(estimates) == 1 else stdev(logarithms) / math.sqrt(len(estimates))
    *others, last = (origin for _, _, origin in estimates)
    origin = f"{silicone.name}, {', '.join(others)}{' and ' if others else ''}{last}"
    return ElasticConstants(math.exp(fmean(logarithms)), math.hypot(BATCH, error), origin)


def of_shore(scale: str, shore: float) -> ElasticConstants:
    """Return the modulus of a Shore hardness; the scale is "A" or "00"."""
    if scale == "A":
        origin = f"Shore A {shore:g} by Gent 1958; cast silicones are {SOFTER_A:g} times softer on average"
        return ElasticConstants(modulus_of_shore_A(shore), SPREAD_A, origin)
    return ElasticConstants(modulus_of_shore_00(shore), SPREAD_00, f"Shore 00-{shore:g} by Hertz's solution")


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


def elastic_constants(table: Mapping[str, Any]) -> ElasticConstants:
    """Return the elastic constants that the keys of a table give, such as [material].

    Parameters
    ----------
    table : exactly one of `MODULUS_KEYS`, and ``nu``, which only E_MPa needs; keys that are None count as absent

    Raises
    ------
    Finger3dError
        If the silicone is unknown.

    Examples
    --------
    >>> elastic_constants({"E_MPa": 1.0, "nu": 0.4})
    ElasticConstants(E_MPa=1.0, spread=None, origin='given', nu=0.4)
    >>> print(elastic_constants({"shore_00": 30.0}))
    0.103 MPa +- 45 %, Shore 00-30 by Hertz's solution
    """
    ((key, value),) = [(key, table[key]) for key in MODULUS_KEYS if table.get(key) is not None]
    if key == "silicone":
        found = youngs_modulus(silicone_named(value))
    elif key == "E_MPa":
        found = ElasticConstants(float(value), None, "given")
    else:
        found = of_shore(key.removeprefix("shore_"), value)
    nu = table.get("nu")
    return found if nu is None else replace(found, nu=float(nu))
