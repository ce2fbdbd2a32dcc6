"""Adjoint of the increments of a press: sensitivity of its numbers to the Delassus operator.

In increment k the contact forces r_k are linear functions P_k x_k of the unknowns of the active set, and satisfy its
linear equations (`finger3d.contact.newton.ActiveSet`)::

    D_k (W r_k - B_k W r_{k-1} - C_k W r_{k-2} + q_k) + E_k x_k = 0

B_k keeps tangential components, since slip is counted from the increment before.  A point that closes in the increment
slips from where it touches, which depends on its motion in the increment before; B_k and C_k have the derivatives.  For
a number J(r, W r) with the derivatives g_k by the forces and v_k by the displacements of increment k, the adjoint
equations, backwards from the last increment, are ::

    A_k^T y_k = P_k^T (g_k + W (v_k + p_k)),   z_k = D_k^T y_k,   A_k = D_k W P_k + E_k
    p_k = B_{k+1}^T z_{k+1} + C_{k+2}^T z_{k+2}

and a change of the Delassus operator changes the number by ``sum_k l_k . dW r_k`` with the adjoint loads
``l_k = v_k - z_k + p_k``.  Active sets and the normals of the object are held fixed; an
exact path counts as the increments between its results.  An increment that was solved in
parts counts as several.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP
from finger3d.contact.state import ContactState
from finger3d.fem.tensors import block_diagonal
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.parts import Substep
from finger3d.mechanics.readings.columns import Column
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.small_strain.linear_contact import transported
from finger3d.mechanics.small_strain.linearised import LinearisedIncrement, upright
from finger3d.objects import Move, vertical_frame

_ROUND_OFF = 1e-12
"""Relative round-off of the share of a motion until touch."""


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A number of a press, linearised about the solution of its N increments.

    Attributes
    ----------
    by_force : (N, c d)
        Derivative by the contact forces of each increment, per N, in the directions of an upright object.
    by_displacement : (N, c d)
        Derivative by the displacements of the contact points at the end of each increment, per mm.
    row : int or None
        Number of the reading row that gives the number itself, for a reading.
    column : Column or None
        Column of the reading.
    """

    name: str
    by_force: Float
    by_displacement: Float
    row: int | None = None
    column: Column | None = None


@dataclass(frozen=True)
class SlipReference:
    """Where slip in an increment is counted from, as a function of the displacements before it.

    Attributes
    ----------
    by_last, by_earlier : (c d, c d) sparse
        Derivatives B and C by the displacements at the start of the increment and of the one before, in the directions
        of an upright object.
    """

    by_last: Any
    by_earlier: Any

    @classmethod
    def of(cls, problem: Problem, part: Substep) -> SlipReference:
        """Return the reference of the increment between two states."""
        d = part.after.contact.force.shape[1]
        end, bases = (state.contact.own_bases @ vertical_frame(d).T for state in (part.after, part.before))
        along = np.einsum("ctk,ctl->ckl", end[:, 1:], end[:, 1:])
        if part.before.last is None or problem.model.is_defined_by_increments:
            return cls(block_diagonal(along), block_diagonal(np.zeros_like(along)))
        share, motion = part.before.share_until_touch(part.move), part.before.last[1]
        slope = np.zeros_like(motion[:, 1:])
        touches = (
            (share > 0.0)
            & (motion[:, 0] < 0.0)
            & (share * -motion[:, 0] >= (1.0 - _ROUND_OFF) * part.before.contact.gap)
        )
        slope[touches] = motion[touches, 1:] / -motion[touches, :1]
        normal = np.einsum("ct,ctk,cl->ckl", slope, bases[:, 1:], bases[:, 0])
        moved = share[:, None, None] * (np.einsum("ctk,ctl->ckl", bases[:, 1:], bases[:, 1:]) + normal)
        return cls(block_diagonal(along @ (np.eye(d) + normal + moved)), block_diagonal(-along @ moved))


