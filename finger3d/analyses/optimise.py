"""Search for a design: free keys of a scene within bounds, by SciPy's optimisers, for the largest objective.

A body is condensed once and pressed at every mu; gauges are then read from the displacements, so that free keys of
gauges cost no condensation.  Where keys of the body are free as well, the gauges' are searched anew in every body.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.calibrate.curve_points import choose_increments, error_of_increments
from finger3d.analyses.free_keys import Bounds, FreeKey, check_distinct, free_keys, scene_with, settled_tables
from finger3d.analyses.pressed_body import PressedBody, body_key, kept, under
from finger3d.errors import Finger3dError, MissingError
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import automatic, with_steps
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.readings import Gauge, strain_columns
from finger3d.plotting.analyses import draw_optimisation
from finger3d.progress import QUIET, Progress
from finger3d.report.analyses import optimise_page
from finger3d.results.journal import Journal, Row, number_in, opened
from finger3d.scene import Scene, Source, parse, tree
from finger3d.sensor.curve import LARGEST_STRAIN

MUS = tuple(float(v) for v in np.round(np.linspace(0.05, 1.0, 9), 5))


def sensitivity(mu: Float, strain: Float, noise: float) -> float:
    """Return the criterion of Maeno 2004, Sec. III-B: sensitive to mu throughout a large range.

    It is the smallest change of strain per mu between neighbouring values of mu, in units of the noise, which is the
    inverse of the worst resolution of mu.  It is negative where the strain is not monotone.

    Parameters
    ----------
    mu, strain : (n,)
    noise : standard deviation of a strain reading
    """
    slope = np.diff(strain) / np.diff(mu)
    return float((slope * np.sign(strain[-1] - strain[0])).min() / noise)


@dataclass(frozen=True)
class OptimisationProblem:
    """Problem of a design search.

    Attributes
    ----------
    given : the scene as written, overrides included
    gauge : name of the gauge that is designed; None: the first
    budget : designs, or bodies where keys of both body and gauges are free
    """

    given: TreeView
    free: tuple[FreeKey, ...]
    path: Path | None = None
    gauge: str | None = None
    mus: tuple[float, ...] = MUS
    noise: float = 1.5e-4
    budget: int = 60
    seed: int = 0

    def keys(self) -> tuple[str, ...]:
        """Return the keys as they are set, with the numbers of gauges."""
        return tuple(f.numbered(self.given) for f in self.free)

    def scene(self, values: Sequence[float]) -> Scene:
        """Return the scene with these values of the free keys."""
        return scene_with(self.given, self.keys(), values, self.path)

    def identity(self) -> Tree:
        """Return what two runs must have in common to continue each other's evaluations; the budget may differ."""
        return {
            "scene": tree.plain(self.given),
            "files": tree.contents(self.given, self.path),
            "free": [[f.key, f.low, f.high] for f in self.free],
            "gauge": self.gauge,
            "mu": list(self.mus),
            "noise": self.noise,
            "seed": self.seed,
        }


def check_readings(mus: Sequence[float], fewest: int, noise: float) -> None:
    """Raise an error for values of mu that are too few or do not ascend, or for a noise out of range."""
    if len(mus) < fewest or any(b <= a for a, b in pairwise(mus)):
        raise Finger3dError(f"--mu: must be at least {('two', 'three')[fewest - 2]} numbers, ascending")
    if not 1e-12 <= noise <= LARGEST_STRAIN:
        raise Finger3dError(f"--noise {noise:g}: must be a finite number from 1e-12 to {LARGEST_STRAIN:g}")


