"""Command ``optimise``: the values of free keys of a scene with the largest objective, or places of gauges."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from finger3d.cli.common import Continued, Json, Noise, Set, Texts, app, check_writable, job, print_json, print_rows
from finger3d.cli.tolerances import Tolerances, parsed_tolerances

if TYPE_CHECKING:
    from finger3d._types import TreeView

    Found = tuple[str, list[tuple[str, str]], TreeView]  # title, rows of the printed table, and JSON


@dataclass(frozen=True, kw_only=True)
class OptimiseOptions:
    """What is free, and what is best.

    Parameters
    ----------
    free
        A free key and its bounds, for instance finger.radius_mm=60:200; may be repeated.
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

    @property
    def mus(self) -> tuple[float, ...] | None:
        """Values of mu; None for those of the default."""
        from finger3d.analyses.calibrate.settings import parsed_mus

        return parsed_mus(self.mu) if self.mu else None


@app.command
def optimise(
    scene: Path,
    /,
    *,
    out: Continued,
    options: Annotated[OptimiseOptions, Parameter(name="*")] = OptimiseOptions(),
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
    check_writable(out, scene)
    search = _find_design if options.gauges is None else _place_gauges
    title, rows, data = search(scene, out, options, set_ or [], json_)
    if json_:
        print_json(data)
    else:
        print_rows(title, [*rows, ("", str(out / "report.html"))])


def _find_design(scene: Path, out: Path, o: OptimiseOptions, set_: list[str], json_: bool) -> Found:
    """Return the best design."""
    from finger3d.analyses.optimise.run import optimise as run
    from finger3d.results.summary import read_json

    kept = f"every evaluated design is kept in {out}; the same command continues"
    with job(json_, lambda _: kept) as report:
        result = run(scene, o.free or (), out, o.gauge, o.mus, o.noise, o.budget, o.seed, set_, report)
    design = read_json(out / "design.json")
    chosen = zip(result.keys, result.best.values, strict=True)
    rows = [
        (
            f"objective ({Path(design['objective']).name})",
            f"{result.best.value:.5g}, at the start {result.start.value:.5g}",
        ),
        *((key, f"{value:.5g}") for key, value in chosen),
        ("evaluated", f"{result.distinct_designs} designs, {result.bodies} bodies condensed"),
        ("results", str(out / "best.toml")),
        ("", str(out / "evaluations.csv")),
    ]
    return result.scene.title, rows, design


def _place_gauges(scene: Path, out: Path, o: OptimiseOptions, set_: list[str], json_: bool) -> Found:
    """Return the places of several gauges."""
    from finger3d.analyses.optimise.gauge_run import place_gauges

    with job(json_, lambda _: "nothing was written") as report:
        tolerances = parsed_tolerances(o.tolerance)
        result = place_gauges(
            scene, o.gauges or 0, out, o.free or [], o.mus, o.noise, tolerances, set_, report, o.spacing
        )
    data = result.as_dict()
    rows = [
        (
            g["name"],
            f"x {g['x_mm']:.1f}, y {g['y_mm']:.1f}, z {g['z_mm']:.1f} mm, {g['angle_deg']:.1f} degrees: mu +- "
            f"{g['mean_mu_sd_with_those_before']:.3g} with those before, {g['mean_mu_sd_alone']:.3g} alone",
        )
        for g in data["gauges"]
    ]
    spread = f"mu +- {data['mean_mu_sd']:.3g}, mean over mu = {result.mus[0]:g} to {result.mus[-1]:g}"
    return result.scene.title, [*rows, ("together", spread), ("results", str(out / "best.toml"))], data
