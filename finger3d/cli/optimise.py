"""Command ``optimise``: the values of free keys of a scene with the largest objective."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Noise, Set, app, check_writable, job, print_json, print_rows
from finger3d.errors import Finger3dError


@app.command
def optimise(
    scene: Path,
    /,
    *,
    free: Annotated[
        list[str],
        Parameter(
            negative=(), help="A free key and its bounds, for instance finger.radius_mm=60:200; may be repeated."
        ),
    ],
    out: Annotated[Path, Parameter(help="Folder for the results; an interrupted search continues there.")],
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
    method: Annotated[
        str, Parameter(help="differential-evolution, dual-annealing or nelder-mead.")
    ] = "differential-evolution",
    seed: Annotated[int, Parameter(help="Seed of the random number generator.")] = 0,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Search for the design with the largest objective, starting from the scene.

    If only keys of gauges are free, all designs share one condensed body.

    Example: finger3d optimise scene.toml --free gauge.g36.x_mm=10:48 --free gauge.g36.angle_deg=0:90 --out best

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    from finger3d.analyses.optimise.run import optimise
    from finger3d.analyses.optimise.task import MUS, FreeKey, OptimisationProblem
    from finger3d.results.summary import read_json
    from finger3d.scene import tree

    problem = OptimisationProblem(
        given=tree.override(tree.read(scene), set_ or []),
        free=tuple(FreeKey.of(text) for text in free),
        objective=objective,
        path=scene,
        gauge=gauge,
        mus=_mus(mu) if mu else MUS,
        noise=noise,
        budget=budget,
        method=method,
        seed=seed,
    )
    check_writable(out, scene)
    kept = f"every evaluated design is kept in {out}; the same command continues"
    with job(json_, lambda _: kept) as report:
        found = optimise(problem, out, report)
    if json_:
        print_json(read_json(out / "design.json"))
        return
    chosen = zip((f.key for f in problem.free), found.best.values, strict=True)
    print_rows(
        found.scene.title,
        [
            ("objective", f"{found.best.value:.5g}, at the start {found.start.value:.5g}"),
            *((key, f"{value:.5g}") for key, value in chosen),
            ("evaluated", f"{found.distinct_designs} designs, {found.bodies} bodies condensed"),
            ("results", str(out / "best.toml")),
            ("", str(out / "evaluations.csv")),
            ("", str(out / "report.html")),
        ],
    )


def _mus(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise Finger3dError(f"--mu {text}: must be numbers with commas, for instance 0.06,0.25,1") from None
