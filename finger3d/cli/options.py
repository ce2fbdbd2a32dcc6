"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.analyses.calibrate import TOLERANCES
from finger3d.errors import Finger3dError

Flag = Annotated[bool, Parameter(negative=())]
"""An option without a value and without an opposite."""

Texts = Annotated[list[str], Parameter(negative=())]
"""An option that may be repeated."""

Paths = Annotated[list[Path], Parameter(negative=())]
"""Files; the option may be repeated."""

Set = Annotated[
    list[str] | None,
    Parameter(name="--set", negative=(), help="Override a key, for instance friction.mu=0.5; may be repeated."),
]

Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative=(),
        help="Write only JSON to standard output, for scripts; all other text goes to standard error.",
    ),
]

Out = Annotated[Path, Parameter(help="Folder for the results.")]

Continued = Annotated[Path, Parameter(help="Folder for the results; what was interrupted continues there.")]

Noise = Annotated[float, Parameter(help="Standard deviation of a strain reading; the default is that of Maeno 2004.")]


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


Tolerances = Annotated[
    list[str] | None,
    Parameter(
        name="--tolerance",
        negative=(),
        help="Standard deviation of an uncertain quantity, for instance depth_mm=0.05; 0: exact; may be repeated. "
        f"Quantities: {', '.join(TOLERANCES)}. E_percent: unless given, the spread of the modulus of a silicone or a "
        "Shore hardness that the scene names.",
    ),
]


def parsed_tolerances(texts: Sequence[str] | None) -> dict[str, float]:
    """Return standard deviations by name from texts such as ``depth_mm=0.05``."""
    stds = {}
    for text in texts or ():
        name, _, value = text.partition("=")
        try:
            stds[name.strip()] = float(value)
        except ValueError:
            raise Finger3dError(f"--tolerance {text}: must be NAME=NUMBER, for instance depth_mm=0.05") from None
    return stds
