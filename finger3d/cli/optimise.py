"""Command ``optimise``: the values of free keys of a scene with the largest objective."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Noise, Set, app, check_writable, job, print_json, print_rows
from finger3d.cli.tolerances import Tolerances, parsed_tolerances
from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from finger3d.analyses.optimise.run import OptimisationResult


@app.command
def optimise(
    scene: Path,
    /,
    *,
    free: Annotated[
        list[str] | None,
        Parameter(
            negative=(), help="A free key and its bounds, for instance finger.radius_mm=60:200; may be repeated."
        ),
    ] = None,
    out: Annotated[Path, Parameter(help="Folder for the results; an interrupted search continues there.")],
    gauges: Annotated[
        int | None,
        Parameter(
            help="Find the places and directions of so many gauges that together determine mu best, with all "
            "tolerances of a calibration; --free bounds gauge.x_mm, gauge.y_mm, gauge.z_mm and gauge.angle_deg."
        ),
    ] = None,
    spacing: Annotated[
        float, Parameter(help="Least distance of two of these, mm: their length, so that none overlap.")
    ] = 3.0,
    tolerance: Tolerances = None,
    objective: Annotated[
        str, Parameter(help="sensitivity, or a Python file with objective(table) -> number; the largest is best.")
    ] = "sensitivity",
    gauge: Annotated[str | None, Parameter(help="Gauge that the objective uses; default: the first.")] = None,
    mu: Annotated[
        str | None, Parameter(help="Ascending values of mu, with commas; default: nine from 0.05 to 1.")
    ] = None,
    noise: Noise = 1.5e-4,
    budget: Annotated[
        int, Parameter(help="Number of designs; of bodies, if keys of gauges are optimised for each body.")
    ] = 60,
    seed: Annotated[int, Parameter(help="Seed of the random number generator.")] = 0,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Search for the design with the largest objective, starting from the scene; or for the places of several gauges.

    If only keys of gauges are free, all designs share one condensed body.

    Example: finger3d optimise scene.toml --free gauge.g36.x_mm=10:48 --free gauge.g36.angle_deg=0:90 --out best

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    if gauges is not None:
        _place_gauges(scene, gauges, free or [], out, mu, noise, tolerance, set_, json_, spacing)
        return
    from finger3d.analyses.optimise.run import optimise as run

    check_writable(out, scene)
    kept = f"every evaluated design is kept in {out}; the same command continues"
    mus = _mus(mu) if mu else None
    with job(json_, lambda _: kept) as report:
        result = run(scene, free or (), out, objective, gauge, mus, noise, budget, seed, set_ or (), report)
    _print_design(result, out, json_)


def _print_design(result: OptimisationResult, out: Path, json_: bool) -> None:
    """Print the best design."""
    from finger3d.results.summary import read_json

    design = read_json(out / "design.json")
    if json_:
        print_json(design)
        return
    name, chosen = Path(design["objective"]).name, zip(result.keys, result.best.values, strict=True)
    print_rows(
        result.scene.title,
        [
            (f"objective ({name})", f"{result.best.value:.5g}, at the start {result.start.value:.5g}"),
            *((key, f"{value:.5g}") for key, value in chosen),
            ("evaluated", f"{result.distinct_designs} designs, {result.bodies} bodies condensed"),
            ("results", str(out / "best.toml")),
            ("", str(out / "evaluations.csv")),
            ("", str(out / "report.html")),
        ],
    )


def _place_gauges(
    scene: Path,
    count: int,
    free: list[str],
    out: Path,
    mu: str | None,
    noise: float,
    tolerance: list[str] | None,
    set_: list[str] | None,
    json_: bool,
    spacing_mm: float,
) -> None:
    """Find the places of several gauges, and print them."""
    from finger3d.analyses.optimise.gauge_run import place_gauges

    check_writable(out, scene)
    with job(json_, lambda _: "nothing was written") as report:
        mus, tolerances = _mus(mu) if mu else None, parsed_tolerances(tolerance)
        result = place_gauges(scene, count, out, free, mus, noise, tolerances, set_ or (), report, spacing_mm)
    data = result.as_dict()
    if json_:
        print_json(data)
        return
    rows = [
        (
            g["name"],
            f"x {g['x_mm']:.1f}, y {g['y_mm']:.1f}, z {g['z_mm']:.1f} mm, {g['angle_deg']:.1f} degrees: mu +- "
            f"{g['mean_mu_sd_with_those_before']:.3g} with those before, {g['mean_mu_sd_alone']:.3g} alone",
        )
        for g in data["gauges"]
    ]
    print_rows(
        result.scene.title,
        [
            *rows,
            ("together", f"mu +- {data['mean_mu_sd']:.3g}, mean over mu = {result.mus[0]:g} to {result.mus[-1]:g}"),
            ("results", str(out / "best.toml")),
            ("", str(out / "report.html")),
        ],
    )


def _mus(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise Finger3dError(f"--mu {text}: must be numbers with commas, for instance 0.06,0.25,1") from None
