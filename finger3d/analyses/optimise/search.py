"""Search for the best design: designs are evaluated one by one, and each evaluation is stored at once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from finger3d._types import Float, Tree
from finger3d.analyses.calibrate.increments import choose_increments, error_of_increments
from finger3d.analyses.optimise.task import Evaluation, OptimisationProblem, evaluation_of, sensitivity
from finger3d.analyses.pressed_body import PressedBody, kept, under
from finger3d.analyses.shared_body import body_key
from finger3d.errors import Finger3dError
from finger3d.io import write_csv
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import automatic, with_steps
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.readings import Gauge, strain_columns
from finger3d.progress import Progress
from finger3d.results.journal import Journal
from finger3d.scene import Scene

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
