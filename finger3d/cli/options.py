"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

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