def adjoint_loads(problem: Problem, steps: Sequence[StepResult], goals: Sequence[Goal]) -> Float:
    """Return the adjoint loads (N, c d, g) of goals.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the active set of an increment is singular.
    """
    c, d = problem.delassus.shape[:2]
    delassus = problem.delassus.reshape(c * d, c * d)
    parts = _parts(problem, steps)
    out = np.zeros((len(parts), c * d, len(goals)))
    later, last = np.zeros((2, c * d, len(goals)))  # p of the increment, and the term of the one before it
    for k in range(len(parts) - 1, -1, -1):
        increment = LinearisedIncrement.of(problem, parts[k].before.contact, parts[k].after.contact)
        direct = np.stack([goal.by_displacement[k] for goal in goals], axis=1)
        gradient = np.stack([goal.by_force[k] for goal in goals], axis=1) + delassus @ (direct + later)
        z = increment.adjoint(gradient)
        out[k] = direct - z + later
        reference = SlipReference.of(problem, parts[k])
        later, last = last + reference.by_last.T @ z, reference.by_earlier.T @ z
    return out


def forces_of(problem: Problem, steps: Sequence[StepResult]) -> Float:
    """Return the contact forces (c d, N) of increments, in the directions of an upright object."""
    return np.stack([problem.upright_force(part.after.contact).ravel() for part in _parts(problem, steps)], axis=1)


def press_goals(problem: Problem, steps: Sequence[StepResult]) -> list[Goal]:
    """Return forces and moments, friction sum, energies and readings of the last increment, linearised."""
    c, d = problem.delassus.shape[:2]
    parts = _parts(problem, steps)
    zero = np.zeros((len(parts), c * d))
    count: Float = np.bincount(problem.symmetry.image_of, problem.symmetry.multiplicity, c).astype(np.float64)
    last = parts[-1].after.contact
    vertical, shear = np.zeros((c, d)), np.zeros((c, d))
    vertical[:, 0] = count  # the first direction of an upright object points down
    friction = np.linalg.norm(last.force[:, 1:], axis=1)
    shear[:, 1:] = last.force[:, 1:] * (count / np.where(friction > 0.0, friction, 1.0))[:, None]
    found = [
        Goal(name="normal_force_N", by_force=_at_end(zero, vertical), by_displacement=zero),
        Goal(name="friction_sum_N", by_force=_at_end(zero, upright(last, shear)), by_displacement=zero),
        _work(problem, parts, count, zero),
        _dissipation(problem, parts, count, zero),
    ]
    found += [
        Goal(name=name, by_force=_at_end(zero, gradient), by_displacement=zero)
        for name, gradient in _resultants(problem, steps[-1], last).items()
        if gradient.any()
    ]
    rows = problem.system.reading_rows
    return found + [
        Goal(name=column.key, by_force=_at_end(zero, row), by_displacement=zero, row=k, column=column)
        for k, (column, row) in enumerate(zip(problem.model.columns, rows, strict=True))
    ]


