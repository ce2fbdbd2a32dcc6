"""Options that several commands share, and those that are gone, with what to do instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import CycloptsError, Parameter, UnknownOptionError

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


COMMANDS = {
    "completion": "use finger3d --completion SHELL",
    "design": "use finger3d optimise",
    "schema": "use finger3d new --schema",
    "validate": "use python -m validation, from a checkout",
}

_INSERT = "draw it as a part of the design with [parts.LABEL] rigid = true: it is printed and inserted"
_PLAIN = "the faces are plain: hold them with --screw, clamps or rubber bands"

OF_EXPORT = {
    **dict.fromkeys(("--carrier", "--carrier-mm", "--key-mm", "--inserts"), _INSERT),
    **dict.fromkeys(("--fasten", "--band-mm", "--seal", "--cord-mm", "--pry", "--no-pry"), _PLAIN),
    **dict.fromkeys(("--plugs", "--no-plugs", "--slot-gap-mm"), "slots of strips are sealed with tape"),
    "--ascii": "STL files are binary; a program that reads them turns them into text",
    "--wall-mm": "the walls are 8 mm thick",
    "--peg-mm": "pegs have a diameter of 4 mm",
    "--lid-mm": "the lid is 4 mm thick",
    "--vent-mm": "vents are as wide as the base allows, at most 2 mm",
    "--foil-length-mm": "give length_mm in [[gauge]]; without it a foil is 5 mm long",
    **dict.fromkeys(
        ("--foil-thickness-mm", "--foil-width-mm"),
        "give them in [effects.embedded_gauge]; without it they are 0.1 and 3 mm",
    ),
    "--riser": "the pour hole is a funnel, of the width --pour-mm at the sensor",
    "--cavities": "print the mold several times",
    "--coupon": "give the clearance of your printer as --clearance-mm",
    "--button": "press a sample with a scene of its own, and finger3d identify",
    "--bed": "the program of the printer arranges the parts",
}

OPTIONS = {
    "calibrate": {"--map": "finger3d optimise --gauges 1 maps how well a gauge at each place tells mu"},
    "estimate": {"--curve": "estimates follow the interpolation of the calibration"},
    "export": OF_EXPORT,
    "optimise": {"--objective": "the objective is the sensitivity of a gauge to friction"},
    "show": {"--gif": "the page of a press has a slider for its increments"},
}


def gone(error: CycloptsError, arguments: Sequence[str]) -> str:
    """Return what to do instead of a command or an option that is gone; empty for any other mistake."""
    command = next(iter(arguments), "")
    if command in COMMANDS:
        return f"{command} is gone: {COMMANDS[command]}"
    options = OPTIONS.get(command, {})
    option = (error.token.keyword or error.token.value).split("=")[0] if isinstance(error, UnknownOptionError) else ""
    return f"{option} is gone: {options[option]}" if option in options else ""
