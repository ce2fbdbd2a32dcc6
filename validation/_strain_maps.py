"""Strain over a section for several values of mu, which shows where a gauge is sensitive to mu, and its pictures.

The displacement is linear in the contact forces, so one solution with the stored factor gives the fields of all mu.
The strain is evaluated at the middle of every square of a grid, inside the cell that holds it, as for a point gauge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.analyses.gauge_places import StrainField
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

PIXEL_MM = 1.0

ANGLES = np.radians(np.arange(0.0, 180.0, 5.0))
"""Gauge directions that are compared for the best one."""

_WORST_RESOLUTION = 10.0  # upper end of the colour scale, in multiples of the limit; grey beyond
_BEST_RESOLUTION = 0.05  # lower end of the colour scale, in multiples of the limit
_QUANTILE = 0.99  # share of the squares within the colour scale of the slope


@dataclass(frozen=True)
class StrainMap:
    """Strain over the plane z = 0 for ascending mu (m,).

    Attributes
    ----------
    x, y : (nx,), (ny,) mm, the middles of the squares
    field : of the presses; nan outside the body
    """

    mu: Float
    x: Float
    y: Float
    field: StrainField

    @classmethod
    def of(cls, problem: Problem, steps: Mapping[float, StepResult], pixel_mm: float = PIXEL_MM) -> StrainMap:
        """Recover the field of every step with the factor at hand."""
        design, mus = problem.model.design, sorted(steps)
        nx, ny = math.ceil(design.half_length_mm / pixel_mm), math.ceil(design.height_mm / pixel_mm)
        x = np.arange(-nx + 0.5, nx, dtype=np.float64) * pixel_mm
        y = np.arange(0.5, ny, dtype=np.float64) * pixel_mm
        return cls(np.array(mus), x, y, StrainField.of_frames(problem, [steps[mu] for mu in mus], mus))

    def along(self, angle: float) -> Float:
        """Return the normal strain (m, ny, nx) along a direction (radians)."""
        return self._along(np.array([angle]))[0]

    def _along(self, angles: Float) -> Float:
        """Return the normal strain (a, m, ny, nx) along directions (a,)."""
        points = np.stack([*np.meshgrid(self.x, self.y), np.zeros((len(self.y), len(self.x)))], axis=-1)
        strain = self.field.strain(points.reshape(-1, 3), angles).T
        return strain.swapaxes(0, 1).reshape(len(angles), len(self.mu), len(self.y), len(self.x))

    def slope_at(self, angle: float, mu: float) -> Float:
        """d strain / d mu (ny, nx) along a direction in the interval that holds mu."""
        interval = np.clip(np.searchsorted(self.mu, mu, side="right") - 1, 0, len(self.mu) - 2)
        change = np.diff(self.along(angle)[interval : interval + 2], axis=0)[0]
        return np.asarray(change / np.diff(self.mu)[interval])

    def worst_slope(self, angles: Float, low: float = -math.inf, high: float = math.inf) -> Float:
        """Return the smallest |d strain / d mu| (a, ny, nx) over mu from `low` to `high`; 0 where it changes sign."""
        middle = 0.5 * (self.mu[1:] + self.mu[:-1])
        slope = np.diff(self._along(angles), axis=1) / np.diff(self.mu)[:, None, None]
        part = slope[:, (middle >= low) & (middle <= high)]
        least, most = part.min(axis=1), part.max(axis=1)
        turns = np.where(np.isnan(least), least, 0.0)
        return np.where(least * most > 0.0, np.minimum(np.abs(least), np.abs(most)), turns)

    def best(self, low: float = -math.inf, high: float = math.inf) -> tuple[Float, Float]:
        """Return the largest worst slope (ny, nx) over mu from `low` to `high`, and its direction (radians)."""
        every = self.worst_slope(ANGLES, low, high)
        pick = np.nan_to_num(every, nan=-1.0).argmax(axis=0)
        value = np.take_along_axis(every, pick[None], axis=0)[0]
        return value, np.where(np.isnan(value), np.nan, ANGLES[pick])


def _edges(at: Float) -> Float:
    """Return the n + 1 edges of the squares around n equidistant positions."""
    half = 0.5 * (at[1] - at[0])
    return np.append(at - half, at[-1] + half)


def _colour_bar(figure: Figure, axes: Axes, drawn: ScalarMappable, label: str, extend: str) -> None:
    figure.colorbar(drawn, ax=axes, label=label, extend=extend, location="bottom", shrink=0.8, aspect=35)


def slope_panel(figure: Figure, axes: Axes, found: StrainMap, angle: float, mu: float) -> None:
    """Draw the slope of strain against mu, per unit of mu, along a direction `angle`, in rad, at one mu."""
    value = found.slope_at(angle, mu)
    most = float(np.nanquantile(np.abs(value), _QUANTILE)) or 1.0
    drawn = axes.pcolormesh(_edges(found.x), _edges(found.y), value, cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set_aspect("equal")
    _colour_bar(figure, axes, drawn, "strain per unit of mu", "both")


def resolution_panel(figure: Figure, axes: Axes, found: StrainMap, value: Float, limit: float) -> None:
    """Draw a resolution of mu, shape (ny, nx), on a logarithmic scale; grey beyond ten times the limit."""
    from matplotlib.colors import LogNorm

    norm = LogNorm(_BEST_RESOLUTION * limit, _WORST_RESOLUTION * limit)
    shown = np.ma.masked_invalid(value)
    edges = _edges(found.x), _edges(found.y)
    axes.pcolormesh(*edges, np.where(np.isnan(value), np.nan, 1.0), cmap="Greys", vmin=0, vmax=4)
    told = np.ma.masked_greater(shown, _WORST_RESOLUTION * limit)
    drawn = axes.pcolormesh(*edges, told, cmap="viridis_r", norm=norm)
    axes.set_aspect("equal")
    _colour_bar(figure, axes, drawn, "standard deviation of mu", "min")
