"""The press: contact solved increment by increment along the path of the object."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from threading import Event

import numpy as np

from finger3d._types import Float
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.mechanics.energy import external_work, frictional_dissipation
from finger3d.mechanics.finite_state import expecting
from finger3d.mechanics.force_control import DepthSearch, Trial, deepest
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.path import prescribed_forces, stride_ratio, targets
from finger3d.mechanics.problem import Problem
from finger3d.objects import ObjectPose, between

_CUTS = 6
"""Times that an increment which does not converge is halved, at most."""

_LEAST_POWER = 2.0 / 3.0
"""Power of the force with which the depth grows under a ball (Hertz 1881); a longer first trial is not taken."""


@dataclass(frozen=True)
class _Substep:
    """A converged part of an increment: states before and after, and the poses they belong to."""

    before: ContactState
    after: ContactState
    a: ObjectPose
    b: ObjectPose


def march(
    problem: Problem,
    near: Sequence[Float] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
    trial: Callable[[str], None] = lambda text: None,
) -> Iterator[StepResult]:
    """Yield the result of every increment of all legs; ends after the first that does not converge.

    Under a stick rule that depends on the increments, an increment that cycles is yielded as it is and never halved.

    Parameters
    ----------
    problem : Problem
    near : sequence of (c, d) arrays, N
        Contact forces at the ends of the increments of a similar press, as initial guesses.
    workspace : Workspace, optional
        What an earlier press of the same body left; empty unless given.
    cancel : Event, optional
        Once it is set, the press ends before its next increment.
    trial : function of a text, optional
        Called with the depth and the force of every trial while a prescribed force is searched for.

    Raises
    ------
    CancelledError
        If `cancel` is set.
    """
    model = problem.model
    workspace = workspace or model.formulation.workspace()
    press = _Press(problem, workspace, 0 if model.rule in STEP_DEPENDENT_RULES else _CUTS, cancel, trial)
    without_inclusions = _march_without_inclusions(problem, workspace)
    state, at = model.formulation.start(problem), problem.origin
    previous: tuple[ObjectPose, Float] | None = None
    work = dissipation = 0.0
    start_force = 0.0
    for number, (target, load) in enumerate(zip(targets(model.legs), prescribed_forces(model.legs), strict=True)):
        if cancel is not None and cancel.is_set():
            raise CancelledError
        guess = near[number] if number < len(near) else extrapolated_force(state, at, target, previous)
        if load is None:
            found, substeps = press.advanced(state, at, target, guess)
        else:
            if load[0] == 1:
                start_force = _normal_force(problem, state)
            wanted = start_force + load[0] / load[1] * (load[2] - start_force)
            found, substeps, target = press.advanced_to_force(state, at, target, wanted, previous)
        for part in substeps:
            work += external_work(problem, part.before, part.after, part.a, part.b)
            dissipation += frictional_dissipation(problem, part.before, part.after)
        previous = at, state.force
        state, at = found.state, target
        read = model.formulation.readings(problem, state)
        yield StepResult(
            target=target,
            state=problem.symmetry.unfold(state),
            meshed_state=state,
            lowest=problem.placed(target).lowest,
            moment=problem.symmetry.total_moment(model.formulation.moment(problem, state, target)),
            gauges={g.name: read[g.name] for g in model.gauges} | _free_strain(problem, without_inclusions),
            markers={m.name: tuple(read[name] for name in m.columns(problem.dim)) for m in model.markers},
            taxels={t.name: read[t.name] for t in model.taxels},
            other_readings={name: read[name] for r in model.other_readings for name in r.columns(problem.dim)},
            external_work_mJ=work,
            dissipation_mJ=dissipation,
            outcome=found.outcome,
            residual=found.residual,
            iterations=found.iterations,
            method=found.method,
            penetration_mm=max(-float(state.gap.min(initial=0.0)), 0.0),
            detail=found.detail,
        )
        if not (found.outcome.ok or found.outcome.is_cycle):
            return


def _march_without_inclusions(problem: Problem, workspace: Workspace) -> Iterator[StepResult] | None:
    """The same press of the body without inclusions, for the free strain of the gauges."""
    body = problem.without_inclusions
    return march(replace(body, model=problem.model), workspace=workspace) if body else None


def _free_strain(problem: Problem, without_inclusions: Iterator[StepResult] | None) -> dict[str, float]:
    """Strain of every gauge by name, ``_free`` added, in the body without inclusions; NaN once its press has failed."""
    if without_inclusions is None:
        return {}
    step = next(without_inclusions, None)
    known = step is not None and (step.outcome.ok or step.outcome.is_cycle)
    return {f"{g.name}_free": step.gauges[g.name] if step and known else np.nan for g in problem.model.gauges}


def _normal_force(problem: Problem, state: ContactState) -> float:
    return -float(problem.world_force(state)[:, 1].sum())


@dataclass(frozen=True)
class _Press:
    """A press that advances from one pose of the object to another.

    Attributes
    ----------
    cuts : times that an increment which does not converge is halved, at most
    cancel : ends the search for a force once it is set
    say : called with the depth and the force of every trial
    """

    problem: Problem
    workspace: Workspace
    cuts: int
    cancel: Event | None
    say: Callable[[str], None]

    def advanced(
        self, state: ContactState, a: ObjectPose, b: ObjectPose, guess: Float | None = None
    ) -> tuple[ContactSolution, list[_Substep]]:
        """Advance from a to b; an increment that does not converge is halved and repeated from the same state."""
        found = self.problem.model.formulation.increment(self.problem, state, a, b, guess, self.workspace)
        if found.outcome.ok or self.cuts == 0:
            return found, [_Substep(state, found.state, a, b)]
        halves, middle = replace(self, cuts=self.cuts - 1), between(a, b, 0.5)
        first, done = halves.advanced(state, a, middle)
        if not first.outcome.ok:
            return replace(first, state=state, iterations=first.iterations + found.iterations), done
        second, more = halves.advanced(first.state, middle, b)
        return replace(
            second,
            residual=max(first.residual, second.residual),
            iterations=found.iterations + first.iterations + second.iterations,
            method="cut back",
        ), done + more

    def advanced_to_force(
        self,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        wanted: float,
        previous: tuple[ObjectPose, Float] | None,
    ) -> tuple[ContactSolution, list[_Substep], ObjectPose]:
        """Advance from a to the pose b, at the depth where the normal force is `wanted`, N.

        Every trial begins at the end expected from those before it.  If the force is not reached, the solution says
        why, and state and pose are those at the beginning.
        """
        problem, parts = self.problem, dict[float, list[_Substep]]()
        rest = ContactSolution(state, Outcome.CONVERGED, 0.0, 0, "none")
        only_deeper = replace(b, depth_mm=a.depth_mm, time_s=a.time_s) == a
        begin = Trial(a.depth_mm, rest, _normal_force(problem, state)) if only_deeper else None

        def trial_at(depth: float, good: Sequence[Trial]) -> Trial:
            if self.cancel is not None and self.cancel.is_set():
                raise CancelledError
            end = replace(b, depth_mm=depth)
            start, force = state, extrapolated_force(state, a, end, previous)
            if good:
                one, other = good[-1], good[-2] if len(good) > 1 else begin
                share = (depth - one.depth) / (one.depth - other.depth) if other and one.depth != other.depth else 0.0
                share = share if abs(share) < 1.0 else 0.0
                ends = one.solution.state, other.solution.state if other else one.solution.state
                force = ends[0].force + share * (ends[0].force - ends[1].force)
                start = expecting(state, a, end, ends, share)
            found, parts[depth] = self.advanced(start, a, end, force)
            reached = _normal_force(problem, found.state) if found.outcome.ok else np.nan
            text = f"{reached:.5g} N" if found.outcome.ok else "no solution"
            self.say(f"{wanted:.5g} N wanted, {text} at a depth of {depth:.4g} mm")
            return Trial(depth, found, reached)

        most = deepest(problem.model.object, problem.system.first_contact_mm, problem.model.design.height_mm)
        search = DepthSearch(trial_at, wanted, a.depth_mm, most, begin)
        guess = a.depth_mm + (a.depth_mm - previous[0].depth_mm if previous else b.depth_mm)
        if begin and wanted > begin.force > 0.0 and a.depth_mm > 0.0:
            guess = min(guess, a.depth_mm * (wanted / begin.force) ** _LEAST_POWER)
        last = search.run(guess)
        spent = sum(tried.solution.iterations for tried in (*search.good, *search.failed))
        if not last.ok:
            return replace(last.solution, state=state, iterations=spent), [], a
        return replace(last.solution, iterations=spent), parts[last.depth], replace(b, depth_mm=last.depth)


def extrapolated_force(
    state: ContactState, a: ObjectPose, b: ObjectPose, previous: tuple[ObjectPose, Float] | None
) -> Float | None:
    """Return the forces extrapolated linearly, if the path continues in the direction of the previous increment."""
    if previous is None:
        return None
    pose, force = previous
    ratio = stride_ratio(pose, a, b)
    return None if ratio is None else state.force + ratio * (state.force - force)
