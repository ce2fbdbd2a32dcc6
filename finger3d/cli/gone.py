"""Commands and options that are gone, with what to do instead."""

from __future__ import annotations

from collections.abc import Sequence

from cyclopts import CycloptsError, UnknownOptionError

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
