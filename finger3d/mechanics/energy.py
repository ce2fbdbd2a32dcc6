"""Work of the object and frictional dissipation in one increment, mJ."""

from __future__ import annotations

import numpy as np

from finger3d.contact.friction import SLIP
from finger3d.contact.state import ContactState
from finger3d.mechanics.history import ObjectPose
from finger3d.mechanics.problem import Problem


def external_work(problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose) -> float:
    """Return the work (mJ) of the object on the finger: mean contact force times the displacement of its point.

    A point that comes into contact, or leaves it, has its force for a part of the increment only; the change of its
    gap is not part of the path of the force.  In small strain the sum over increments is exactly the change of stored
    energy plus the trapezoidal sum of friction times slip.
    """
    moved = b.displacement - a.displacement
    mean = 0.5 * (problem.world_force(before) + problem.world_force(after))
    normal = 0.5 * (before.force[:, 0] + after.force[:, 0])
    if not problem.model.formulation.finite_strain:
        closed = after.gap - before.gap
        if moved[0] or moved[2]:
            # The object's profile moves under a point: its force does work where the finger follows the profile.
            n = problem.model.object.frame(problem.dim)[0]
            closed -= problem.gap(b) - problem.gap(a) + n @ moved[: problem.dim]
    else:
        # Beside the object the gap is arbitrary; no gap is closed by more than the object moves.
        reach = float(np.linalg.norm(moved))
        closed = np.minimum(after.gap, reach) - np.minimum(before.gap, reach)
    return float(mean.sum(axis=0) @ moved) + problem.symmetry.total(normal * closed)


def frictional_dissipation(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Return the frictional dissipation (mJ): slip times the friction under the mean normal force; never negative.

    Direction and coefficient of friction are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    share = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return problem.symmetry.total(lost * share)
