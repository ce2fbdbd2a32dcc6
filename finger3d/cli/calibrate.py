"""Command ``calibrate``: readings as a function of mu."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import app, job, load
from finger3d.cli.options import Json, Noise, Out, Set, Tolerances, parsed_tolerances
from finger3d.cli.printing import print_json, print_rows
from finger3d.errors import MissingError


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


@app.command
def calibrate(
    scene: Path,
    /,
    *,
    out: Out,
    options: Annotated[CalibrationOptions, Parameter(name="*")],
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Calibrate a gauge: strain against mu, second-order fit, resolution, usable range, and effect of tolerances.

    Several readings are calibrated together: mu is separated from errors common to all, such as in the depth.

    Example: finger3d calibrate scene.toml --gauge g36 --out cal

    Parameters
    ----------
    scene
        The scene file (TOML); its friction.mu is ignored.
    """
    loaded = load(scene, set_, out)
    from finger3d.analyses.calibrate.run import calibrate as run
    from finger3d.analyses.calibrate.settings import parsed_mus
    from finger3d.scene.material import moduli
    from finger3d.sensor.calibration import as_dict, summary

    with job(json_, lambda done: f"{done.steps_done} of {done.steps_total} values of mu are kept in {out}") as report:
        names, mus = [name.strip() for name in options.gauge.split(",")], parsed_mus(options.mu)
        known = options.noise, options.resolution, parsed_tolerances(options.tolerance)
        calibration = run(loaded, names, out, mus, *known, report, options.marker_noise, options.taxel_noise)
    if json_:
        print_json(as_dict(calibration))
    else:
        print_rows(loaded.title, [*moduli(loaded.tables).items(), *summary(calibration), ("results", str(out))])
        print(calibration.verdict())
    if calibration.failed:
        mu_failed, why = calibration.failed[0]
        raise MissingError(
            f"{scene}: {len(calibration.failed)} of {report.steps_total} values of mu gave no strain, the first mu = "
            f"{mu_failed:.4g} {why}"
        )
