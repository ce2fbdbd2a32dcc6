"""The search itself: designs are judged one by one, and every one is kept at once."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.export import atomic, claimed, write_json
from finger3d.family import Body, Variant, body_key
from finger3d.history import measure
from finger3d.model import Gauge
from finger3d.page import design_page
from finger3d.reduced import friction_at
from finger3d.report import Report
from finger3d.scene import Scene
from finger3d.search.picture import draw
from finger3d.search.task import METHODS, Float, Free, Objective, Problem, Table, checked_start, objective_of
from finger3d.solve import gauge_row

_INNER = 60  # readings of gauges in one body
_WORST = 1e30  # stands for what cannot be built: finite, as annealing asks
_KEPT = 4


@dataclass(frozen=True)
class Evaluation:
    """One design: values of the free keys, the objective (NaN where it has none) and why."""

    values: tuple[float, ...]
    value: float
    outcome: str


@dataclass(frozen=True)
class Found:
    """What a search came to; `scene` is the best design, ready to be pressed.

    `evaluations` are in the order asked for, some more than once; `judged` designs are in evaluations.csv.
    """

    best: Evaluation
    start: Evaluation
    evaluations: tuple[Evaluation, ...]
    judged: int
    bodies: int
    scene: Scene


@dataclass(frozen=True)
class _Pressed:
    """A body at every mu: what gauges are read from, or why there is nothing to read."""

    steps: tuple[dict[str, float], ...] = ()
    read: Callable[[Gauge], Float] | None = None
    outcome: str = "converged"


class _Spent(Exception):
    """The budget is used up."""


@dataclass
class _Search:
    problem: Problem
    folder: Path
    report: Report
    judge: Objective
    known: dict[tuple[float, ...], Evaluation] = field(default_factory=dict)
    done: list[Evaluation] = field(default_factory=list)
    bodies: int = 0
    spent: int = 0
    _pressed: dict[str, _Pressed] = field(default_factory=dict)

    def evaluate(self, values: Sequence[float] | Float) -> Evaluation:
        """Judge a design, or remember it; every new one is a line of evaluations.csv at once."""
        place = tuple(float(v) for v in values)
        if place not in self.known:
            found = self._judged(place)
            self.known[place] = found
            self._write(found)
        found = self.known[place]
        self.done.append(found)
        return found

    def _judged(self, place: tuple[float, ...]) -> Evaluation:
        try:
            scene = self.problem.scene(place)
        except Finger3dError as error:
            return Evaluation(place, math.nan, " ".join(str(error).split()))
        pressed = self._press(scene)
        if pressed.read is None:
            return Evaluation(place, math.nan, pressed.outcome)
        strain = {g.name: pressed.read(g) for g in scene.model().gauges}
        gauge = self.problem.gauge or next(iter(strain))
        table = Table(np.array(self.problem.mus), strain, pressed.steps, self.problem.noise, gauge, scene)
        value = self.judge(table)
        return Evaluation(place, value, "converged" if math.isfinite(value) else "the objective is no finite number")

    def _press(self, scene: Scene) -> _Pressed:
        key = json.dumps([body_key(scene), scene.as_dict()["press"], scene.as_dict()["contact"]])
        model = scene.model()
        whole = model.inclusions is not None or not model.kinematics.small_strain
        if whole:
            # these read their gauges in their own way, so a gauge moved is a press of its own
            key += repr(model.gauges)
        if key not in self._pressed:
            while len(self._pressed) >= _KEPT:
                self._pressed.pop(next(iter(self._pressed)))
            self._pressed[key] = self._pressed_new(scene, whole)
            self.bodies += 1
        return self._pressed[key]

    def _pressed_new(self, scene: Scene, whole: bool) -> _Pressed:
        model = scene.model()
        variants = [Variant.of(replace(model, friction=friction_at(model.friction, mu))) for mu in self.problem.mus]
        try:
            body = Body(model, variants if whole else [replace(v, gauges=()) for v in variants], self.report.say)
            ends = [frames[-1] for frames in body.frames(variants)]
        except Finger3dError as error:
            return _Pressed(outcome=" ".join(str(error).split()))
        for mu, frame in zip(self.problem.mus, ends, strict=True):
            if not frame.outcome.ok:
                return _Pressed(outcome=f"mu = {mu:g}: {frame.outcome}")
        steps = tuple(measure(body.problem.points, frame) for frame in ends)
        if whole:
            strains = [body.strains(v, frame.gauges) for v, frame in zip(variants, ends, strict=True)]
            return _Pressed(steps, lambda g: np.array([strain[g.name] for strain in strains]))
        mesh, axes = body.problem.mesh, body.problem.axes
        fields = body.problem.model.kinematics.all_unknowns(body.problem, [f.part for f in ends])
        u = np.array([x[: mesh.points.size] for x in fields])
        return _Pressed(steps, lambda g: np.asarray(gauge_row(mesh, g, axes)[:, : mesh.points.size] @ u.T).ravel())

    def _write(self, found: Evaluation) -> None:
        path = self.folder / "evaluations.csv"
        try:
            with path.open("a", newline="", encoding="utf-8") as file:
                writer = csv.writer(file, lineterminator="\n")
                if file.tell() == 0:
                    writer.writerow([*(f.key for f in self.problem.free), "objective", "outcome"])
                writer.writerow([*found.values, found.value, found.outcome])
        except OSError as error:
            raise Finger3dError(f"cannot write {path}: {error.strerror}; choose another place with --out") from None

    def load(self) -> None:
        """Remember what an earlier run has judged; a line that was cut short is left out, and the file mended."""
        path, count = self.folder / "evaluations.csv", len(self.problem.free)
        if not path.exists():
            return
        with path.open(newline="", encoding="utf-8") as file:
            lines = list(csv.reader(file))
        kept = [line for line in lines[1:] if len(line) == count + 2 and line[-1]]
        for line in kept:
            numbers = tuple(float(v) for v in line[: count + 1])
            self.known[numbers[:-1]] = Evaluation(numbers[:-1], numbers[-1], line[-1])
        with atomic(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([*lines[:1], *kept])

    def best(self) -> Evaluation | None:
        """The largest objective so far."""
        return max((e for e in self.done if math.isfinite(e.value)), key=lambda e: e.value, default=None)

    def run(self, start: Sequence[float]) -> None:
        """Search until the optimiser settles or the budget is spent."""
        p = self.problem
        gauges = [i for i, key in enumerate(p.keys()) if key.startswith("gauge.")]
        body = [i for i in range(len(p.free)) if i not in gauges]
        outer = body if body and gauges else list(range(len(p.free)))
        inner = gauges if body and gauges else []
        x = np.array(start)

        def cost(values: Float) -> float:
            if self.spent >= p.budget:
                raise _Spent
            self.spent += 1
            here = x.copy()
            here[outer] = values
            value = self._inner(here, inner) if inner else self.evaluate(here).value
            best = self.best()
            said = f"best {best.value:.4g}" if best else "none can be built yet"
            self.report.step(self.spent, p.budget, said)
            return -value if math.isfinite(value) else _WORST

        try:
            _minimise(p.method, cost, [p.free[i] for i in outer], x[outer], p.seed)
        except _Spent:
            pass

    def _inner(self, here: Float, inner: list[int]) -> float:
        """The best objective over the gauges' keys in one body."""
        count, values = 0, []

        def cost(chosen: Float) -> float:
            nonlocal count
            if count >= _INNER:
                raise _Spent
            count += 1
            at = here.copy()
            at[inner] = chosen
            value = self.evaluate(at).value
            values.append(value if math.isfinite(value) else -_WORST)
            return -values[-1]

        try:
            free = [self.problem.free[i] for i in inner]
            _minimise(METHODS[0], cost, free, here[inner], self.problem.seed)
        except _Spent:
            pass
        best = max(values)
        return best if best > -_WORST else math.nan