def _resultants(problem: Problem, step: StepResult, last: ContactState) -> dict[str, Float]:
    """Return the derivatives (c, d) of the resultants by the forces, in the directions of an upright object.

    Resultants in planes of symmetry are zero, and so are their derivatives; those across a section are left out.
    """
    c, d = last.force.shape
    whole = problem.symmetry.unfold(last)
    bases = np.asarray(whole.bases)
    signs = problem.symmetry.mirror_sign * problem.symmetry.multiplicity[:, None]
    arms = np.pad(problem.surface.centroids, ((0, 0), (0, 3 - d)))

    def of_weights(weights: Float, tangential: bool) -> Float:
        """Derivative of the sum of weights (m, d) times forces, or friction, of the whole finger's points."""
        local = np.einsum("mak,mk->ma", bases, weights) * signs
        if tangential:
            local[:, 0] = 0.0
        own = np.zeros((c, d))
        np.add.at(own, problem.symmetry.image_of, local)
        return upright(last, own)

    found = {}
    for k, axis in enumerate("xyz"[:d]):
        along = np.broadcast_to(np.eye(d)[k], (len(bases), d))
        found[f"force_{axis}_N"] = of_weights(along, tangential=False)
        if axis != "y":
            outward = problem.points.sides_of(step.lowest)[:, [k // 2]] * along
            found[f"tangential_force_{axis}_N"] = of_weights(along, tangential=True)
            found[f"outward_friction_{axis}_N"] = of_weights(outward, tangential=True)
    for k, factor in enumerate(problem.symmetry.total_moment(np.ones(3))):
        if factor and (d == 3 or k == 2):
            # the k-th component of arm x force is force . (unit_k x arm)
            lever = factor * np.cross(np.eye(3)[k], arms)[:, :d]
            found[f"moment_{'xyz'[k]}_Nmm"] = lever @ vertical_frame(d).T
    moves = np.isin(np.arange(c * d), problem.system.active_dofs).reshape(c, d)  # none across a plane of symmetry
    return {name: np.where(moves, gradient, 0.0) for name, gradient in found.items()}


def _parts(problem: Problem, steps: Sequence[StepResult]) -> list[Substep]:
    """Return the parts that the increments were solved in."""
    ends = [(problem.origin, formulation_of(problem.model).start(problem))]
    ends += [part for step in steps for part in step.parts]
    return [Substep(before, after, Move(start, end)) for (start, before), (end, after) in pairwise(ends)]


def _at_end(zero: Float, gradient: Float) -> Float:
    """Return gradients (N, c d) that are zero but in the last increment."""
    out = zero.copy()
    out[-1] = gradient.ravel()
    return out


def _add_slip(by_displacement: Float, k: int, along: Float, reference: SlipReference) -> None:
    """Add the derivatives (c d,) by the slip of an increment to those by displacements."""
    by_displacement[k] += along
    if k:
        by_displacement[k - 1] -= reference.by_last.T @ along
    if k > 1:
        by_displacement[k - 2] -= reference.by_earlier.T @ along


def _work(problem: Problem, parts: Sequence[Substep], count: Float, zero: Float) -> Goal:
    """Return the external work: the stored energy plus the frictional dissipation of all increments."""
    c, d = parts[-1].after.contact.force.shape
    by_force, by_displacement = zero.copy(), zero.copy()
    for k, part in enumerate(parts):
        after = part.after.contact
        start = transported(part.before.contact, after.own_bases)
        slip, friction = np.zeros((c, d)), np.zeros((c, d))
        slip[:, 1:] = after.tangential_displacement - start.tangential_displacement
        friction[:, 1:] = (0.5 * (start.force + after.force))[:, 1:]
        half_slip = 0.5 * upright(after, count[:, None] * slip).ravel()
        along = upright(after, count[:, None] * friction).ravel()
        by_force[k] -= half_slip
        if k:
            by_force[k - 1] -= half_slip
        _add_slip(by_displacement, k, -along, SlipReference.of(problem, part))
    last = problem.upright_force(parts[-1].after.contact).ravel()
    half = 0.5 * 2.0 ** len(problem.axes)
    by_force[-1] += half * (problem.delassus.reshape(c * d, c * d) @ last)
    by_displacement[-1] += half * last
    return Goal(name="external_work_mJ", by_force=by_force, by_displacement=by_displacement)


def _dissipation(problem: Problem, parts: Sequence[Substep], count: Float, zero: Float) -> Goal:
    """Return the dissipation, mu times the mean normal force times the slip of all increments."""
    by_force, by_displacement = zero.copy(), zero.copy()
    for k, part in enumerate(parts):
        after = part.after.contact
        start = transported(part.before.contact, after.own_bases)
        slips = (after.status == SLIP) & (after.status != OPEN) & (after.force[:, 0] > 0.0)
        slip = np.where(slips[:, None], after.tangential_displacement - start.tangential_displacement, 0.0)
        end = np.where(slips, after.force[:, 0], 1.0)
        mu = np.where(slips, np.linalg.norm(after.force[:, 1:], axis=1) / end, 0.0)
        normal = np.zeros_like(after.force)
        normal[:, 0] = 0.5 * count * mu * np.linalg.norm(slip, axis=1)
        along = np.zeros_like(after.force)
        share = 0.5 * count * (start.force[:, 0] + after.force[:, 0]) / end
        along[:, 1:] = np.where(slips[:, None], -after.force[:, 1:] * share[:, None], 0.0)
        normal, along = upright(after, normal).ravel(), upright(after, along).ravel()
        by_force[k] += normal
        if k:
            by_force[k - 1] += normal
        _add_slip(by_displacement, k, along, SlipReference.of(problem, part))
    return Goal(name="dissipation_mJ", by_force=by_force, by_displacement=by_displacement)
