"""Command ``optimise``: the values of free keys of a scene with the largest objective, or places of gauges."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import app, job
from finger3d.cli.options import Continued, Json, Noise, Set, Texts, Tolerances, parsed_tolerances
from finger3d.cli.printing import print_json, print_page


@dataclass(frozen=True, kw_only=True)
class OptimiseOptions:
    """What is free, and what is best.

    Parameters
    ----------
    free
        A free key and its bounds, as finger.radius_mm=60:200; may be repeated. Gauges alone share one condensed body.
    gauges
        Find the places and directions of so many gauges that together determine mu best, with all tolerances of
        a calibration; --free bounds gauge.x_mm, gauge.y_mm, gauge.z_mm and gauge.angle_deg.
    spacing
        Least distance of two of these, mm: their length, so that none overlap.
    gauge
        Gauge whose sensitivity to friction is to be largest; default: the first.
    mu
        Ascending values of mu, with commas; default: nine from 0.05 to 1.
    budget
        Number of designs; of bodies, if keys of gauges are optimised for each body.
    seed
        Seed of the random number generator.
    """

    free: Texts | None = None
    gauges: int | None = None
    spacing: float = 3.0
    tolerance: Tolerances = None
    gauge: str | None = None
    mu: str | None = None
    noise: Noise = 1.5e-4
    budget: int = 60
    seed: int = 0


@app.command
def optimise(
    scene: Path,
    /,
    *,
    out: Continued,
    options: Annotated[OptimiseOptions | None, Parameter(name="*")] = None,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Search for the design with the largest objective, starting from the scene; or for the places of several gauges.

    Example: finger3d optimise scene.toml --free gauge.g36.x_mm=10:48 --free gauge.g36.angle_deg=0:90 --out best

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    from finger3d.analyses.calibrate.settings import parsed_mus
    from finger3d.analyses.gauge_places import place_gauges
    from finger3d.analyses.optimise import optimise as run
    from finger3d.io import check_writable
    from finger3d.report.analyses import gauge_places_page, optimise_page
    from finger3d.results.summary import read_json

    check_writable(out, scene)
    o, sets = options or OptimiseOptions(), set_ or []
    mus = parsed_mus(o.mu) if o.mu else None
    if o.gauges is None:
        with job(json_, lambda _: f"every evaluated design is kept in {out}; the same command continues") as report:
            run(scene, o.free or (), out, o.gauge, mus, o.noise, o.budget, o.seed, sets, report)
    else:
        with job(json_, lambda _: "nothing was written") as report:
            stds = parsed_tolerances(o.tolerance)
            place_gauges(scene, o.gauges, out, o.free or [], mus, o.noise, stds, sets, report, o.spacing)
    if json_:
        print_json(read_json(out / ("design.json" if o.gauges is None else "gauges.json")))
    else:
        page = optimise_page if o.gauges is None else gauge_places_page
        print_page(page(out), (out / name for name in ("best.toml", "report.html")))
