"""A rigid object with a cosine as its section."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from finger3d._ranges import Length, Zero
from finger3d._types import Float
from finger3d.objects.rigid import Axis, Detail, Prism

_NEAREST_STARTS = 17, 65
"""Points over one wavelength from which the nearest point is searched: of a wave with slopes up to 1, and of others."""

_NEAREST_ITERATIONS = 60
"""Largest number of bisected Newton steps of that search."""


@dataclass(frozen=True)
class Wave(Prism):
    """A cosine, lowest at (x_mm, z_mm): height = amplitude (1 - cos(2 pi r / wavelength)).

    Attributes
    ----------
    wavelength_mm : from crest to crest
    amplitude_mm : half of crest to valley
    axis : direction of the crests
    """

    wavelength_mm: Length = field(kw_only=True)
    amplitude_mm: Zero | Length = field(kw_only=True)
    axis: Axis = field(default="z", kw_only=True)

    def section_distance(self, r: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the distance to the nearest point, found by Newton's method between the best of many starts."""
        nearest = self._nearest(r, y)
        height, slope = self.section_profile(nearest), self._slope(nearest)
        out_r, out_y = r - nearest, y - height
        root = np.sqrt(1.0 + slope**2)
        sign = np.where(y > self.section_profile(r), -1.0, 1.0)
        # The normal of the nearest point is the gradient, on the surface too, where the difference is round-off.
        return sign * np.hypot(out_r, out_y), slope / root, -1.0 / root

    def clearance(self, points: Float) -> Float:
        """Return the vertical distance over that of the steepest slope: far quicker than the nearest point."""
        r = points[:, 2 if self.axis == "x" else 0]
        return np.asarray((self.section_profile(r) - points[:, 1]) / math.hypot(1.0, self._steepest))

    def section_profile(self, r: Float) -> Float:
        """Return amplitude (1 - cos(2 pi r / wavelength))."""
        return self.amplitude_mm * (1.0 - np.cos(self._wavenumber * r))

    @property
    def _wavenumber(self) -> float:
        return 2.0 * math.pi / self.wavelength_mm

    @property
    def _steepest(self) -> float:
        return self.amplitude_mm * self._wavenumber

    def _slope(self, r: Float) -> Float:
        return self._steepest * np.sin(self._wavenumber * r)

    def _nearest(self, r: Float, y: Float) -> Float:
        """Return where (n,) the curve is nearest to points: a root of f(s) = s - r + (h(s) - y) h'(s)."""
        count = _NEAREST_STARTS[bool(self._steepest > 1.0)]
        starts = r[:, None] + np.linspace(-0.5, 0.5, count) * self.wavelength_mm
        square = (starts - r[:, None]) ** 2 + (self.section_profile(starts) - y[:, None]) ** 2
        best = np.clip(square.argmin(axis=1), 1, count - 2)
        number = np.arange(len(r))
        low, high, s = (starts[number, best + i].copy() for i in (-1, 1, 0))
        for _ in range(_NEAREST_ITERATIONS):
            height, slope = self.section_profile(s), self._slope(s)
            f = s - r + (height - y) * slope
            bend = 1.0 + slope**2 + (height - y) * self._steepest * self._wavenumber * np.cos(self._wavenumber * s)
            low, high = np.where(f < 0.0, s, low), np.where(f < 0.0, high, s)
            newton = s - f / np.where(bend > 0.0, bend, 1.0)
            inside = (bend > 0.0) & (newton > low) & (newton < high)
            after = np.where(inside, newton, 0.5 * (low + high))
            change = np.abs(after - s).max(initial=0.0)
            s = after
            if change <= 1e-15 * (self.wavelength_mm + float(np.abs(r).max(initial=0.0))):
                break
        return np.asarray(s)

    @property
    def is_convex(self) -> bool:
        """Whether the body is convex: only without amplitude."""
        return self.amplitude_mm == 0.0

    @property
    def detail(self) -> Detail:
        """The wavelength."""
        return Detail("wavelength_mm", self.wavelength_mm, "wavelength")
