"""Bodies that are condensed once, and pressed with several coefficients of friction, paths and contact rules.

A body is condensed to the points that may come into contact.  Whether contact stayed within them is checked after the
solution; if not, the body is condensed again to all points of its free faces, and pressed again.

Presses with several coefficients of friction start from those before: where mu changes by at most 0.1, the forces at
the previous mu save 15 to 25 % of the time of a press under a plane.  They are an initial guess only: the solution
satisfies the contact conditions in any case.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from threading import Event
from typing import TypeVar

from finger3d._types import Float
from finger3d.contact.friction import FrictionLaw
from finger3d.contact.rules import RuleName
from finger3d.mechanics.discretise.build import build, changed
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.resolution import check
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.equilibrium import at_depth_reached
from finger3d.mechanics.march.grip import Grip
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import automatic, march_automatic
from finger3d.mechanics.march.variants import map_parallel
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.postprocess.penetration import SurfaceCheck, check_surface
from finger3d.objects.rigid import RigidObject
from finger3d.progress import QUIET, Progress

Result = TypeVar("Result")
Key = TypeVar("Key")
Value = TypeVar("Value")

_MOST_KEPT = 4
"""Bodies, and presses, that a search or a fit keeps."""

_FARTHEST = 2.0
"""Largest extrapolation of forces in mu, over the difference of the last two values."""

_NEAR = 0.1
"""Largest difference in mu from which a press is started; from farther off its own path is the better start."""


@dataclass(frozen=True)
class PressAtMu:
    """A press with one mu.

    Attributes
    ----------
    mu : coefficient of friction
    frame : the last increment
    forces : contact forces (c, d), N, on the meshed part at the end of every increment
    factorizations : factorisations of the body in the increments
    """

    mu: float
    frame: StepResult
    forces: tuple[Float, ...]
    factorizations: int = 0

    @classmethod
    def of(cls, mu: float, steps: Sequence[StepResult], factorizations: int) -> PressAtMu:
        """Return the press with these increments."""
        return cls(mu, steps[-1], tuple(step.meshed_state.contact.force for step in steps), factorizations)


def under(
    problem: Problem,
    friction: FrictionLaw | None = None,
    legs: tuple[Leg, ...] | None = None,
    rule: RuleName | None = None,
    obj: RigidObject | None = None,
) -> Problem:
    """Return a condensed body under another friction law, path, rule or rigid object; None leaves each as it is.

    Raises
    ------
    UnresolvedError
        If the object passes between the contact points on another path.
    """
    own = problem.model
    model = replace(own, friction=friction or own.friction, legs=legs or own.legs, rule=rule or own.rule)
    model = replace(model, object=obj or own.object)
    other = model.object != own.object
    found = changed(problem, model) if other else replace(problem, model=model)
    if other or _poses(model.legs) != _poses(own.legs):
        system = found.system
        check(found.model, system.surface, system.first_contact_mm, system.place_mm, problem.axes)
    return found


def _poses(legs: tuple[Leg, ...]) -> list[Leg]:
    """Return the legs without their increments and durations."""
    return [replace(leg, steps=1, duration_s=None) for leg in legs]


def press(
    problem: Problem,
    mu: float,
    near: Sequence[PressAtMu] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
) -> PressAtMu:
    """Press the condensed body with this mu; the last two presses of `near` give the initial guess."""
    problem = under(problem, problem.model.friction.with_mu(mu))
    workspace = workspace or formulation_of(problem.model).workspace()
    before = workspace.factorizations
    if automatic(problem.model):
        steps, _ = march_automatic(problem, workspace, cancel)
    else:
        steps = tuple(march(problem, _start(problem, mu, near), workspace, cancel))
    return PressAtMu.of(mu, steps, workspace.factorizations - before)


def presses(problem: Problem, mus: Sequence[float]) -> Iterator[PressAtMu]:
    """Yield a press for each of ascending values of mu.

    At finite strain they come in another order than that of mu; see `march_in_groups`.
    """
    if problem.model.finite_strain and not automatic(problem.model):
        yield from _together(problem, mus)
        return

    def pressed(mu: float, before: Sequence[PressAtMu], workspace: Workspace, cancel: Event) -> PressAtMu:
        return press(problem, mu, before, workspace, cancel)

    yield from map_parallel(problem, pressed, mus)


def _together(problem: Problem, mus: Sequence[float]) -> Iterator[PressAtMu]:
    """Yield the presses with all values of mu, which share factors."""
    from finger3d.mechanics.march.groups import march_in_groups  # a press in small strain needs none of it

    workspace, counted = formulation_of(problem.model).workspace(), 0
    problems = [under(problem, problem.model.friction.with_mu(mu)) for mu in mus]
    for number, steps in march_in_groups(problems, workspace, Event()):
        new, counted = workspace.factorizations - counted, workspace.factorizations
        yield PressAtMu.of(mus[number], steps, new)


def _start(problem: Problem, mu: float, near: Sequence[PressAtMu]) -> list[Float]:
    """Return the forces extrapolated in mu from the last two presses; none if these have other contact points."""
    shape = problem.delassus.shape[:2]
    good = [p for p in near if p.forces[0].shape == shape]
    if not good or abs(good[-1].mu - mu) > _NEAR:
        return []
    first, last = good[0], good[-1]
    if first.mu == last.mu:
        return list(last.forces)
    share = min((mu - last.mu) / (last.mu - first.mu), _FARTHEST)
    return [b + share * (b - a) for a, b in zip(first.forces, last.forces, strict=False)]


class PressedBody:
    """A body that is condensed again where a press shows that it was condensed too narrowly.

    It is meshed again if a force is reached far deeper than was forecast, and condensed to all points of its free
    faces once contact leaves the candidate points.

    Parameters
    ----------
    model : what is meshed and condensed
    report : receives the messages about meshing and condensation
    problem : the condensed body of the model, if there is one already
    anywhere : whether objects may touch anywhere on the contact face, see `build`

    Attributes
    ----------
    problem : the condensed body
    seconds : time of meshing and condensation
    """

    def __init__(
        self, model: Model, report: Progress = QUIET, problem: Problem | None = None, anywhere: bool = False
    ) -> None:
        self._report, self.seconds, self._anywhere = report, 0.0, anywhere
        self.problem = problem or self._built(model)

    @classmethod
    def with_refined_borders(cls, model: Model, report: Progress = QUIET) -> PressedBody:
        """Return a body with shorter edges at the border of stick, which is found on coarser meshes, if asked."""
        if model.mesh.stick_refinement <= 1.0:
            return cls(model, report)
        from finger3d.accuracy.borders import with_refined_borders  # most bodies need none of it

        start = time.perf_counter()
        body = cls(model, report, with_refined_borders(model, report))
        body.seconds = time.perf_counter() - start
        return body

    def pressed(
        self, press: Callable[[Problem, Result | None], tuple[Result, Sequence[StepResult]]]
    ) -> tuple[Result, list[SurfaceCheck]]:
        """Press the body, and press it again as often as it has to be condensed again.

        Parameters
        ----------
        press : function of the condensed body, and of the result on a narrower one, if there was any
            Returns its result, and converged increments whose contact must be within the candidate points.

        Returns
        -------
        result : the last one
        checks : of the free surface after each of these increments
        """
        result, steps = press(self.problem, None)
        reached = max((step.target.depth_mm for step in steps), default=0.0)
        if legs := at_depth_reached(self.problem.model.legs, reached):
            self._report.say(f"the force is reached at {reached:.3g} mm, deeper than was forecast; meshing again")
            self.problem = self._built(replace(self.problem.model, legs=legs))
            result, steps = press(self.problem, result)
        checks = check_surface(self.problem, steps)
        if not all(check.within_candidates for check in (*checks, *self._checks_of_other(steps))):
            self.widen()
            result, steps = press(self.problem, result)
            checks = check_surface(self.problem, steps)
        return result, checks

    def _checks_of_other(self, steps: Sequence[StepResult]) -> list[SurfaceCheck]:
        """Return the checks of the second finger's free surface, if there is one."""
        others = [step.other for step in steps if step.other]
        return check_surface(Grip.of(self.problem).fingers[1], others) if others else []

    def steps(self, friction: FrictionLaw | None = None, rule: RuleName | None = None) -> list[StepResult]:
        """Return the increments of the model's path, under another friction law or contact rule if one is given.

        The last one has the penetration of the finger's surface.
        """

        def press(problem: Problem, _: object) -> tuple[list[StepResult], list[StepResult]]:
            steps = list(march_automatic(under(problem, friction, rule=rule))[0])
            return steps, [step for step in steps[-1:] if step.outcome.ok]

        steps, checks = self.pressed(press)
        return [*steps[:-1], *with_penetration(steps[-1:], checks)]

    def ends(self, mus: Sequence[float], legs: tuple[Leg, ...] | None = None) -> list[StepResult]:
        """Return the last increment with every mu, on a path other than the model's own if it is given.

        Those that converged have the penetration of the finger's surface.
        """

        def press(problem: Problem, _: object) -> tuple[list[StepResult], list[StepResult]]:
            by_mu = {one.mu: one.frame for one in presses(under(problem, legs=legs), mus)}
            found = [by_mu[mu] for mu in mus]
            return found, [end for end in found if end.outcome.ok]

        ends, checks = self.pressed(press)
        return with_penetration(ends, checks)

    def widen(self) -> None:
        """Condense the body to all points of its free faces."""
        self._report.say("contact reached beyond the candidate points; once more with all points of the free faces")
        self.problem = self._built(self.problem.model, math.inf)

    def _built(self, model: Model, margin: float = MARGIN) -> Problem:
        start = time.perf_counter()
        problem = build(model, self._report, margin, self._anywhere)
        self.seconds += time.perf_counter() - start
        return problem


def with_penetration(steps: Sequence[StepResult], checks: Sequence[SurfaceCheck]) -> list[StepResult]:
    """Return increments with the penetration of the surface, which was checked after those that converged."""
    left = iter(checks)
    return [replace(one, penetration_mm=next(left).penetration_mm) if one.outcome.ok else one for one in steps]


def kept(store: dict[Key, Value], key: Key, made: Callable[[], Value]) -> Value:
    """Return what is stored under a key; if nothing is, make and store it in place of the oldest of `_MOST_KEPT`."""
    if key not in store:
        found = made()
        while len(store) >= _MOST_KEPT:
            store.pop(next(iter(store)))
        store[key] = found
    return store[key]
