"""Pose of an object in equilibrium with the forces applied to it, by a quasi-Newton method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import SLIP, STICK
from finger3d.contact.state import ContactSolution
from finger3d.errors import Outcome
from finger3d.mechanics.results.state import State

_ITERATIONS, _HALVINGS, _REFUSED = 1000, 12, 12
"""Most iterations of the contact, shorter trials of a step that does not lower the error, and such steps."""

_LESS = 1.0 - 1e-3
"""Ratio of successive errors below which the error has fallen."""

_LAST_DIGITS = 100.0
"""Largest error that is accepted where round-off keeps it above the target, over the target."""

_STRIDES, _CONSTANT = (1.0, 8.0, 64.0, 512.0, 4096.0), 1e-7
"""Steps of the differences over the shortest, and change of a force over the scale in that step that counts as none."""

_SLOW = 0.2
"""Ratio of successive errors above which the stiffness is differenced anew."""

_AT_LIMIT = 1e-9
"""Relative distance from the largest force that friction transmits at which it counts as reached."""

_MUCH = 1.1
"""Largest tangential force that a contact holds over the one that it slips under, beyond which a slope drives it."""


@dataclass(frozen=True)
class PoseTrial:
    """Increment to a trial pose.

    Attributes
    ----------
    place : (k,) mm, depth and slides that are sought
    solution : of the increment
    forces : (k,) N, at its end, along these
    """

    place: Float
    solution: ContactSolution[State[Any]]
    forces: Float

    @property
    def ok(self) -> bool:
        """Whether the increment converged."""
        return self.solution.outcome.ok

    @property
    def slips(self) -> bool:
        """Whether no point in contact sticks."""
        status = self.solution.state.contact.status
        return self.ok and bool((status == SLIP).any()) and not (status == STICK).any()

    @property
    def pressed_N(self) -> float:
        """Sum of the normal forces of the points."""
        return float(self.solution.state.contact.force[:, 0].sum())


@dataclass
class PoseSearch:
    """Newton's method for the pose at which the object is in equilibrium with the forces applied to it.

    The stiffness is found by differences and updated after every step (Broyden 1965).  A step that does not lower the
    error is halved.  Where the whole contact slips and cannot transmit the forces, the search ends.  Without contact no
    force is missing where none is prescribed: an object that has lost contact on the way is not held.

    Attributes
    ----------
    increment : function of depth and slides (k,) mm and of the best trial before, which solves the increment
    wanted : (k,) N
    scale_N : force that errors are relative to
    stride_mm : step of the differences
    target : relative error at which the search ends
    largest : function of a trial, the largest tangential force that its contact can transmit, over that wanted
    asked_N : tangential force wanted, and that at the end of the leg
    stiffness : (k, k) N/mm, of the increment before; None to begin with
    """

    increment: Callable[[Float, PoseTrial | None], PoseTrial]
    wanted: Float
    scale_N: float
    stride_mm: float
    target: float
    largest: Callable[[PoseTrial], float]
    asked_N: tuple[float, float]
    stiffness: Float | None = None
    iterations: int = field(default=0, init=False)

    def run(self, start: Float) -> PoseTrial:
        """Return the trial in equilibrium, or the best one with an outcome that says why there is none."""
        best, refused = self._tried(start, None), 0
        never_touched = not self._touches(best)
        while best.ok and (error := self._error(best)) > self.target and self.iterations < _ITERATIONS:
            fresh = self.stiffness is None
            stiffness = self._differenced(best) if self.stiffness is None else self.stiffness
            step = np.asarray(np.linalg.lstsq(stiffness, self.wanted - best.forces, rcond=1e-12)[0], dtype=np.float64)
            trial = self._step(best, step)
            if self._cannot_hold(trial):
                return self._ended(trial, Outcome.SLIPS)
            lowered = trial.ok and self._error(trial) < error
            quick = lowered and self._error(trial) < _SLOW * error
            kept = trial.ok and (quick or fresh or refused > 0)
            self.stiffness = self._updated(stiffness, best, trial) if kept else None
            # at a kink of the forces the stiffness in the direction of the step is that of the refused trial
            refused = 0 if lowered else refused + (fresh or refused > 0)
            if lowered:
                best = trial
            if refused > _REFUSED or not self._touches(best):
                break
        if not best.ok or (self._error(best) <= self._last_digits and (never_touched or self._touches(best))):
            return best
        return self._ended(best, Outcome.SLIPS if best.slips and self.asked_N[0] else Outcome.NOT_HELD)

    def _tried(self, place: Float, near: PoseTrial | None) -> PoseTrial:
        trial = self.increment(place, near)
        self.iterations += trial.solution.iterations
        return trial

    @property
    def _last_digits(self) -> float:
        """Relative error of forces that are equal but for round-off."""
        return _LAST_DIGITS * self.target

    def _touches(self, trial: PoseTrial) -> bool:
        return trial.pressed_N > self._last_digits * self.scale_N

    def _error(self, trial: PoseTrial) -> float:
        return float(np.abs(trial.forces - self.wanted).max()) / self.scale_N

    def _cannot_hold(self, trial: PoseTrial) -> bool:
        return trial.slips and self.largest(trial) < 1.0 - _AT_LIMIT

    def _differenced(self, best: PoseTrial) -> Float:
        """Return the stiffness by differences towards larger or smaller forces, as they are wanted.

        Points that slip may stick if the object moves back, so that the two differ.  Where all points slip, some one
        way and some the other, the force along a slide does not change until one of them turns: steps are then longer.
        """
        columns = []
        for k, missing in enumerate(self.wanted - best.forces):
            step, column = np.zeros(len(best.place)), np.zeros(len(best.place))
            for longer in _STRIDES:
                step[k] = np.copysign(longer * self.stride_mm, missing)
                trial = self._tried(best.place + step, best)
                if not trial.ok:
                    break
                column = (trial.forces - best.forces) / step[k]
                if abs(column[k]) * self.stride_mm > _CONSTANT * self.scale_N:
                    break
            columns.append(column)
        return np.stack(columns, axis=1)

    def _step(self, best: PoseTrial, step: Float) -> PoseTrial:
        """Return the trial after a step, which is shortened until the error falls.

        Where the largest missing force changes its sign, or the whole contact slips, the step went beyond a kink, and a
        bisection finds what lies before it.  Where the whole contact slips, forces no longer tell the pose, so that
        such a trial is taken only if there is no other.
        """
        k = int(np.argmax(np.abs(self.wanted - best.forces)))
        before, beyond, share, slipping = 0.0, 0.0, 1.0, None
        for _ in range(_HALVINGS):
            trial = self._tried(best.place + share * step, best)
            if self._cannot_hold(trial):
                return trial
            starts_to_slip = trial.slips and not best.slips
            changes_sign = (self.wanted - trial.forces)[k] * (self.wanted - best.forces)[k] < 0.0
            lowered = trial.ok and self._error(trial) < _LESS * self._error(best)
            if lowered and (self._touches(trial) or not changes_sign):
                if not starts_to_slip:
                    return trial
                slipping = slipping or trial
            if not beyond or not trial.ok or starts_to_slip or changes_sign:
                beyond = share
            else:
                before = share
            share = 0.5 * (before + beyond)
        return slipping or trial

    def _updated(self, stiffness: Float, best: PoseTrial, trial: PoseTrial) -> Float:
        step, change = trial.place - best.place, trial.forces - best.forces
        length = float(step @ step)
        return stiffness + np.outer(change - stiffness @ step, step) / length if length else stiffness

    def _ended(self, trial: PoseTrial, outcome: Outcome) -> PoseTrial:
        if outcome is Outcome.SLIPS:
            now, asked = self.asked_N
            held = self.largest(trial) * now
            if held <= 0.0:
                holds = f"pushes {-held:.3g} N the other way"
            elif held > _MUCH * asked:
                holds = f"holds at most {held:.9g} N, but slides down its slope under less"
            else:
                holds = f"holds at most {held:.9g} N, {100.0 * held / asked:.4g} % of it"
            detail = f"{asked:.6g} N asked; the contact {holds}"
        elif self._touches(trial):
            detail = f"the nearest forces differ by {self._error(trial) * self.scale_N:.3g} N"
        else:
            detail = "the object leaves the finger"
        return replace(trial, solution=replace(trial.solution, outcome=outcome, detail=detail))
