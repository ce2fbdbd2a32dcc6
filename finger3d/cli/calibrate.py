"""calibrate: from a scene to strain against mu."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.cli.common import Json, Set, app, check_writable, complain, load, print_json, print_rows, reporting
from finger3d.errors import Finger3dError, MissingError

Tolerances = Annotated[
    list[str] | None,
    Parameter(
        name="--tolerance",
        negative=(),
        help="Standard deviation of something not known exactly, for instance depth_mm=0.05; 0 leaves it out; may be "
        f"repeated. Of {', '.join(TOLERANCES)}.",
    ),
]


@app.command
def calibrate(
    scene: Path,
    /,
    *,
    gauge: Annotated[str, Parameter(help="Name of a [[gauge]] of the scene.")],
    out: Annotated[Path, Parameter(help="Folder for the results.")],
    mu: Annotated[str, Parameter(help="first:last:count, or numbers with commas.")] = "0.02:1.2:25",
    noise: Annotated[float, Parameter(help="Standard deviation of a strain reading; the paper's.")] = 1.5e-4,
    resolution: Annotated[float, Parameter(help="Resolution of mu beyond which the gauge is called blind.")] = 0.1,
    tolerance: Tolerances = None,
    map_: Annotated[
        bool, Parameter(name="--map", negative=(), help="Also map how far strains follow mu over the section.")
    ] = False,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Strain of a gauge against mu: curve, second-order fit, resolution, usable range, and what else moves it.

    Example: finger3d calibrate scene.toml --gauge g36 --out cal

    Parameters
    ----------
    scene
        The scene file (TOML); its own friction.mu does not matter.
    """
    loaded = load(scene, set_)
    check_writable(out, scene)
    from finger3d.analyses.calibrate.run import calibrate as run
    from finger3d.analyses.calibrate.run import parsed_mus
    from finger3d.sensor.curve import summary
    from finger3d.sensor.files import as_dict

    report, aside = reporting(json_)
    try:
        with aside, report:
            found = run(
                loaded, gauge, out, parsed_mus(mu), noise, resolution, _tolerances(tolerance), report, maps=map_
            )  # fmt: skip
    except KeyboardInterrupt:
        complain(f"interrupted; {report.steps_done} of {report.steps_total} values of mu are kept in {out}")
        return 130
    if json_:
        print_json(as_dict(found))
    else:
        print_rows(loaded.title, [*summary(found), ("results", str(out))])
        print(found.verdict())
    if not found.failed:
        return 0
    first = found.failed[0]
    complain(
        f"{scene}: {len(found.failed)} of {report.steps_total} values of mu gave no strain, the first mu = "
        f"{first[0]:.4g} {first[1]}"
    )
    return MissingError.exit_code


def _tolerances(texts: Sequence[str] | None) -> dict[str, float]:
    found = {}
    for text in texts or ():
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise Finger3dError(f"--tolerance {text}: must be NAME=NUMBER, for instance depth_mm=0.05") from None
    return found
