"""Frictional contact in two dimensions along a straight path, solved exactly from event to event.

Let the free motion q be linear in the share s of a path.  As long as no point changes its status, the forces r and the
relative displacements ``w = W r + q`` are linear in s, too, and their rates r', w' solve one system of equations::

    open    r' = 0
    stick   w'_n = 0,  w'_t = 0
    slip    w'_n = 0,  r'_t = sigma mu r'_n      sigma = 1 or -1, the direction of friction

At an event a point touches, reaches its friction limit, or leaves.  There the rates solve a linear complementarity
problem, in which only points on the border of their set may change it (Klarbring 1999)::

    r_n = 0, w_n = 0        open with w'_n >= 0; or touching with r' in the friction cone, and friction opposes slip
    |r_t| = mu r_n > 0      stick with sigma r'_t <= mu r'_n; or slip with sigma w'_t <= 0

It is solved by changes of the active set, and by Lemke's method where active sets come back.  Rates need not exist if
friction is large: forces then jump, and a short increment of the path is solved as such.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.conditions import TOLERANCE, ContactProblem, residual
from finger3d.contact.friction import OPEN, SLIP, STICK, Status
from finger3d.contact.lemke import rates_start
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState, Event, next_state
from finger3d.errors import Outcome

_ZERO = 1e-13
"""Gap over the length scale, and force over the largest, of points on the border of their set."""

_ROUND_OFF = 1e-11
"""Violation of the conditions on the rates that counts as none, over the largest rate of a force."""

_CONTINUOUS = 1e-8
"""Change of the forces at an event, over the largest, that is round-off."""

_TOGETHER, _ONE_BY_ONE = 12, 60
"""Changes of the active set: first of all points that violate a condition, then of the worst only."""

_LEAST_EVENTS, _EVENTS_A_POINT = 400, 40
"""Largest number of events: a constant, and one for each contact point."""

_STRIDES = tuple(10.0**k for k in range(-9, 1))
"""Shares of the path that an increment over a jump is tried with, until there is a solution."""

_MANY_JUMPS = 20
"""Jumps on a path after which each increment over one begins ten times longer than the last: points that snap off one
after the other, by the hundred with mu = 1e6 and nu = 0, would cost as many searches for the state after a jump."""


@dataclass(frozen=True)
class Resultant:
    """A resultant of the contact forces that is prescribed; a motion of the object follows from it.

    Attributes
    ----------
    weights : (c, d), of the forces in the resultant
    start, end : N, resultant at the ends of the path, between which it is linear
    motion : (c, d) mm, free motion per unit of the amplitude
    largest : amplitude at which the search for the resultant ends
    """

    weights: Float
    start: float
    end: float
    motion: Float
    largest: float


class _ActiveSet(NamedTuple):
    """Status (c,), and direction of friction (c,) where points slip."""

    status: Status
    sign: Float


class _Line(NamedTuple):
    """Forces (c, d), and their rates with those of displacements and amplitude, per share of the path."""

    force: Float
    amplitude: float
    force_rate: Float
    displacement_rate: Float
    amplitude_rate: float


def follow(
    problem: ContactProblem, resultant: Resultant | None = None, stops: Sequence[float] = ()
) -> tuple[ContactSolution[ContactState], list[Event]]:
    """Solve contact along the path of an increment, during which the free motion changes in proportion.

    Parameters
    ----------
    problem : ContactProblem
        In two dimensions; its coefficients of friction are kept.
    resultant : Resultant, optional
        Its motion is added to that of the problem.
    stops : sequence of float, optional
        Shares of the path, in order, that no increment over a jump goes past: between events forces are linear, within
        an increment they are not known.

    Returns
    -------
    solution : at the end of the path; CONVERGED only if the contact conditions hold at every event
    events : in order; the last one is the end of the path, or the place up to which it was followed
    """
    if problem.refusal:
        return ContactSolution(problem.previous, problem.refusal, np.inf, 0, "none"), []
    path = _Path(problem, resultant, stops)
    outcome = path.followed()
    state = path.state if outcome.ok else problem.previous
    return ContactSolution(state, outcome, path.residual, path.systems, "events"), path.events


class _Path:
    """A path in progress.

    Attributes
    ----------
    share, amplitude : reached
    force : (c, d) N
    displacement : (c, d) mm, gap, and tangential displacement since the start of the path
    stops : shares that no increment over a jump goes past
    """

    def __init__(self, problem: ContactProblem, resultant: Resultant | None, stops: Sequence[float]) -> None:
        self.problem, self.resultant, self.state = problem, resultant, problem.previous
        self.stops = [*stops, 1.0]
        self.share = self.amplitude = self.residual = 0.0
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

    def followed(self) -> Outcome:
        """Go on to the end of the path, or to where it cannot be continued."""
        most = _LEAST_EVENTS + _EVENTS_A_POINT * len(self.force)
        if self.resultant and not self.force.any() and not self._touches(self.resultant):
            return Outcome.FORCE_NOT_REACHED
        for _ in range(most):
            line = self._line()
            outcome = self._jump() if line is None else self._advance(line)
            if outcome:
                return outcome
        return Outcome.EVENTS

    # --- rates ----------------------------------------------------------------------------------------------------

    def _line(self) -> _Line | None:
        """Return the line that forces and displacements follow from here; None if there is none."""
        normal, border = self.force[:, 0], _ZERO * float(np.abs(self.force).max(initial=0.0))
        at_apex = (normal <= border) & (self.displacement[:, 0] <= _ZERO * self.problem.length_scale)
        beyond = np.abs(self.force[:, 1]) - self.problem.friction * normal
        at_limit = (normal > border) & ((self._set.status == SLIP) | (beyond >= -border * self._limit))
        at_limit &= self.problem.friction > 0.0
        sign = np.where(at_limit, np.sign(self.force[:, 1]), self._set.sign)
        status = self._set.status
        if self.resultant and not status.any():  # a force needs a point to act on
            status = np.where(at_apex, self._first, OPEN).astype(np.int8)
        chosen = _ActiveSet(status, sign)
        line = self._improved(chosen, at_apex, at_limit, (True, False))
        return self._by_pivots(at_apex, at_limit, sign) if line is None else line

    def _improved(
        self, chosen: _ActiveSet, at_apex: NDArray[np.bool_], at_limit: NDArray[np.bool_], ways: tuple[bool, ...]
    ) -> _Line | None:
        """Change an active set until the rates satisfy all conditions; None where a set comes back.

        Parameters
        ----------
        ways : whether all points that violate a condition change, or the worst only, one way after the other
        """
        for together in ways:
            tried = set[bytes]()
            for _ in range(_TOGETHER if together else _ONE_BY_ONE):
                line = self._solved(chosen)
                if line is None:
                    break
                violation, better = self._violations(chosen, line, at_apex, at_limit)
                if violation.max(initial=0.0) <= 0.0:
                    self._set = chosen
                    return line if self._continues(line) else None
                tried.add(chosen.status.tobytes() + chosen.sign.tobytes())
                changes = violation > 0.0 if together else np.arange(len(violation)) == violation.argmax()
                chosen = _ActiveSet(
                    np.where(changes, better.status, chosen.status), np.where(changes, better.sign, chosen.sign)
                )
                if chosen.status.tobytes() + chosen.sign.tobytes() in tried:
                    break
        return None

    def _continues(self, line: _Line) -> bool:
        """Return whether a line begins at the forces reached, as far as round-off allows."""
        largest = max(float(np.abs(self.force).max(initial=0.0)), float(np.abs(line.force_rate).max(initial=0.0)))
        return bool(np.abs(line.force - self.force).max(initial=0.0) <= _CONTINUOUS * largest)

    def _violations(
        self, chosen: _ActiveSet, line: _Line, at_apex: NDArray[np.bool_], at_limit: NDArray[np.bool_]
    ) -> tuple[Float, _ActiveSet]:
        """Return by how much (c,) N points violate their conditions, 0 within round-off, and the set that mends it."""
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
        return violation, _ActiveSet(into, towards)

    def _solved(self, chosen: _ActiveSet) -> _Line | None:
        """Return the line with an active set; None if its equations are singular."""
        (status, sign), problem, more = chosen, self.problem, self.resultant
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
        if more is not None:
            weights = more.weights[touching]
            row = np.concatenate([(weights[:, 0] + ratio[touching] * weights[:, 1]) * scale, more.weights[stick, 1]])
            column = more.motion.ravel()[rows]
            matrix = np.block([[matrix, column[:, None]], [row[None], np.zeros((1, 1))]])
            change = more.end - more.start
            right = np.vstack([right, [more.start + self.share * change, change]])
        self.systems += 1
        try:
            solved = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        lines = np.zeros((2, *free.shape))
        lines[:, touching, 0] = (solved[: len(touching)] * scale[:, None]).T
        lines[:, :, 1] = ratio * lines[:, :, 0]
        lines[:, stick, 1] = solved[len(touching) : len(rows)].T
        amplitude, its_rate = (float(solved[-1, 0]), float(solved[-1, 1])) if more else (0.0, 0.0)
        moved = self._through_body(lines[1]) + self._rate
        if more is not None:
            moved = moved + its_rate * more.motion
        return _Line(lines[0], amplitude, lines[1], moved, its_rate)

    def _by_pivots(self, at_apex: NDArray[np.bool_], at_limit: NDArray[np.bool_], sign: Float) -> _Line | None:
        """Return the line by Lemke's method; None if there is none."""
        more = self.resultant
        bordered = None if more is None else (more.weights, more.end - more.start, more.motion)
        stick = (self._set.status != OPEN) & ~at_apex & ~at_limit
        found = rates_start(self.problem, self._rate, (stick, at_limit, at_apex), sign, bordered)
        return None if found is None else self._improved(_ActiveSet(*found), at_apex, at_limit, (False,))

    # --- from event to event --------------------------------------------------------------------------------------

    def _advance(self, line: _Line) -> Outcome | None:
        """Go along a line up to the next event; return the outcome if the path ends there."""
        status, sign = self._set
        step, touch, limit, leave = self._next(line)
        ends, more = self.share + step >= 1.0, self.resultant
        too_far = more is not None and line.amplitude + step * line.amplitude_rate > more.largest
        if more is not None and too_far:
            step = max((more.largest - line.amplitude) / line.amplitude_rate, 0.0)
            touch, limit, leave = (np.zeros_like(touch) for _ in range(3))
        force = line.force + step * line.force_rate
        force[leave] = 0.0
        share = 1.0 if ends and not too_far else self.share + step
        amplitude = line.amplitude + step * line.amplitude_rate
        # from the forces, since rates would add up their round-off
        moved = self._through_body(force) + self._start + share * self._rate
        if more is not None:
            moved = moved + amplitude * more.motion
        moved[(status != OPEN) | touch, 0] = 0.0
        if not self._record(force, moved, status, amplitude, share):  # rates without bound, but for round-off
            return self._jump() if more is None else Outcome.NO_CONVERGENCE
        if too_far:
            return Outcome.FORCE_NOT_REACHED
        into = status.copy()
        into[touch] = self._set.status[self._touched].max(initial=self._first)
        into[limit] = SLIP
        into[leave] = OPEN
        towards = np.where(limit, np.sign(force[:, 1]), sign)
        towards[touch] = -np.sign(line.displacement_rate[touch, 1])
        self._set = _ActiveSet(into, towards)
        if touch.any():
            self._touched = touch
        return Outcome.CONVERGED if ends else None

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

    def _record(
        self, force: Float, moved: Float, status: Status, amplitude: float, share: float, is_increment: bool = False
    ) -> bool:
        """Keep a state if the contact conditions hold on the way to it; return whether they do."""
        part = np.column_stack([moved[:, 0], moved[:, 1] - self.displacement[:, 1]])
        error = residual(force, part, status, self.problem.friction, self.problem.length_scale)
        if error > TOLERANCE:
            return False
        self.residual = max(self.residual, error)
        self.force, self.displacement, self.share, self.amplitude = force, moved, share, amplitude
        self.state = next_state(self.state, force, part, status)
        self.events.append(Event(share, amplitude, self.state, error, self.systems, is_increment))
        return True

    def _jump(self) -> Outcome | None:
        """Solve a short increment where there are no rates, with a longer one where it has no solution."""
        if self.resultant is not None:
            return Outcome.FORCE_JUMPS
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
            return found.outcome
        self._jumps, self._landed, self._stride = self._jumps + 1, share, share - self.share
        moved = self._through_body(found.state.force) + self._start + share * self._rate
        if not self._record(found.state.force, moved, found.state.status, 0.0, share, is_increment=True):
            return Outcome.NO_CONVERGENCE
        self._set = _ActiveSet(found.state.status, np.sign(self.force[:, 1]))
        return Outcome.CONVERGED if share >= 1.0 else None

    def _touches(self, more: Resultant) -> bool:
        """Move the object, without forces, to where the first point touches; return whether it does."""
        if more.end <= 0.0:
            return True
        nears = more.motion[:, 0] < 0.0
        way = np.min(self.displacement[nears, 0] / -more.motion[nears, 0], initial=np.inf)
        if way > more.largest:
            return False
        moved = self.displacement + way * more.motion
        self._record(self.force, moved, self._set.status, float(way), 0.0)
        return True

    def _through_body(self, force: Float) -> Float:
        """Return the displacement W r (c, d) mm of forces (c, d) N."""
        return np.asarray((self.problem.delassus @ force.ravel()).reshape(force.shape))
