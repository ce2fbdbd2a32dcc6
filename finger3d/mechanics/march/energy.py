"""Work of the object and frictional dissipation in one increment, mJ."""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.contact.friction import SLIP
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import transported
from finger3d.objects import Move


def external_work(problem: Problem, before: State[Any], after: State[Any], move: Move) -> float:
    """Return the work (mJ) of the object on the finger in an increment.

    It is the work of the contact forces on the body plus the frictional dissipation, by the trapezoidal rule.
    """
    start, end = transported(before.contact, after.contact.own_bases), after.contact
    friction = 0.5 * (start.force + end.force)[:, 1:]
    rubbed = np.einsum("ct,ct->c", friction, end.tangential_displacement - start.tangential_displacement)
    formulation = formulation_of(problem.model)
    on_body = formulation.loads(problem, after, move.end).work_from(formulation.loads(problem, before, move.start))
    return float(2 ** len(problem.axes) * on_body - problem.symmetry.total(rubbed))


def frictional_dissipation(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Return the frictional dissipation (mJ): slip times the friction under the mean normal force; never negative.

    Direction and coefficient of friction are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    ratio = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return problem.symmetry.total(lost * ratio)
