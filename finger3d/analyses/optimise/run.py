"""Optimisation of the free keys of a scene: the search and its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from finger3d.analyses.effects_by_need import settled_tables
from finger3d.analyses.free_keys import Bounds, free_keys
from finger3d.analyses.optimise.search import Search
from finger3d.analyses.optimise.task import MUS, Evaluation, OptimisationProblem, checked_start
from finger3d.errors import MissingError
from finger3d.io import claimed, write_json, write_text
from finger3d.plotting.optimise import draw
from finger3d.progress import QUIET, Progress
from finger3d.report.optimise import optimise_page
from finger3d.results.journal import opened
from finger3d.scene import Scene, Source


@dataclass(frozen=True)
class OptimisationResult:
    """Result of a search over the free `keys`; `scene` is the best design.

    `evaluations` are in the order of the search and may repeat; evaluations.csv has `distinct_designs` lines.
    """

    keys: tuple[str, ...]
    best: Evaluation
    start: Evaluation
    evaluations: tuple[Evaluation, ...]
    distinct_designs: int
    bodies: int
    scene: Scene


def optimise(
    scene: Source,
    free: Bounds,
    out: str | Path,
    gauge: str | None = None,
    mus: Sequence[float] | None = None,
    noise: float = 1.5e-4,
    budget: int = 60,
    seed: int = 0,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> OptimisationResult:
    """Search for the values of free keys with the largest sensitivity of a gauge to friction.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene; the start of the search
    free : key -> lower and upper bound, for instance ``{"gauge.g36.x_mm": (10.0, 48.0)}``, or texts such as
        ``"gauge.g36.x_mm=10:48"``
    out : folder for evaluations.csv, best.toml and report.html; the same search is continued there
    gauge : name of the gauge whose sensitivity counts; None: the first
    mus : friction coefficients, ascending; None: nine from 0.05 to 1
    noise : standard deviation of a strain reading
    budget : number of designs, or of bodies if gauges are searched in each
    seed : of the random numbers
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : receives the progress at every design

    Returns
    -------
    OptimisationResult
        With the best design as a scene that can be pressed.

    Raises
    ------
    Finger3dError
        For a mistake in the arguments; a MissingError if no design within the bounds gives a number.
    """
    given, path = settled_tables(scene, overrides, report or QUIET)
    problem = OptimisationProblem(
        given=given,
        free=free_keys(free),
        path=path,
        gauge=gauge,
        mus=MUS if mus is None else tuple(mus),
        noise=noise,
        budget=budget,
        seed=seed,
    )
    return find_best(problem, out, report)


def find_best(problem: OptimisationProblem, out: str | Path, report: Progress | None = None) -> OptimisationResult:
    """Search within the bounds for the design with the largest objective.

    Parameters
    ----------
    out : folder for evaluations.jsonl (every design once it is evaluated), evaluations.csv, best.toml, design.json,
        design.png and report.html; the same search is continued there

    Raises
    ------
    Finger3dError
        For a mistake in the problem; a MissingError if no design within the bounds gives a number.
    """
    start = checked_start(problem)
    with (
        claimed(out, "optimise") as folder,
        opened(folder / "evaluations.jsonl", folder / "search.json", problem.identity()) as journal,
    ):
        for name in ("design.png", "report.html"):
            (folder / name).unlink(missing_ok=True)
        search = Search(problem, report or Progress(), journal)
        _run_search(search, folder, start)
        return _write_result(search, folder)


def _run_search(search: Search, folder: Path, start: tuple[float, ...]) -> None:
    """Search from the evaluation of the start, and write the best design even if interrupted."""
    if search.known:
        search.report.say(f"{len(search.known)} designs are kept from an earlier run")
    search.report.stage("searching")
    try:
        search.evaluate(start)
        search.run(start)
    finally:
        if search.known:
            search.write_table(folder / "evaluations.csv")
        if best := search.best():
            _write_best(search, folder, best)


def _write_result(search: Search, folder: Path) -> OptimisationResult:
    """Write the best design with its increments, the figure and the page."""
    problem, best, first = search.problem, search.best(), search.done[0]
    if best is None:
        raise MissingError(f"optimise: no design within the bounds gives a number; the first: {first.outcome}")
    search.report.stage("increments of the best")
    _write_best(search, folder, best, search.increments(best.values))
    known = tuple(search.known.values())
    draw(
        folder / "design.png",
        [f.key for f in problem.free],
        [e.values for e in known],
        [e.value for e in known],
        first.values,
        "sensitivity",
    )
    optimise_page(folder).write(folder)
    return OptimisationResult(
        keys=tuple(f.key for f in problem.free),
        best=best,
        start=first,
        evaluations=tuple(search.done),
        distinct_designs=len(known),
        bodies=search.bodies,
        scene=problem.scene(best.values),
    )


def _write_best(search: Search, folder: Path, best: Evaluation, increments: Mapping[str, object] | None = None) -> None:
    problem, first = search.problem, search.done[0]
    write_text(folder / "best.toml", problem.scene(best.values).to_toml(defaults=False))
    names = [f.key for f in problem.free]
    write_json(
        folder / "design.json",
        {
            "objective": "sensitivity",
            "best": best.value,
            "values": dict(zip(names, best.values, strict=True)),
            "start": first.value,
            "start_values": dict(zip(names, first.values, strict=True)),
            "designs": len(search.done),
            "bodies": search.bodies,
            "increments": increments or {},
        },
    )
