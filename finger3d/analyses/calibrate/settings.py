"""What a calibration is asked for: readings, values of mu, and tolerances, all checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from finger3d._ranges import number
from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import Reading
from finger3d.sensor.curve import FEWEST, LARGEST_STRAIN, Kind

_LARGEST_MU = 1e6


MUS = tuple(float(mu) for mu in np.linspace(0.02, 1.2, 25).round(10))
"""Values of mu that are pressed unless others are given."""

_NOISE_OPTIONS: dict[Kind, str] = {"gauge": "--noise", "marker": "--marker-noise", "taxel": "--taxel-noise"}


@dataclass(frozen=True)
class CalibratedReading:
    """A number that is calibrated: its name in the output, its kind, and the standard deviation of its noise."""

    name: str
    kind: Kind
    noise: float


@dataclass(frozen=True)
class CalibrationSettings:
    """Readings, values of mu, and uncertainties of a calibration.

    Attributes
    ----------
    readings : what is read, with the standard deviations of their noise
    mus : coefficients of friction, ascending
    limit : largest standard deviation of mu at which the sensor is usable
    tolerances : standard deviation of every uncertain quantity, all above zero
    """

    readings: tuple[CalibratedReading, ...]
    mus: tuple[float, ...]
    limit: float
    tolerances: Mapping[str, float]

    def __post_init__(self) -> None:
        """Check the numbers; mu is sorted, and equal values count once."""
        for mu in self.mus:
            if not 0.0 <= mu <= _LARGEST_MU:
                raise Finger3dError(f"--mu: {mu:g}: must be finite numbers from 0 up to 1e6, for instance 0.02:1.2:25")
        object.__setattr__(self, "mus", tuple(sorted({float(mu) for mu in self.mus})))
        count = len(self.mus)
        if count < FEWEST:
            raise Finger3dError(
                f"--mu: {count} different value{'s' if count != 1 else ''}; a calibration needs at least "
                f"{FEWEST}, for instance 0.02:1.2:25"
            )
        noises = ((_NOISE_OPTIONS[r.kind], r.noise, LARGEST_STRAIN) for r in self.readings)
        for name, value, high in (*noises, ("--resolution", self.limit, 1e6)):
            if not 1e-12 <= value <= high:
                raise Finger3dError(f"{name} {value:g}: must be a finite number from 1e-12 to {number(high)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the readings."""
        return tuple(r.name for r in self.readings)

    @property
    def noise(self) -> Float:
        """Standard deviation (k, 1) of the noise of every reading, in its unit."""
        return np.array([[r.noise] for r in self.readings])


def found_readings(model: Model, names: Sequence[str], noises: Mapping[Kind, float]) -> tuple[CalibratedReading, ...]:
    """Return the readings of these names; an unknown name is refused with the nearest one."""
    dim = 3 if model.domain == "solid" else 2
    kinds: dict[Kind, tuple[Reading, ...]] = {"marker": model.markers, "taxel": model.taxels, "gauge": model.gauges}
    known = {c.name: kind for kind, readings in kinds.items() for reading in readings for c in reading.columns(dim)}
    if not names:
        raise Finger3dError("--gauge: no name is given")
    if not known:
        raise Finger3dError(
            f'--gauge {names[0]}: the scene has no [[gauge]]; add one with name = "{names[0]}", x_mm and y_mm'
        )
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise Finger3dError(
                f'--gauge {name}: no such gauge; did you mean "{near}"? the scene has {", ".join(known)}'
            )
        if names.count(name) > 1:
            raise Finger3dError(f"--gauge {name}: named twice")
    return tuple(CalibratedReading(name, known[name], noises[known[name]]) for name in names)


def parsed_mus(text: str) -> tuple[float, ...]:
    """Values of mu from ``first:last:count`` or a list with commas."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            return tuple(float(mu) for mu in np.linspace(float(first), float(last), _count(count)).round(10))
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise Finger3dError(
            f"--mu {text}: must be first:last:count, for instance 0.02:1.2:25, or numbers with commas"
        ) from None


def _count(text: str) -> int:
    count = int(text)
    if not 1 <= count <= 10_000:
        raise ValueError(text)
    return count
