"""Options of ``calibrate`` and ``estimate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.options import Noise
from finger3d.cli.tolerances import Tolerances


@dataclass(frozen=True, kw_only=True)
class CalibrationOptions:
    """What is calibrated, and how well readings and scene are known.

    Parameters
    ----------
    gauge
        Name of a [[gauge]] of the scene; or several readings together, with commas: gauges, m1.x of a
        [[marker]], taxels.
    mu
        Values of mu: first:last:count, or numbers separated by commas.
    marker_noise
        Standard deviation of a reading of a marker, mm.
    taxel_noise
        Standard deviation of a reading of a taxel, MPa.
    resolution
        Largest standard deviation of mu at which the sensor is usable.
    """

    gauge: str
    mu: str = "0.02:1.2:25"
    noise: Noise = 1.5e-4
    marker_noise: float = 0.02
    taxel_noise: float = 1e-3
    resolution: float = 0.1
    tolerance: Tolerances = None


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """Where readings come from.

    Parameters
    ----------
    strain
        A reading; or NAME=READING, repeated for each of several calibrated readings.
    std
        Standard deviation of the readings, or NAME=NUMBER for one of several; default: the noise of the
        calibration.
    csv
        CSV file of readings: a column for each, NAME, and optionally NAME_std; of a single reading strain and
        std will do.
    follow
        The same, with lines still being written: a file, or - for standard input.
    """

    strain: Annotated[list[str] | None, Parameter(negative=(), allow_leading_hyphen=True)] = None
    std: Annotated[list[str] | None, Parameter(negative=(), allow_leading_hyphen=True)] = None
    csv: Path | None = None
    follow: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None
