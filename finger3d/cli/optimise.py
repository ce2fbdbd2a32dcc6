"""optimise: free keys of a scene, chosen for the largest objective."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import Json, Set, app, check_writable, complain, print_json, print_rows, reporting
from finger3d.errors import Finger3dError


@app.command
def optimise(
    scene: Path,
    /,
    *,
    free: Annotated[
        list[str],
        Parameter(negative=(), help="A key and its bounds, for instance finger.radius_mm=60:200; may be repeated."),
    ],
    out: Annotated[Path, Parameter(help="Folder for the results; that of the same search is gone on with.")],
    objective: Annotated[
        str, Parameter(help="sensitivity, or a Python file with objective(table) -> number, the larger the better.")
    ] = "sensitivity",
    gauge: Annotated[str | None, Parameter(help="Gauge that is designed; default the first.")] = None,
    mu: Annotated[str | None, Parameter(help="Values of mu, ascending, with commas; default nine, 0.05 to 1.")] = None,
    noise: Annotated[float, Parameter(help="Standard deviation of a strain reading; the paper's.")] = 1.5e-4,
    budget: Annotated[int, Parameter(help="Designs, or bodies where gauges are searched in each.")] = 60,
    method: Annotated[
        str, Parameter(help="differential-evolution, dual-annealing or nelder-mead.")
    ] = "differential-evolution",
    seed: Annotated[int, Parameter(help="For the optimiser's random numbers.")] = 0,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Search for the design with the largest objective; the scene is where it starts.

    Keys of gauges cost no condensation: where only they are free, the body is solved once.

    Example: finger3d optimise scene.toml --free gauge.g36.x_mm=10:48 --free gauge.g36.angle_deg=0:90 --out best

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    from finger3d.analyses.optimise.run import optimise
    from finger3d.analyses.optimise.task import MUS, FreeKey, OptimisationProblem
    from finger3d.scene import tree

    given = tree.override(tree.read(scene), set_ or [])
    problem = OptimisationProblem(
        given,
        tuple(FreeKey.of(text) for text in free),
        objective,
        scene,
        gauge,
        _mus(mu) if mu else MUS,
        noise,
        budget,
        method,
        seed,
    )
    check_writable(out, scene)
    report, aside = reporting(json_)
    try:
        with aside, report:
            found = optimise(problem, out, report)
    except KeyboardInterrupt:
        complain(f"interrupted; every design judged is kept in {out}; the same command continues")
        return 130
    if json_:
        print_json(json.loads((out / "design.json").read_text(encoding="utf-8")))
        return 0
    chosen = zip((f.key for f in problem.free), found.best.values, strict=True)
    print_rows(
        found.scene.title,
        [
            ("objective", f"{found.best.value:.5g}, at the start {found.start.value:.5g}"),
            *((key, f"{value:.5g}") for key, value in chosen),
            ("judged", f"{found.judged} designs, {found.bodies} bodies condensed"),
            ("results", str(out / "best.toml")),
            ("", str(out / "evaluations.csv")),
            ("", str(out / "report.html")),
        ],
    )
    return 0


def _mus(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise Finger3dError(f"--mu {text}: must be numbers with commas, for instance 0.06,0.25,1") from None
