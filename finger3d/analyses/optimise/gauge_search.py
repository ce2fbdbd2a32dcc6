"""Search for the places and directions of gauges that together determine mu best.

The gauges are found one after another, each the best beside those before it (greedy), and then exchanged one at a time
as long as that helps: first on a grid over the whole region, then on finer and finer ones around each gauge.  Their
middles keep a distance: two gauges of that length then overlap in no direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.analyses.optimise.gauge_fields import GaugeFields
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.progress import Progress
from finger3d.sensor.likelihood import ReadingEffects, mu_sd, prior

NOWHERE = "no gauge within these bounds lies in the finger"

SPACING_MM = 3.0
"""Least distance between the middles of two gauges: the length of the measuring grid of a common foil gauge (HBM offers
1.5, 3 and 6 mm, and recommends 3 to 6 mm)."""

_PLACES = 1200
"""Places of the grid over the whole region, about."""

_ANGLES = np.radians(np.arange(0.0, 180.0, 7.5))
"""Directions that are compared on the grid."""

_LARGEST_SWEEPS = 5
"""Rounds of exchange on a grid."""

_REFINEMENTS, _PATCH = 3, np.linspace(-1.0, 1.0, 5)
"""Finer grids around each gauge, each of half the spacing, and their places and directions in spacings."""

_GAIN = 1e-3
"""Decrease of the standard deviation of mu, relative, below which a gauge is not exchanged."""


@dataclass(frozen=True)
class Region:
    """Region of gauge places: bounds of x, y, z (mm) and of the angle (rad)."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]
    angle: tuple[float, float]

    @classmethod
    def of(cls, model: Model) -> Region:
        """Return the whole body at z = 0, in all directions."""
        half, top = model.design.half_length_mm, model.design.height_mm
        return cls((-half, half), (0.0, top), (0.0, 0.0), (0.0, math.pi))

    def grid(self) -> tuple[Float, float]:
        """Return places (p, 3) of a grid with equal spacing along x and y, and the spacing."""
        wide, high = self.x[1] - self.x[0], self.y[1] - self.y[0]
        layers = 1 if self.z[0] == self.z[1] else 3
        spacing = math.sqrt(max(wide * high, 1e-6) * layers / _PLACES)
        x, y = (_cell_middles(low, high, spacing) for low, high in (self.x, self.y))
        z = np.linspace(*self.z, layers)
        return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3), spacing

    def angles(self) -> Float:
        """Return the directions that are compared, rad."""
        low, high = self.angle
        inside = _ANGLES[(_ANGLES >= low - 1e-9) & (_ANGLES <= high + 1e-9)]
        return inside if len(inside) else np.array([0.5 * (low + high)])

    def around(self, place: Float, angle: float, spacing: float, turn: float) -> tuple[Float, Float]:
        """Return places (p, 3) and angles (a,) around a gauge, inside the region."""
        x = np.clip(place[0] + spacing * _PATCH, *self.x)
        y = np.clip(place[1] + spacing * _PATCH, *self.y)
        z = np.unique(np.clip(place[2] + spacing * np.array([-1.0, 0.0, 1.0]), *self.z))
        places = np.stack(np.meshgrid(np.unique(x), np.unique(y), z, indexing="ij"), axis=-1).reshape(-1, 3)
        return places, np.unique(np.clip(angle + turn * _PATCH, *self.angle))


def _cell_middles(low: float, high: float, spacing: float) -> Float:
    count = max(1, round((high - low) / spacing))
    return low + (high - low) * (np.arange(count) + 0.5) / count


@dataclass(frozen=True)
class Candidates:
    """Candidates for a gauge: places (c, 3), angles (c,), and what changes their readings."""

    places: Float
    angles: Float
    effects: ReadingEffects

    @classmethod
    def of(cls, fields: GaugeFields, points: Float, angles: Float) -> Candidates:
        """Return a candidate for every pair of a place and an angle that lies inside the body."""
        effects = fields.effects(points, angles)
        good = np.isfinite(effects.effects).all(axis=(1, 2)) & np.isfinite(effects.variance).all(axis=1)
        places, turned = np.repeat(points, len(angles), axis=0), np.tile(angles, len(points))
        return cls(places[good], turned[good], ReadingEffects(effects.effects[good], effects.variance[good]))


@dataclass(frozen=True)
class PlacedGauge:
    """A place (3,) mm, a direction (rad), and what the gauge there adds to the Fisher matrix (m, 1 + q, 1 + q)."""

    place: Float
    angle: float
    fisher: Float


