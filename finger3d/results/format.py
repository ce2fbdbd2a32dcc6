"""Numbers for a reader, with their errors."""

from __future__ import annotations

import math


def with_error(value: float, error: float | None = None, digits: int = 5, sign: str = "±") -> str:
    """Return a number and its error, both to the second digit of the error.

    Parameters
    ----------
    error : in the unit of the value; None or not finite: unknown
    digits : significant digits of a number whose error is unknown or zero
    sign : what stands before the error

    Examples
    --------
    >>> with_error(304.36368, 1.9)
    '304.4 ± 1.9'
    >>> with_error(0.034024128)
    '0.034024'
    >>> with_error(3.4e-8, 1e-9)
    '(3.40 ± 0.10) 1e-8'
    """
    if error is None or not (math.isfinite(error) and math.isfinite(value)):
        return f"{value:.{digits}g}"
    if error <= 0.0:
        return f"{value:.{digits}g} {sign} 0"
    places = 1 - math.floor(math.log10(error))
    if places > 6:
        power = math.floor(math.log10(max(abs(value), error)))
        scale = 10.0**power
        return f"({with_error(value / scale, error / scale, digits, sign)}) 1e{power}"
    value, error = round(value, places), round(error, places)
    return f"{value:.{max(places, 0)}f} {sign} {error:.{max(places, 0)}f}"