def checked_start(problem: OptimisationProblem) -> tuple[float, ...]:
    """Return the values of the scene, or the middle of the bounds where they lie outside."""
    if problem.budget < 1:
        raise Finger3dError(f"--budget {problem.budget}: must be at least 1")
    keys = problem.keys()
    if not keys:
        raise Finger3dError("optimise: nothing is free; give at least one --free, such as finger.radius_mm=60:200")
    check_distinct(keys)
    check_readings(problem.mus, 2, problem.noise)
    if problem.seed < 0:
        raise Finger3dError(f"--seed {problem.seed}: must be a whole number from 0 up")
    names = [g.name for g in parse(problem.given, problem.path).tables.gauge]
    if not names:
        raise Finger3dError("optimise: the objective reads a gauge, and the scene has no [[gauge]]; add one")
    if problem.gauge is not None and problem.gauge not in names:
        raise Finger3dError(f"--gauge {problem.gauge}: no such gauge; the scene has {', '.join(names)}")
    values = [free.start(problem.given) for free in problem.free]
    # a key that no scene has is refused now, a design that cannot be built is a line of the table
    try:
        problem.scene(values)
    except Finger3dError as error:
        if "no such key" in str(error) or "must be a " in str(error):
            raise
    return tuple(values)


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of one design.

    Attributes
    ----------
    values : values of the free keys
    value : objective, NaN where it is undefined
    outcome : "converged", or the reason why there is no objective
    """

    values: tuple[float, ...]
    value: float
    outcome: str


def evaluation_of(row: Row) -> Evaluation:
    """Return the evaluation of a line of evaluations.jsonl."""
    return Evaluation(tuple(row["values"]), number_in(row, "objective"), row["outcome"])


_GAUGE_BUDGET = 60  # evaluations of gauges on one body
_INFEASIBLE = 1e30  # cost of a design that cannot be built: finite, as annealing asks


GaugeReader = Callable[[Gauge], Float]
"""Returns the strain (m,) of any gauge of a body that was pressed with several values of mu (m,)."""


class _DesignBody(PressedBody):
    """Body of a design, built once and pressed with several values of mu."""

    def __init__(self, model: Model, report: Progress) -> None:
        self._own_press = model.inclusions is not None  # a gauge that stiffens the body
        super().__init__(model if self._own_press else replace(model, gauges=()), report)

    def reader(self, ends: Sequence[StepResult]) -> GaugeReader:
        """Return what reads gauges in increments (m,)."""
        if self._own_press:
            return lambda g: np.array([end.readings[strain_columns(g.name)[0]] for end in ends])
        mesh, axes = self.problem.mesh, self.problem.axes  # all that is kept of the body
        fields = formulation_of(self.problem.model).unknowns(self.problem, [end.meshed_state for end in ends])
        u = np.array([x[: mesh.points.size] for x in fields])
        if self.problem.model.finite_strain:
            body, none = self.problem.meshed_body, np.zeros((0, mesh.dim))
            return lambda g: np.array([float(g.at_finite_strain(body, x.reshape(-1, mesh.dim), none)[0]) for x in u])
        return lambda g: np.asarray(g.row(mesh, axes)[:, : mesh.points.size] @ u.T).ravel()

    def strain(self, gauge: Gauge, mus: Sequence[float], legs: tuple[Leg, ...]) -> Float:
        """Return the strain (m,) of a gauge for values of mu (m,), NaN where a press failed."""
        ends = self.ends(mus, legs)
        return np.where([end.outcome.ok for end in ends], self.reader(ends)(gauge), math.nan)


class _BudgetExhausted(Exception):
    """The budget of evaluations is used up."""


@dataclass
class Search:
    """Search whose evaluations are kept in a journal."""

    problem: OptimisationProblem
    report: Progress
    journal: Journal
    known: dict[tuple[float, ...], Evaluation] = field(init=False)
    done: list[Evaluation] = field(default_factory=list)
    bodies: int = 0
    chosen: tuple[int | Literal["auto"], ...] | None = field(init=False)
    _stored: dict[str, GaugeReader | str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Take over the evaluations of an earlier run, and its increments."""
        self.known = {found.values: found for found in map(evaluation_of, self.journal.rows)}
        chosen = (row.get("steps") for row in self.journal.rows)
        self.chosen = next((tuple(steps) for steps in chosen if isinstance(steps, list) and steps), None)

    def evaluate(self, values: Sequence[float] | Float) -> Evaluation:
        """Evaluate a design unless it is known; a new evaluation is appended to the journal at once."""
        point = tuple(float(v) for v in values)
        if point not in self.known:
            new = self._evaluate_new(point)
            self.known[point] = new
            row = {"values": list(point), "objective": new.value, "outcome": new.outcome}
            self.journal.append(row | {"steps": list(self.chosen or ())})
        found = self.known[point]
        self.done.append(found)
        return found

    def _evaluate_new(self, point: tuple[float, ...]) -> Evaluation:
        try:
            scene = self.problem.scene(point)
        except Finger3dError as error:
            return Evaluation(point, math.nan, " ".join(str(error).split()))
        read = self._press(scene)
        if isinstance(read, str):
            return Evaluation(point, math.nan, read)
        value = sensitivity(np.array(self.problem.mus), read(self._gauge(scene.model())), self.problem.noise)
        return Evaluation(point, value, "converged" if math.isfinite(value) else "the objective is no finite number")

    def _press(self, scene: Scene) -> GaugeReader | str:
        """Return what reads the gauges of a body, pressed anew unless it is one of the last, or why nothing does."""
        model, tables = scene.model(), scene.as_dict()
        key = json.dumps([body_key(scene), tables["press"], tables["contact"]])
        if model.inclusions is not None:
            key += repr(model.gauges)
        return kept(self._stored, key, lambda: self._press_body(model))

    def _press_body(self, model: Model) -> GaugeReader | str:
        mus = self.problem.mus
        self.bodies += 1
        try:
            body = _DesignBody(model, self.report)
            legs = self._legs(body, model)
            ends = body.ends(mus, legs)
        except Finger3dError as error:
            return " ".join(str(error).split())
        for mu, frame in zip(mus, ends, strict=True):
            if not frame.outcome.ok:
                return f"mu = {mu:g}: {frame.failure}"
        return body.reader(ends)

    def _gauge(self, model: Model) -> Gauge:
        """Return the gauge that is optimised."""
        return next(g for g in model.gauges if self.problem.gauge in (None, g.name))

    def _legs(self, body: _DesignBody, model: Model) -> tuple[Leg, ...]:
        """Return the path with the increments chosen for the first design, so that errors are comparable."""
        if not automatic(model):
            return model.legs
        if self.chosen is None:
            gauge, mus, noise = self._gauge(model), _first_middle_last(self.problem.mus), self.problem.noise
            found = choose_increments(body.problem, lambda p: body.strain(gauge, mus, p.model.legs) / noise)
            self.report.say(str(found))
            self.chosen = tuple(leg.steps for leg in found.legs)
        return tuple(replace(leg, steps=n) for leg, n in zip(model.legs, self.chosen, strict=True))

    def increments(self, values: Sequence[float]) -> Tree:
        """Return the increments of a design and the resulting error of its strain."""
        model = self.problem.scene(values).model()
        gauge, mus = self._gauge(model), _first_middle_last(self.problem.mus)
        body = _DesignBody(model, self.report)
        problem = with_steps(under(body.problem, legs=self._legs(body, model)), AUTO_START)

        def strain(other: Problem) -> Float:
            return body.strain(gauge, mus, other.model.legs)

        chosen = automatic(model)
        left = error_of_increments(problem, strain(problem), chosen, strain)
        steps = [leg.steps for leg in problem.model.legs]
        return {"steps": steps, "chosen": chosen, "strain_error": float(left.max())}

    def write_table(self, path: Path) -> None:
        """Write every evaluated design as a line of a CSV file."""
        known = list(self.known.values())
        columns: dict[str, list[float] | list[str]] = {
            key.key: [e.values[i] for e in known] for i, key in enumerate(self.problem.free)
        }
        write_csv(path, {**columns, "objective": [e.value for e in known], "outcome": [e.outcome for e in known]})

    def best(self) -> Evaluation | None:
        """Return the evaluation with the largest objective so far."""
        return max((e for e in self.done if math.isfinite(e.value)), key=lambda e: e.value, default=None)

    def run(self, start: Sequence[float]) -> None:
        """Search until the optimiser converges or the budget is used up."""
        p, count = self.problem, 0
        gauges = [i for i, key in enumerate(p.keys()) if key.startswith("gauge.")]
        body = [i for i in range(len(p.free)) if i not in gauges]
        outer, inner = (body, gauges) if body and gauges else ([*body, *gauges], [])

        def of_gauges(trial: Float) -> float:
            return self.evaluate(trial).value

        def of_body(trial: Float) -> float:
            nonlocal count
            count += 1
            value = self._largest(of_gauges, trial, inner, _GAUGE_BUDGET) if inner else of_gauges(trial)
            best = self.best()
            self.report.step(count, p.budget, f"best {best.value:.4g}" if best else "none can be built yet")
            return value

        self._largest(of_body, np.array(start), outer, p.budget)

    def _largest(self, value: Callable[[Float], float], start: Float, which: list[int], budget: int) -> float:
        """Return the largest value over some of the free keys, the others as at the start; NaN if none is a number.

        The search, by differential evolution, ends after `budget` trials at the latest.
        """
        from scipy import optimize

        found = [math.nan]

        def cost(chosen: Float) -> float:
            if len(found) > budget:
                raise _BudgetExhausted
            trial = start.copy()
            trial[which] = chosen
            found.append(value(trial))
            return -found[-1] if math.isfinite(found[-1]) else _INFEASIBLE

        bounds = [(self.problem.free[i].low, self.problem.free[i].high) for i in which]
        size = max(5, 12 // len(which))
        with suppress(_BudgetExhausted):
            optimize.differential_evolution(
                cost, bounds, x0=start[which], rng=self.problem.seed, popsize=size, polish=False
            )
        return max(filter(math.isfinite, found), default=math.nan)


def _first_middle_last(mus: Sequence[float]) -> tuple[float, ...]:
    """Return the first, the middle and the last value."""
    return tuple(dict.fromkeys((mus[0], mus[len(mus) // 2], mus[-1])))


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
    chosen = MUS if mus is None else tuple(mus)
    problem = OptimisationProblem(given, free_keys(free), path, gauge, chosen, noise, budget, seed)
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
    known, keys = tuple(search.known.values()), tuple(f.key for f in problem.free)
    places, values = [e.values for e in known], [e.value for e in known]
    draw_optimisation(folder / "design.png", keys, places, values, first.values)
    optimise_page(folder).write(folder)
    return OptimisationResult(
        keys=keys,
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
