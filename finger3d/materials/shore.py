"""Young's modulus from Shore hardness.

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
