"""Ranges of the numbers and names that a scene takes, and bounds worded so that they can be typed as they are printed.

The ranges are wider than any finger, and narrow enough that no admissible number overflows, underflows or fills the
memory. Results are proportional to Young's modulus to round-off from end to end of its range.
"""

from __future__ import annotations

import math
from typing import Annotated

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen, Predicate

SMALLEST_MM, LARGEST_MM = 1e-2, 1e4
"""Dimensions of a finger: CAD works with an absolute tolerance of 1e-7 mm."""

LONGEST_SLIDE = 100.0
"""Largest slide, in half lengths of the finger: the path is searched for walls every sixtieth of one."""

FARTHEST_MM = 1e6
"""Largest coordinate of anything."""


class Radians:
    """Marks a field that holds radians: its key in a scene ends in ``_deg`` and has these bounds, in degrees."""

    def __init__(self, *bounds: Ge | Gt | Le | Lt) -> None:
        """Keep the bounds."""
        self.bounds = bounds


Zero = Annotated[float, Ge(0), Le(0)]
Modulus = Annotated[float, Ge(1e-9), Le(1e9)]  # MPa
Shore = Annotated[float, Ge(5), Le(90)]  # durometer reading; unreliable nearer to the ends of a scale
Poisson = Annotated[float, Ge(0), Le(0.5)]
Friction = Annotated[float, Ge(0), Le(1e6)]
Force = Annotated[float, Ge(1e-12), Le(1e12)]  # N
SignedForce = Annotated[float, Ge(-1e12), Le(1e12)]  # N
Mass = Annotated[float, Ge(0), Le(1e9)]  # g
Dimension = Annotated[float, Ge(SMALLEST_MM), Le(LARGEST_MM)]  # of a finger
Length = Annotated[float, Ge(1e-6), Le(1e6)]  # mm
Place = Annotated[float, Ge(-FARTHEST_MM), Le(FARTHEST_MM)]  # mm
Angle = Annotated[float, Ge(-360), Le(360)]  # degrees
Turn = Annotated[float, Radians(Ge(-360), Le(360))]
Edge = Annotated[float, Ge(1e-4), Le(LARGEST_MM)]  # mm, of a mesh
Seconds = Annotated[float, Ge(1e-9), Le(1e12)]  # on a press's own clock
Scale = Annotated[float, Ge(1e-6), Le(1e6)]
Share = Annotated[float, Ge(0), Le(1)]
Fraction = Annotated[float, Gt(0), Lt(1)]
Count = Annotated[int, Ge(1), Le(10_000)]


def one_line(text: str) -> bool:
    """Whether a text is one line of printable characters: no line breaks, no control characters."""
    return text.isprintable()


Name = Annotated[str, MinLen(1), MaxLen(200), Predicate(one_line)]
Title = Annotated[str, MaxLen(200), Predicate(one_line)]
PathName = Annotated[str, MinLen(1), Predicate(one_line)]


def number(value: float, digits: int = 6) -> str:
    """Return a number as one types it: 1e-9 and not 1e-09."""
    text = f"{value:.{digits}g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if e else text


def four_digits(value: float) -> float:
    """Return an edge length as a scene keeps it, with four digits."""
    return float(f"{value:.4g}")


def at_least(bound: float, digits: int = 6) -> str:
    """Return a lower bound rounded up, so that the number printed is not below it."""
    return _rounded(bound, digits, math.inf)


def at_most(bound: float, digits: int = 6) -> str:
    """Return an upper bound rounded down, so that the number printed is not above it."""
    return _rounded(bound, digits, -math.inf)


def _rounded(bound: float, digits: int, towards: float) -> str:
    text = number(bound, digits)
    if (float(text) - bound) * math.copysign(1.0, towards) >= 0.0:
        return text
    step = 10.0 ** (math.floor(math.log10(abs(bound))) + 1 - digits)
    return number(float(text) + math.copysign(step, towards), digits)


def printable(text: str) -> str:
    """Return a text whose control characters, which a terminal would obey, are written as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
