"""Work of the object and frictional dissipation in one increment, mJ."""

from __future__ import annotations

import numpy as np

from finger3d.contact.friction import SLIP
from finger3d.contact.state import ContactState
from finger3d.mechanics.linear_contact import transported
from finger3d.mechanics.problem import Problem
from finger3d.objects import Move


def external_work(problem: Problem, before: ContactState, after: ContactState, move: Move) -> float:
    """Return the work (mJ) of the object on the finger in an increment.

    It is the work of the contact forces on the body plus the frictional dissipation, by the trapezoidal rule.
    """
    assert after.bases is not None
    start = transported(before, after.bases)
    friction = 0.5 * (start.force + after.force)[:, 1:]
    rubbed = np.einsum("ct,ct->c", friction, after.tangential_displacement - start.tangential_displacement)
    on_body = problem.model.formulation.work_on_body(problem, before, after, move)
    return float(2 ** len(problem.axes) * on_body - problem.symmetry.total(rubbed))


def frictional_dissipation(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Return the frictional dissipation (mJ): slip times the friction under the mean normal force; never negative.

    Direction and coefficient of friction are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    share = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return problem.symmetry.total(lost * share)