@dataclass(frozen=True)
class GaugeSet:
    """Gauges that are chosen together.

    Attributes
    ----------
    gauges : in the order in which they were found
    prior : (1 + q, 1 + q) Fisher matrix without them
    spacing_mm : least distance between the middles of two
    """

    gauges: tuple[PlacedGauge, ...]
    prior: Float
    spacing_mm: float

    def objectives(self, candidates: Candidates, instead: int | None = None) -> Float:
        """Return the mean standard deviation (c,) of mu with each candidate more, or instead of a gauge.

        It is infinite for a candidate too near to another gauge.
        """
        values = objectives(self.fisher(without=instead), candidates)
        for i, gauge in enumerate(self.gauges):
            near = np.linalg.norm(candidates.places - gauge.place, axis=1) < self.spacing_mm * (1.0 - 1e-9)
            values[near & (i != instead)] = np.inf
        return values

    def fisher(self, without: int | None = None) -> Float:
        """Return the Fisher matrices (m, 1 + q, 1 + q) of all gauges but one."""
        return self.prior + sum(
            (g.fisher for i, g in enumerate(self.gauges) if i != without), start=np.zeros_like(self.prior)
        )

    @property
    def mu_sd(self) -> Float:
        """Standard deviation (m,) of mu."""
        return mu_sd(self.fisher())

    @property
    def objective(self) -> float:
        """Mean standard deviation of mu."""
        return float(self.mu_sd.mean())

    @property
    def alone(self) -> list[Float]:
        """Standard deviation (m,) of mu by each gauge alone."""
        return [mu_sd(self.prior + gauge.fisher) for gauge in self.gauges]

    def placed(self, gauge: PlacedGauge, instead: int | None = None) -> GaugeSet:
        """Return the set with a gauge more, or with one exchanged."""
        if instead is None:
            return replace(self, gauges=(*self.gauges, gauge))
        return replace(self, gauges=tuple(gauge if i == instead else g for i, g in enumerate(self.gauges)))


def objectives(fixed: Float, candidates: Candidates) -> Float:
    """Return the mean standard deviation (c,) of mu with each candidate beside gauges of Fisher matrices `fixed`."""
    return np.asarray(mu_sd(fixed + candidates.effects.fisher).mean(axis=-1))


def search(
    fields: GaugeFields, region: Region, count: int, report: Progress, spacing_mm: float = SPACING_MM
) -> tuple[GaugeSet, Candidates]:
    """Return the best `count` gauges at a distance `spacing_mm` or more, and the candidates of the whole region.

    The prior standard deviation of mu is that of a uniform distribution over the range of the pressed values.
    """
    report.stage("comparing places")
    spread = (fields.mus[-1] - fields.mus[0]) / math.sqrt(12.0)
    found = GaugeSet((), prior(len(fields.shared), spread), spacing_mm)
    points, spacing = region.grid()
    everywhere = Candidates.of(fields, points, region.angles())
    if not len(everywhere.angles):
        raise Finger3dError(f"optimise --gauges: {NOWHERE}; widen the bounds")
    for number in range(count):
        best, value = _best(found, everywhere)
        if not math.isfinite(value):
            raise Finger3dError(
                f"optimise --gauges {count}: only {number} have room {spacing_mm:g} mm apart within these bounds; "
                "lower --spacing, or widen the bounds"
            )
        found = found.placed(best)
        report.stage(f"{number + 1} gauge{'s' if number else ''}: mu +- {found.objective:.3g} in the mean")
    found = _exchanged(found, lambda _: everywhere)
    turn = math.radians(7.5)
    for _ in range(_REFINEMENTS):
        spacing, turn = 0.5 * spacing, 0.5 * turn
        found = _exchanged(
            found,
            lambda g, s=spacing, t=turn: Candidates.of(fields, *region.around(g.place, g.angle, s, t)),  # type: ignore[misc]
        )
    report.stage(f"polished: mu +- {found.objective:.3g} in the mean")
    return found, everywhere


def _best(found: GaugeSet, candidates: Candidates, instead: int | None = None) -> tuple[PlacedGauge, float]:
    """Return the best candidate beside gauges, or instead of one of them, and its objective."""
    values = found.objectives(candidates, instead)
    i = int(np.argmin(values))
    effects, variance = candidates.effects.effects[i], candidates.effects.variance[i]
    chosen = PlacedGauge(candidates.places[i], float(candidates.angles[i]), ReadingEffects(effects, variance).fisher)
    return chosen, float(values[i])


def _exchanged(found: GaugeSet, candidates: Callable[[PlacedGauge], Candidates]) -> GaugeSet:
    """Exchange one gauge at a time for a better one, until none helps."""
    for _ in range(_LARGEST_SWEEPS):
        before = found.objective
        for i, gauge in enumerate(found.gauges):
            other, value = _best(found, candidates(gauge), instead=i)
            if value < found.objective * (1.0 - _GAIN):
                found = found.placed(other, instead=i)
        if found.objective >= before * (1.0 - _GAIN):
            break
    return found
