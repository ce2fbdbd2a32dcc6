"""Both derivatives of a press that ends at a kink, where a point is just about to change its status.

There a gap and the normal force are zero together, or the distance from the friction limit and the slip.  As a
parameter falls and as it grows, the press then has two active sets: those whose derivatives violate no condition.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, STICK, Status
from finger3d.contact.state import ContactState, pressure
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.small_strain.linear_contact import transported
from finger3d.mechanics.small_strain.variations import Side

_ZERO, _NO_CHANGE, _ROUND_OFF = 1e-8, 1e-6, 1e-13
"""Margins of points on the border of their set, over the depth or the largest force; changes of margins that violate no
condition, over the largest; and such changes over the depth or the largest force."""

_TOGETHER, _MOST = 6, 30
"""Changes of the active set: first of all points that violate a condition, then of the worst only."""

Sides: TypeAlias = list[Side | None]
"""Sides (2 p,) below and above each of p parameters; None where they are not known."""


class End(NamedTuple):
    """Contact of a press at the beginning and at the end of a motion."""

    problem: Problem
    before: ContactState
    after: ContactState

    @property
    def friction(self) -> Float:
        """Coefficients of friction (c,)."""
        return coefficients(self.problem, self.before, self.after.status)

    @property
    def margins(self) -> Float:
        """Gap (mm), normal force and distance from the friction limit (N), and slip (mm) along friction: (4, c)."""
        normal, along = self.after.force[:, 0], self.after.force[:, 1:]
        length = np.linalg.norm(along, axis=1)
        start = transported(self.before, self.after.own_bases).tangential_displacement
        slip = -np.sum((self.after.tangential_displacement - start) * along, axis=1)
        slip = np.divide(slip, length, out=np.zeros_like(slip), where=length > 0.0)
        return np.stack([self.after.gap, normal, self.friction * normal - length, slip])

    @property
    def sizes(self) -> Float:
        """What margins are compared with, (4, 1): the depth (mm), and the largest force (N)."""
        length, force = self.problem.model.largest_depth_mm, float(np.abs(self.after.force).max(initial=0.0))
        return np.array([length, force, force, length])[:, None]

    @property
    def is_kink(self) -> bool:
        """Whether a point is on the border of its set."""
        at_zero = self.margins <= _ZERO * self.sizes
        return bool(_mended(self.after.status, at_zero.astype(np.float64), at_zero, self.friction)[1].any())


Solved: TypeAlias = Callable[[Status], tuple[Sequence[Side], Sequence[ContactState]]]
"""The sides (2 p,) if the points had these statuses (c,) at the end of a motion, and their contact at its beginning."""


def one_sided(here: End, solved: Solved, way: int) -> Sides:
    """Return the sides at a kink with the active sets of falling (`way` -1) or growing (1) parameters.

    Points that begin to touch are taken to stick; sides are not known where one of them would slip.
    """
    size, known = here.sizes, dict[bytes, tuple[Sequence[Side], Sequence[ContactState]]]()
    at_zero = here.margins <= _ZERO * size

    def found(number: int) -> Sides:
        status = here.after.status
        for change in range(_MOST):
            if status.tobytes() not in known:
                known[status.tobytes()] = solved(status)
            sides, befores = known[status.tobytes()]
            side = sides[number + (way > 0)]
            changes = End(side.problem, befores[number + (way > 0)], side.state.contact).margins - here.margins
            least = np.maximum(_NO_CHANGE * np.abs(changes).max(axis=1, keepdims=True), _ROUND_OFF * size)
            violation = np.where(changes < -least, -changes / size, 0.0)
            better, by = _mended(status, violation, at_zero, here.friction)
            if not by.any():
                slips = (status == STICK) & at_zero[1] & (violation[2] > 0.0)
                return [None, None] if slips.any() else [*sides[number : number + 2]]
            status = np.where(by >= (by.max() if change >= _TOGETHER else np.finfo(float).tiny), better, status)
        return [None, None]

    known[here.after.status.tobytes()] = nominal = solved(here.after.status)
    return [side for number in range(0, len(nominal[0]), 2) for side in found(number)]


def coefficients(problem: Problem, before: ContactState, status: Status) -> Float:
    """Return the coefficients of friction (c,) of points with a status (c,) at the end of an increment."""
    friction, pressed = problem.model.friction, pressure(before.force, problem.surface.area)
    return friction.updated(friction.coefficients(status, pressed), status, pressed)


def _mended(status: Status, violation: Float, at_zero: NDArray[np.bool_], friction: Float) -> tuple[Status, Float]:
    """Return the statuses (c,) that mend violations (4, c) of conditions of points at their border, and by how much."""
    better, by = status.copy(), np.zeros(len(status))
    rubs = ~at_zero[1] & (friction > 0.0)
    touches = np.where(friction > 0.0, STICK, SLIP)
    changes = (
        (status == OPEN, touches),
        (status != OPEN, np.full_like(touches, OPEN)),
        ((status == STICK) & rubs, np.full_like(touches, SLIP)),
        ((status == SLIP) & rubs, np.full_like(touches, STICK)),
    )
    for (points, new), own, border in zip(changes, violation, at_zero, strict=True):
        worse = points & border & (own > by)
        better[worse], by[worse] = new[worse], own[worse]
    return better, by