def _minimise(method: str, cost: Callable[[Float], float], free: Sequence[Free], start: Float, seed: int) -> None:
    from scipy import optimize

    bounds = [(f.low, f.high) for f in free]
    if method == "nelder-mead":
        options = {"maxfev": 10**6, "xatol": 1e-3 * min(h - lo for lo, h in bounds), "fatol": 1e-6}
        optimize.minimize(cost, start, method="Nelder-Mead", bounds=bounds, options=options)
    elif method == "dual-annealing":
        optimize.dual_annealing(cost, bounds, x0=start, rng=seed, no_local_search=True, maxiter=10**4)
    else:
        optimize.differential_evolution(cost, bounds, x0=start, rng=seed, popsize=max(5, 12 // len(free)), polish=False)


def search(problem: Problem, out: str | Path, report: Report | None = None) -> Found:
    """Search within the bounds for the largest objective; every design judged is kept at once.

    Parameters
    ----------
    out : folder for evaluations.csv, best.toml, design.json, design.png and report.html; that of the same search is
        gone on with

    Raises
    ------
    Finger3dError
        For a mistake in the problem, or if no design within the bounds could be built.
    """
    report = report or Report()
    judge = objective_of(problem.objective)
    start = checked_start(problem)
    with claimed(out, "design") as folder:
        return _searched(problem, folder, report, judge, start)


def _searched(problem: Problem, folder: Path, report: Report, judge: Objective, start: tuple[float, ...]) -> Found:
    _same(problem, folder)
    for name in ("design.png", "report.html"):
        (folder / name).unlink(missing_ok=True)
    run = _Search(problem, folder, report, judge)
    run.load()
    if run.known:
        report.say(f"{len(run.known)} designs are kept from before")
    report.stage("searching")
    first = run.evaluate(start)
    try:
        run.run(start)
    finally:
        best = run.best()
        if best is not None:
            _write_best(problem, folder, best, first, run)
    if best is None:
        raise Finger3dError(f"design: no design within the bounds gives a number; the first: {first.outcome}")
    judged = tuple(run.known.values())
    draw(
        folder / "design.png", [f.key for f in problem.free], [e.values for e in judged], [e.value for e in judged],
        first.values, Path(problem.objective).stem,
    )  # fmt: skip
    design_page(folder)
    return Found(best, first, tuple(run.done), len(judged), run.bodies, problem.scene(best.values))


def _same(problem: Problem, folder: Path) -> None:
    wanted = json.loads(json.dumps(problem.identity()))
    path = folder / "search.json"
    if path.exists() and json.loads(path.read_text(encoding="utf-8")) != wanted:
        raise Finger3dError(f"--out {folder}: holds another search; name another folder")
    write_json(path, wanted)


def _write_best(problem: Problem, folder: Path, best: Evaluation, first: Evaluation, run: _Search) -> None:
    with atomic(folder / "best.toml") as path:
        path.write_text(problem.scene(best.values).to_toml(defaults=False), encoding="utf-8")
    names = [f.key for f in problem.free]
    write_json(
        folder / "design.json",
        {
            "objective": problem.objective, "best": best.value, "values": dict(zip(names, best.values, strict=True)),
            "start": first.value, "start_values": dict(zip(names, first.values, strict=True)),
            "designs": len(run.done), "bodies": run.bodies,
        },
    )  # fmt: skip
