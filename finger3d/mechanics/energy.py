"""Work of the object and frictional dissipation in one increment, mJ."""

from __future__ import annotations

import numpy as np

from finger3d.contact.friction import SLIP
from finger3d.contact.state import ContactState
from finger3d.mechanics.linear_contact import LinearState, transported
from finger3d.mechanics.problem import Problem
from finger3d.objects import ObjectPose


def external_work(problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose) -> float:
    """Return the work (mJ) of the object on the finger.

    In small strain it is the mean contact force times the displacement of the finger's points, which adds up to the
    energy stored, and what friction takes, the trapezoidal sum of friction times slip.  At finite strain it is the mean
    force times the displacement of the object, less the part of a point that comes into contact or leaves it.
    """
    if isinstance(before, LinearState) and isinstance(after, LinearState):
        force = 0.5 * (before.scene_force + after.scene_force)
        on_body = np.einsum("ck,ck->c", force, after.displacement - before.displacement)
        assert after.bases is not None
        start = transported(before, after.bases)
        friction = 0.5 * (start.force + after.force)[:, 1:]
        rubbed = np.einsum("ct,ct->c", friction, after.tangential_displacement - start.tangential_displacement)
        return problem.symmetry.total(on_body - rubbed)
    moved = b.displacement - a.displacement
    mean = 0.5 * (problem.world_force(before) + problem.world_force(after))
    normal = 0.5 * (before.force[:, 0] + after.force[:, 0])
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
