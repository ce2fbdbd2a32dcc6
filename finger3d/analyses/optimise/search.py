"""Search for the best design: designs are evaluated one by one, and each evaluation is stored at once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from finger3d._types import Float, Tree
from finger3d.analyses.calibrate.increments import choose_increments, error_of_increments
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise.task import Evaluation, Objective, ObjectiveTable, OptimisationProblem
from finger3d.analyses.pressed_body import PressedBody, under
from finger3d.analyses.shared_body import body_key
from finger3d.errors import Finger3dError
from finger3d.io import write_csv
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.step_halving import automatic, with_steps
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.readings.columns import strain_columns
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.progress import Progress
from finger3d.results.journal import Journal
from finger3d.scene import Scene

_GAUGE_BUDGET = 60  # evaluations of gauges on one body
_INFEASIBLE = 1e30  # cost of a design that cannot be built: finite, as annealing asks
_MAX_STORED = 4  # bodies with their increments


@dataclass(frozen=True)
class _PressedDesign:
    """Increments of a body for every mu, which gauges are read from, or the reason why there are none."""

    steps: tuple[dict[str, float], ...] = ()
    read: Callable[[Gauge], Float] | None = None
    outcome: str = "converged"


class _DesignBody(PressedBody):
    """Body of a design, built once and pressed with several values of mu."""

    def __init__(self, model: Model, report: Progress) -> None:
        self._own_press = model.inclusions is not None  # a gauge that stiffens the body
        super().__init__(model if self._own_press else replace(model, gauges=()), report)

    def reader(self, ends: Sequence[StepResult]) -> Callable[[Gauge], Float]:
        """Return a function that gives the strain (m,) of any gauge in increments (m,)."""
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
    objective: Objective
    journal: Journal
    known: dict[tuple[float, ...], Evaluation] = field(default_factory=dict)
    done: list[Evaluation] = field(default_factory=list)
    bodies: int = 0
    evaluated: int = 0
    chosen: tuple[int | Literal["auto"], ...] | None = None
    _stored: dict[str, _PressedDesign] = field(default_factory=dict)

    def evaluate(self, values: Sequence[float] | Float) -> Evaluation:
        """Evaluate a design unless it is known; a new evaluation is appended to the journal at once."""
        point = tuple(float(v) for v in values)
        if point not in self.known:
            self._record(self._evaluate_new(point))
        found = self.known[point]
        self.done.append(found)
        return found

    def _evaluate_new(self, point: tuple[float, ...]) -> Evaluation:
        try:
            scene = self.problem.scene(point)
        except Finger3dError as error:
            return Evaluation(point, math.nan, " ".join(str(error).split()))
        pressed = self._press(scene)
        table = self._table(scene, pressed)
        if table is None:
            return Evaluation(point, math.nan, pressed.outcome)
        value = self.objective(table)
        return Evaluation(point, value, "converged" if math.isfinite(value) else "the objective is no finite number")

    def _table(self, scene: Scene, pressed: _PressedDesign) -> ObjectiveTable | None:
        """Return what the objective reads; None if a press fails."""
        if pressed.read is None:
            return None
        strain = {g.name: pressed.read(g) for g in scene.model().gauges}
        gauge = self.problem.gauge or next(iter(strain))
        return ObjectiveTable(np.array(self.problem.mus), strain, pressed.steps, self.problem.noise, gauge, scene)

    def _press(self, scene: Scene) -> _PressedDesign:
        key = json.dumps([body_key(scene), scene.as_dict()["press"], scene.as_dict()["contact"]])
        model = scene.model()
        if model.inclusions is not None:
            key += repr(model.gauges)
        if key not in self._stored:
            while len(self._stored) >= _MAX_STORED:
                self._stored.pop(next(iter(self._stored)))
            self._stored[key] = self._press_body(model)
            self.bodies += 1
        return self._stored[key]

    def _press_body(self, model: Model) -> _PressedDesign:
        mus = self.problem.mus
        try:
            body = _DesignBody(model, self.report)
            legs = self._legs(body, model)
            ends = body.ends(mus, legs)
        except Finger3dError as error:
            return _PressedDesign(outcome=" ".join(str(error).split()))
        for mu, frame in zip(mus, ends, strict=True):
            if not frame.outcome.ok:
                return _PressedDesign(outcome=f"mu = {mu:g}: {frame.failure}")
        steps = tuple(measure(body.problem.points, frame) for frame in ends)
        return _PressedDesign(steps, body.reader(ends))

    def _gauge(self, model: Model) -> Gauge | None:
        """Return the gauge that is optimised, if the scene has one."""
        return next((g for g in model.gauges if self.problem.gauge in (None, g.name)), None)

    def _legs(self, body: _DesignBody, model: Model) -> tuple[Leg, ...]:
        """Return the path with the increments chosen for the first design, so that errors are comparable."""
        gauge = self._gauge(model)
        if gauge is None or not automatic(model):
            return model.legs
        if self.chosen is None:
            mus, noise = _first_middle_last(self.problem.mus), self.problem.noise
            found = choose_increments(body.problem, lambda p: body.strain(gauge, mus, p.model.legs) / noise)
            self.report.say(str(found))
            self.chosen = tuple(leg.steps for leg in found.legs)
        return tuple(replace(leg, steps=n) for leg, n in zip(model.legs, self.chosen, strict=True))

    def restore_increments(self, start: Sequence[float]) -> None:
        """Choose the increments at the start design, whose evaluation in the journal does not store them."""
        try:
            model = self.problem.scene(start).model()
            if automatic(model):
                self._legs(_DesignBody(model, self.report), model)
        except Finger3dError:
            pass  # as in a new search, the increments are chosen at the first design that can be built

    def increments(self, values: Sequence[float]) -> Tree:
        """Return the increments of a design and the resulting error of its strain; none where no gauge is read."""
        model = self.problem.scene(values).model()
        gauge, mus = self._gauge(model), _first_middle_last(self.problem.mus)
        if gauge is None:
            return {}
        body = _DesignBody(model, self.report)
        problem = with_steps(under(body.problem, legs=self._legs(body, model)), AUTO_START)

        def strain(other: Any) -> Float:
            return body.strain(gauge, mus, other.model.legs)

        chosen = automatic(model)
        left = error_of_increments(problem, strain(problem), chosen, strain)
        steps = [leg.steps for leg in problem.model.legs]
        return {"steps": steps, "chosen": chosen, "strain_error": float(left.max())}

    def _record(self, found: Evaluation) -> None:
        self.known[found.values] = found
        self.journal.append({"values": list(found.values), "objective": found.value, "outcome": found.outcome})

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
        p = self.problem
        gauges = [i for i, key in enumerate(p.keys()) if key.startswith("gauge.")]
        body = [i for i in range(len(p.free)) if i not in gauges]
        outer, inner = (body, gauges) if body and gauges else (list(range(len(p.free))), [])
        x = np.array(start)

        def cost(values: Float) -> float:
            if self.evaluated >= p.budget:
                raise _BudgetExhausted
            self.evaluated += 1
            trial = x.copy()
            trial[outer] = values
            value = self._search_gauges(trial, inner) if inner else self.evaluate(trial).value
            best = self.best()
            text = f"best {best.value:.4g}" if best else "none can be built yet"
            self.report.step(self.evaluated, p.budget, text)
            return -value if math.isfinite(value) else _INFEASIBLE

        try:
            _minimise(cost, [p.free[i] for i in outer], x[outer], p.seed)
        except _BudgetExhausted:
            pass

    def _search_gauges(self, here: Float, inner: list[int]) -> float:
        """Return the largest objective over the keys of gauges on one body."""
        count, values = 0, []

        def cost(chosen: Float) -> float:
            nonlocal count
            if count >= _GAUGE_BUDGET:
                raise _BudgetExhausted
            count += 1
            trial = here.copy()
            trial[inner] = chosen
            value = self.evaluate(trial).value
            values.append(value if math.isfinite(value) else -_INFEASIBLE)
            return -values[-1]

        try:
            free = [self.problem.free[i] for i in inner]
            _minimise(cost, free, here[inner], self.problem.seed)
        except _BudgetExhausted:
            pass
        best = max(values)
        return best if best > -_INFEASIBLE else math.nan


def _first_middle_last(mus: Sequence[float]) -> tuple[float, ...]:
    """Return the first, the middle and the last value."""
    return tuple(dict.fromkeys((mus[0], mus[len(mus) // 2], mus[-1])))


def _minimise(cost: Callable[[Float], float], free: Sequence[FreeKey], start: Float, seed: int) -> None:
    from scipy import optimize

    bounds = [(f.low, f.high) for f in free]
    optimize.differential_evolution(cost, bounds, x0=start, rng=seed, popsize=max(5, 12 // len(free)), polish=False)
