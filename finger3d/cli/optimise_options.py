"""Options of ``optimise``: what is free, and what is best."""

from __future__ import annotations

from dataclasses import dataclass

from finger3d.cli.options import Noise, Texts
from finger3d.cli.tolerances import Tolerances


@dataclass(frozen=True, kw_only=True)
class OptimiseOptions:
    """What is free, and what is best.

    Parameters
    ----------
    free
        A free key and its bounds, for instance finger.radius_mm=60:200; may be repeated.
    gauges
        Find the places and directions of so many gauges that together determine mu best, with all tolerances of
        a calibration; --free bounds gauge.x_mm, gauge.y_mm, gauge.z_mm and gauge.angle_deg.
    spacing
        Least distance of two of these, mm: their length, so that none overlap.
    gauge
        Gauge whose sensitivity to friction is to be largest; default: the first.
    mu
        Ascending values of mu, with commas; default: nine from 0.05 to 1.
    budget
        Number of designs; of bodies, if keys of gauges are optimised for each body.
    seed
        Seed of the random number generator.
    """

    free: Texts | None = None
    gauges: int | None = None
    spacing: float = 3.0
    tolerance: Tolerances = None
    gauge: str | None = None
    mu: str | None = None
    noise: Noise = 1.5e-4
    budget: int = 60
    seed: int = 0
