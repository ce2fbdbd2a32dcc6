"""Option ``--tolerance`` of the commands that account for uncertain quantities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from cyclopts import Parameter

from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.errors import Finger3dError

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
