"""The press of a section by a flat object in small strain, exact from event to event: what increments approach.

Let the free motion q be linear in the share s of a path.  As long as no point changes its status, the forces r and the
relative displacements ``w = W r + q`` are linear in s, too, and their rates r', w' solve one system of equations::

    open    r' = 0
    stick   w'_n = 0,  w'_t = 0
    slip    w'_n = 0,  r'_t = sigma mu r'_n      sigma = 1 or -1, the direction of friction

At an event a point touches, reaches its friction limit, or leaves.  There the rates solve a linear complementarity
problem, in which only points on the border of their set may change it (Klarbring 1999)::

    r_n = 0, w_n = 0        open with w'_n >= 0; or touching with r' in the friction cone, and friction opposes slip
    |r_t| = mu r_n > 0      stick with sigma r'_t <= mu r'_n; or slip with sigma w'_t <= 0

It is solved by changes of the active set.  Rates need not exist if friction is large: where no set is found, forces
jump, and a short increment of the path is solved as such.

Increments have a limit on such paths, since contact is piecewise linear in the motion; elsewhere there is no reference.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem, residual
from finger3d.contact.friction import OPEN, SLIP, STICK, Status
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState, next_state
from finger3d.errors import Outcome
from finger3d.fem.tensors import rotated_delassus
from finger3d.mechanics.discretise.contact_points import contact_geometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import length_scale
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import State, StepResult
from finger3d.mechanics.small_strain import LinearBody, transported
from finger3d.objects import Move, ObjectPose, vertical_frame

_ZERO = 1e-13
"""Gap over the length scale, and force over the largest, of points on the border of their set."""

_ROUND_OFF = 1e-11
"""Violation of the conditions on the rates that counts as none, over the largest rate of a force."""

_CONTINUOUS = 1e-8
"""Change of the forces at an event, over the largest, that is round-off."""

_CHANGES = 12
"""Changes of the active set at an event, of all points that violate a condition."""

_LEAST_EVENTS, _EVENTS_A_POINT = 400, 40
"""Largest number of events: a constant, and one for each contact point."""

_STRIDES = tuple(10.0**k for k in range(-9, 1))
"""Shares of the path that an increment over a jump is tried with, until there is a solution."""

_MANY_JUMPS = 20
"""Jumps on a path after which each increment over one begins ten times longer than the last: points that snap off one
after the other, by the hundred with mu = 1e6 and nu = 0, would cost as many searches for the state after a jump."""


class Event(NamedTuple):
    """Event on a path.

    Attributes
    ----------
    share : of the path
    state : at the event; the status of a point is the one on the way from the event before
    residual : largest violation of the contact conditions since the event before, dimensionless
    systems : number of systems of equations that were solved on the path so far
    """

    share: float
    state: ContactState
    residual: float
    systems: int


class _ActiveSet(NamedTuple):
    """Status (c,), and direction of friction (c,) where points slip."""

    status: Status
    sign: Float


class _Line(NamedTuple):
    """Forces (c, d), and the rates of forces and displacements, per share of the path."""

    force: Float
    force_rate: Float
    displacement_rate: Float


def follow(problem: ContactProblem, stops: Sequence[float] = ()) -> list[Event]:
    """Return the events on the path of an increment, during which the free motion changes in proportion.

    Parameters
    ----------
    problem : ContactProblem
        In two dimensions; its coefficients of friction are kept.
    stops : sequence of float, optional
        Shares of the path, in order, that no increment over a jump goes past: between events forces are linear, within
        an increment they are not known.

    Returns
    -------
    list of Event
        In order; the last one is the end of the path.

    Raises
    ------
    RuntimeError
        If the path does not lead to its end.
    """
    path = _Path(problem, stops)
    for _ in range(_LEAST_EVENTS + _EVENTS_A_POINT * len(path.force)):
        line = path.line()
        if path.jump() if line is None else path.advance(line):
            return path.events
    raise RuntimeError("points change between open, stick and slip without end")


class _Path:
    """A path in progress.

    Attributes
    ----------
    share : reached
    force : (c, d) N
    displacement : (c, d) mm, gap, and tangential displacement since the start of the path
    stops : shares that no increment over a jump goes past
    """

    def __init__(self, problem: ContactProblem, stops: Sequence[float]) -> None:
        self.problem, self.state = problem, problem.previous
        self.stops = [*stops, 1.0]
        self.share = 0.0
        self.systems, self.events = 0, list[Event]()
        self.force = self.state.force.copy()
        self.displacement = np.column_stack([self.state.gap, np.zeros(len(self.force))])
        self._start = self.displacement - self._through_body(self.force)
        self._rate = problem.free_motion - self._start
        self._set = _ActiveSet(self.state.status, np.sign(self.force[:, 1]))
        self._limit = 1.0 + problem.friction
        self._first = STICK if problem.friction.any() else SLIP  # status of a point that touches
        self._touched = np.zeros(len(self.force), dtype=bool)  # points that touched last; the next do what these do
        # increments over jumps: their number, end and length of the last
        self._jumps, self._landed, self._stride = 0, -1.0, 0.0

    # --- rates ----------------------------------------------------------------------------------------------------

    def line(self) -> _Line | None:
        """Return the line that forces and displacements follow from here; None if there is none."""
        normal, border = self.force[:, 0], _ZERO * float(np.abs(self.force).max(initial=0.0))
        at_apex = (normal <= border) & (self.displacement[:, 0] <= _ZERO * self.problem.length_scale)
        beyond = np.abs(self.force[:, 1]) - self.problem.friction * normal
        at_limit = (normal > border) & ((self._set.status == SLIP) | (beyond >= -border * self._limit))
        at_limit &= self.problem.friction > 0.0
        sign = np.where(at_limit, np.sign(self.force[:, 1]), self._set.sign)
        chosen: _ActiveSet | None = _ActiveSet(self._set.status, sign)
        for _ in range(_CHANGES):
            found, line = chosen, self._solved(chosen)
            if line is None:
                break
            chosen = self._mended(found, line, at_apex, at_limit)
            if chosen is None:
                self._set = found
                return line if self._continues(line) else None
        return None

    def _continues(self, line: _Line) -> bool:
        """Return whether a line begins at the forces reached, as far as round-off allows."""
        largest = max(float(np.abs(self.force).max(initial=0.0)), float(np.abs(line.force_rate).max(initial=0.0)))
        return bool(np.abs(line.force - self.force).max(initial=0.0) <= _CONTINUOUS * largest)

    def _mended(
        self, chosen: _ActiveSet, line: _Line, at_apex: NDArray[np.bool_], at_limit: NDArray[np.bool_]
    ) -> _ActiveSet | None:
        """Return the set in which the points that violate their conditions change; None if there are none."""
        (status, sign), mu, rho = chosen, self.problem.friction, self.problem.augmentation
        n, t = line.force_rate.T
        gap, slip = (rho * line.displacement_rate).T
        scale = _ROUND_OFF * (float(np.abs(line.force_rate).max()) or float(np.abs(rho * self._rate).max()))
        violation, into, towards = np.zeros(len(n)), status.copy(), sign.copy()

        def mend(points: NDArray[np.bool_], by: Float, new: int, direction: Float = sign) -> None:
            worse = points & (by > scale) & (by > violation)
            violation[worse], into[worse], towards[worse] = by[worse], new, direction[worse]

        touching = status != OPEN
        mend(at_apex & ~touching, -gap, self._first)
        mend(at_apex & touching, -n, OPEN)
        mend(at_apex & (status == STICK), (np.abs(t) - mu * n) / self._limit, SLIP, np.sign(t))
        mend(at_limit & (status == STICK), (sign * t - mu * n) / self._limit, SLIP)
        mend((at_apex | at_limit) & (status == SLIP) & (mu > 0.0), sign * slip, STICK)
        return _ActiveSet(into, towards) if violation.any() else None

    def _solved(self, chosen: _ActiveSet) -> _Line | None:
        """Return the line with an active set; None if its equations are singular."""
        (status, sign), problem = chosen, self.problem
        touching, stick = np.flatnonzero(status != OPEN), np.flatnonzero(status == STICK)
        slip = np.flatnonzero(status == SLIP)
        rows = np.concatenate([2 * touching, 2 * stick + 1])
        ratio = np.zeros(len(status))
        ratio[slip] = (sign * problem.friction)[slip]
        # normal forces are scaled, so that large coefficients of friction leave the columns of equal size
        scale = 1.0 / (1.0 + np.abs(ratio[touching]))
        columns = problem.delassus[rows]
        normal = (columns[:, 2 * touching] + ratio[touching] * columns[:, 2 * touching + 1]) * scale
        matrix = np.hstack([normal, columns[:, 2 * stick + 1]])
        free = self._start + self.share * self._rate
        target = np.column_stack([np.zeros(len(free)), self.displacement[:, 1]])
        right = np.stack([(target - free).ravel()[rows], -self._rate.ravel()[rows]], axis=1)
        self.systems += 1
        try:
            solved = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        lines = np.zeros((2, *free.shape))
        lines[:, touching, 0] = (solved[: len(touching)] * scale[:, None]).T
        lines[:, :, 1] = ratio * lines[:, :, 0]
        lines[:, stick, 1] = solved[len(touching) : len(rows)].T
        return _Line(lines[0], lines[1], self._through_body(lines[1]) + self._rate)

    # --- from event to event --------------------------------------------------------------------------------------

    def advance(self, line: _Line) -> bool:
        """Go along a line up to the next event; return whether the path ends there."""
        status, sign = self._set
        step, touch, limit, leave = self._next(line)
        share = 1.0 if self.share + step >= 1.0 else self.share + step
        force = line.force + step * line.force_rate
        force[leave] = 0.0
        # from the forces, since rates would add up their round-off
        moved = self._through_body(force) + self._start + share * self._rate
        moved[(status != OPEN) | touch, 0] = 0.0
        if not self._record(force, moved, status, share):  # rates without bound, but for round-off
            return self.jump()
        into = status.copy()
        into[touch] = self._set.status[self._touched].max(initial=self._first)
        into[limit] = SLIP
        into[leave] = OPEN
        towards = np.where(limit, np.sign(force[:, 1]), sign)
        towards[touch] = -np.sign(line.displacement_rate[touch, 1])
        self._set = _ActiveSet(into, towards)
        if touch.any():
            self._touched = touch
        return share == 1.0

    def _next(self, line: _Line) -> tuple[float, NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
        """Return the share up to the next event, and which points touch, reach their limit, and leave there."""
        status, mu = self._set.status, self.problem.friction
        # half of what is on the border, so that round-off leaves no point between both
        border = 0.5 * _ZERO * float(np.abs(line.force).max(initial=0.0))
        (n, t), (dn, dt) = line.force.T, line.force_rate.T

        def time(points: NDArray[np.bool_], margin: Float, rate: Float, least: Float | float) -> Float:
            out = np.full(len(margin), np.inf)
            nears = points & (rate < 0.0) & (margin > least)
            out[nears] = margin[nears] / -rate[nears]
            return out

        gap = self.displacement[:, 0]
        touch = time(status == OPEN, gap, line.displacement_rate[:, 0], 0.5 * _ZERO * self.problem.length_scale)
        leave = time(status != OPEN, n, dn, border)
        stick = status == STICK
        limit = np.minimum(
            time(stick, mu * n - t, mu * dn - dt, border * self._limit),
            time(stick, mu * n + t, mu * dn + dt, border * self._limit),
        )
        step = float(min(touch.min(), leave.min(), limit.min(), 1.0 - self.share))
        until = step * (1.0 + 1e-12)
        return step, touch <= until, (limit <= until) & (leave > until), leave <= until

    def _record(self, force: Float, moved: Float, status: Status, share: float) -> bool:
        """Keep a state if the contact conditions hold on the way to it; return whether they do."""
        part = np.column_stack([moved[:, 0], moved[:, 1] - self.displacement[:, 1]])
        error = residual(force, part, status, self.problem.friction, self.problem.length_scale)
        if error > TOLERANCE:
            return False
        self.force, self.displacement, self.share = force, moved, share
        self.state = next_state(self.state, force, part, status)
        self.events.append(Event(share, self.state, error, self.systems))
        return True

    def jump(self) -> bool:
        """Solve a short increment where there are no rates, with a longer one where it has no solution.

        Return whether the path ends there.
        """
        # one that follows at once is longer, else jumps in a row would go on in the smallest increments
        follows = self.share - self._landed <= self._stride or self._jumps > _MANY_JUMPS
        first = 10.0 * self._stride if follows else _STRIDES[0]
        stop = self.stops[bisect_right(self.stops, self.share)]
        for share in dict.fromkeys(min(self.share + stride, stop) for stride in (first, *_STRIDES)):
            free = self._start + share * self._rate
            free[:, 1] -= self.displacement[:, 1]
            found = solve_increment(replace(self.problem, previous=self.state, free_motion=free))
            self.systems += found.iterations
            if found.outcome.ok:
                break
        else:
            raise RuntimeError(f"no increment over a jump: {found.outcome}")
        self._jumps, self._landed, self._stride = self._jumps + 1, share, share - self.share
        moved = self._through_body(found.state.force) + self._start + share * self._rate
        if not self._record(found.state.force, moved, found.state.status, share):
            raise RuntimeError("the conditions do not hold after a jump")
        self._set = _ActiveSet(found.state.status, np.sign(self.force[:, 1]))
        return share >= 1.0

    def _through_body(self, force: Float) -> Float:
        """Return the displacement W r (c, d) mm of forces (c, d) N."""
        return np.asarray((self.problem.delassus @ force.ravel()).reshape(force.shape))


# --- presses --------------------------------------------------------------------------------------------------------


class ExactPath(NamedTuple):
    """Path of a press between two poses.

    Attributes
    ----------
    problem : Problem
    move : from its start to its end
    start : Event
    events : in order, up to the end
    bases : (c, d, d), directions of the points
    """

    problem: Problem
    move: Move
    start: Event
    events: list[Event]
    bases: Float

    def at(self, share: float) -> tuple[Event, int]:
        """Return the state at a share as an event, and the number of events up to there."""
        done = bisect_right(self.events, share, key=lambda event: event.share)
        before = self.events[done - 1] if done else self.start
        if done == len(self.events) or before.share == share:
            return before, done
        after = self.events[done]
        t = (share - before.share) / (after.share - before.share)
        return Event(share, _between(before.state, after.state, t), after.residual, after.systems), done

    def pose(self, share: float) -> ObjectPose:
        """Return the pose of the object at a share."""
        return self.move.end if share == 1.0 else self.move.at(share)

    def energies(self, events: Sequence[Event]) -> tuple[float, float]:
        """Return work and dissipation (mJ) from first to last event, exact since forces are linear between events.

        What forces on points lose that move relative to the object is dissipated, in slip and where forces jump.
        """
        symmetry, states = self.problem.symmetry, [event.state for event in events]
        count = np.bincount(symmetry.image_of, symmetry.multiplicity, len(self.bases)).astype(np.float64)
        forces = np.stack([state.force for state in states])
        mean = 0.5 * (forces[1:] + forces[:-1]) * count[:, None]
        relative = np.stack([np.column_stack([state.gap, state.tangential_displacement]) for state in states])
        resultants = np.einsum("eca,cak->ek", mean, self.bases)
        if "x" in self.problem.axes:  # the halves of a mirrored finger cancel
            resultants[:, 0] = 0.0
        way = (self.move.end.displacement - self.move.start.displacement)[: forces.shape[2]]
        return (
            float(np.sum(resultants * np.diff([event.share for event in events])[:, None] * way)),
            -float(np.sum(mean * np.diff(relative, axis=0))),
        )


def _between(one: ContactState, other: ContactState, t: float) -> ContactState:
    """Return the state at the share t of a straight way to another state, which has its status."""
    names = ("force", "gap", "tangential_displacement", "accumulated_slip")
    mean = {name: (1.0 - t) * getattr(one, name) + t * getattr(other, name) for name in names}
    return replace(other, **mean)


def solve_path(problem: Problem, state: State[Float], move: Move, shares: Sequence[float] = ()) -> ExactPath:
    """Follow the path on which the object moves straight from one pose to another.

    Where forces jump, states are those of increments, none of which goes past one of the shares of the path.
    """
    d = state.body.shape[1]
    found = contact_geometry(
        problem.placed(move.end).distance, problem.surface, axes=problem.axes, object_share=problem.system.object_share
    )
    bases = found.bases
    carried = (move.end.displacement - move.start.displacement)[:d]
    free = np.column_stack([found.gap, -np.einsum("ctk,ck->ct", bases[:, 1:], state.body + carried)])
    start = transported(state.contact, bases)
    free[:, 1:] += start.tangential_displacement
    rotations = bases @ vertical_frame(d).T
    delassus = problem.delassus
    if not (rotations == np.eye(d)).all():
        delassus = rotated_delassus(delassus, rotations, np.arange(len(delassus)))
    scale, law = length_scale(problem, move), problem.model.friction
    contact = ContactProblem.of(start, free, delassus, law, scale, area=problem.surface.area)
    return ExactPath(problem, move, Event(0.0, start, 0.0, 0), follow(contact, shares), bases)


def exact_press(problem: Problem) -> list[StepResult]:
    """Return the results at the stations of a press, between which it follows its exact path.

    The body is a section in small strain, the object flat and never turned, poses are prescribed, and friction has one
    constant coefficient.

    Raises
    ------
    RuntimeError
        If a path does not lead to its end.
    """
    model, formulation = problem.model, formulation_of(problem.model)
    state, pose, out = formulation.start(problem), problem.origin, list[StepResult]()
    work = lost = 0.0
    for leg in model.legs:
        assert isinstance(leg.steps, int)
        shares = [k / leg.steps for k in range(1, leg.steps + 1)]
        path = solve_path(problem, state, Move(pose, leg.end(pose)), shares)
        body, begin, passed = LinearBody(problem.delassus, np.zeros(path.bases.shape[:2])), path.start, 0
        for share in shares:
            end, done = path.at(share)
            gained = path.energies([begin, *path.events[passed:done], end])
            work, lost = work + gained[0], lost + gained[1]
            contact = replace(end.state, bases=path.bases)
            state = State(contact, body.displacement(contact.force, path.bases))
            there = path.pose(share)
            out.append(
                StepResult(
                    target=there,
                    state=problem.symmetry.unfold(contact),
                    meshed_state=state,
                    lowest=problem.placed(there).lowest,
                    moment=problem.symmetry.total_moment(formulation.loads(problem, state, there).moment),
                    readings=formulation.readings(problem, state),
                    external_work_mJ=work,
                    dissipation_mJ=lost,
                    outcome=Outcome.CONVERGED,
                    residual=max((event.residual for event in path.events[passed : done + 1]), default=0.0),
                    iterations=end.systems - begin.systems,
                    method="events",
                    penetration_mm=max(-float(contact.gap.min(initial=0.0)), 0.0),
                )
            )
            begin, passed = end, done
        pose = path.move.end
    return out
