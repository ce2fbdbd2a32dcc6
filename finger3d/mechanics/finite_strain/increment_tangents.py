"""Derivatives of increments at finite strain, from the tangents at their ends.

With the body's tangent K, contact rows B, and forces r = P x of the active set, the derivatives of displacements u and
of the unknowns x by a parameter solve ::

    K du + dR - d(B^T r) = 0,   D dw + E dx = 0

(`finger3d.mechanics.small_strain.increment_tangents`), where dR is the change of the internal forces at fixed
displacements; in a body that relaxes they follow from internal variables before, which differ between the two sides of
a parameter.  d(B^T r) and dw are central differences between these sides on the deformed surface; they hold how rows
and directions change with u.  The equations are solved by iteration with the tangent of the increment, factored once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.state import ContactState
from finger3d.errors import Finger3dError
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.tensors import rotated_delassus
from finger3d.mechanics.finite_strain.equations import Configuration, IncrementEquations
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.finite_strain.state import DeformedBody, FiniteStrainWorkspace, Linearisation, contact_of
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.increment_tangents import IncrementTangents, readings_of, rubbed, side_after
from finger3d.mechanics.small_strain.linearised import LinearisedIncrement, Part, slopes
from finger3d.mechanics.small_strain.variations import Side
from finger3d.objects import Move, vertical_frame

_CHANGE, _ROUND_OFF, _MOST = 1e-8, 1e-5, 60
"""Change of the unknowns, over the largest, at which the iteration ends, that at which it may if it falls no further,
and the largest number of iterations."""

_NEGLIGIBLE = 1e-7
"""Derivative by a parameter in units of its step, over the value, that errors are relative to at least."""


@dataclass(frozen=True)
class _Linear:
    """Increment at finite strain, linearised at its end.

    Attributes
    ----------
    tangent : (N, N) sparse, of the body
    body : the same with the contact, factored
    active : equations of the active set
    """

    tangent: Any
    body: Linearisation
    active: LinearisedIncrement


class FiniteIncrementTangents(IncrementTangents):
    """Derivatives of a press at finite strain, one increment after another."""

    formulation: FiniteStrain

    def _linearised(self, before: State[DeformedBody], after: State[DeformedBody], move: Move) -> _Linear:
        problem, contact = self.problem, after.contact
        workspace = FiniteStrainWorkspace(bodies=self._workspace.bodies)
        equations = self.formulation.equations(problem, before, move, workspace)
        linearisation = equations.linearise(equations.at(after.body.unknowns), contact.force)
        delassus, compliance = linearisation.delassus, problem.system.object_compliance
        if compliance is not None:
            delassus = delassus + rotated_delassus(compliance, contact.own_bases @ vertical_frame(problem.dim).T)
        upper = equations.body.tangent(after.body.unknowns).upper
        active = LinearisedIncrement.of(problem, before.contact, contact, delassus)
        return _Linear((upper + sp.triu(upper, 1).T).tocsr(), linearisation, active)

    def _after(self, part: Part, sides: Sequence[Side], steps: Float, moves: Sequence[Move]) -> list[Side]:
        """Return the sides after a part of an increment."""
        problem, contact, x = self.problem, part.after.contact, part.after.body.unknowns
        linear, active, size = part.linear, problem.system.active_dofs, steps[1::2]
        p, n, largest = len(size), problem.mesh.points.size, np.abs(contact.force).max(initial=0.0)
        formulations: list[Any] = [formulation_of(side.problem.model) for side in sides]
        equations = [
            formulation.equations(side.problem, side.state, move, workspace)
            for formulation, side, move, workspace in zip(
                formulations, sides, moves, self._workspaces_of(sides), strict=True
            )
        ]
        internal = np.zeros((len(x), p))
        for k, pair in enumerate(zip(equations[::2], equations[1::2], strict=True)):
            if pair[0].body is not pair[1].body:
                internal[:, k] = slopes([one.body.internal_forces(x) for one in pair], steps[2 * k :][:2])[:, 0]
        direct = slopes(rubbed(part, sides), steps)
        unknowns, moved = np.zeros((linear.active.forces.shape[1], p)), np.zeros((len(x), p))
        errors = list[Float]()
        for _ in range(_MOST):
            force = linear.active.forces @ unknowns + direct
            ends = [
                _End.of(one, x + t * moved[:, k // 2], contact, t * force[:, k // 2].reshape(contact.force.shape))
                for k, (one, t) in enumerate(zip(equations, steps, strict=True))
            ]
            unbalanced = linear.tangent @ moved + internal
            unbalanced[:n] -= slopes([end.nodal_forces for end in ends], steps)
            eliminated = linear.body.condensation.eliminated(-unbalanced)
            relative = slopes([end.relative for end in ends], steps)
            relative[active] += eliminated.displacement[linear.body.reads]
            change = linear.active.correction(relative, unknowns)
            step = eliminated.unknowns(-(linear.active.forces @ change)[active])
            unknowns, moved = unknowns - change, moved + step
            scales = _scale(moved[:n], np.abs(x[:n]).max(), size), _scale(unknowns, largest, size)
            both = zip((step[:n], change), scales, strict=True)
            errors.append(np.max([np.abs(by).max(axis=0, initial=0.0) / scale for by, scale in both], axis=0))
            if _are_converged(errors):
                return [end.side(side, own) for end, side, own in zip(ends, sides, formulations, strict=True)]
        raise Finger3dError(f"at depth {moves[0].end.depth_mm:.4g} mm the derivatives of an increment do not converge")


@dataclass(frozen=True)
class _End:
    """Side at the end of a part of an increment, with forces on nodes (n, d) N, and gap and slip (c, d) mm."""

    equations: IncrementEquations
    now: Configuration
    contact: ContactState
    nodal_forces: Float
    relative: Float

    @classmethod
    def of(cls, equations: IncrementEquations, x: Float, contact: ContactState, force: Float) -> _End:
        """Return the end at unknowns (N,), with contact forces that differ by (c, d) from those of a state."""
        problem = equations.problem
        there = contact_of(problem, problem.surface, displacement(problem.mesh, x), equations.move.end)
        now, state = Configuration(x, np.zeros(0), there), replace(contact, force=contact.force + force)
        relative = equations.relative_displacement(now, state.force)
        return cls(equations, now, state, there.nodal_forces(equations.active(state.force.ravel())), relative)

    def side(self, before: Side, formulation: FiniteStrain) -> Side:
        """Return the side at the end of the part."""
        state = formulation.remembered(self.equations, self.equations.reached(self.now, self.contact))
        return side_after(before, self.equations.move, state, readings_of(before.problem, state))


def _scale(derivatives: Float, value: float, size: Float) -> Float:
    """Return what errors (p,) of derivatives (k, p) are relative to, for a largest value and steps (p,)."""
    scale = np.maximum(np.abs(derivatives).max(axis=0, initial=0.0), _NEGLIGIBLE * value / size)
    return np.where(scale > 0.0, scale, 1.0)


def _are_converged(errors: Sequence[Float]) -> bool:
    """Whether an iteration with these relative errors (p,) ends: they are small, or round-off keeps them from falling.

    Unknowns and directions are corrected in turn, so that errors fall every second time.
    """
    stay = errors[-1] > 0.5 * errors[-3] if len(errors) > 2 else np.zeros(len(errors[-1]), dtype=bool)
    return bool((errors[-1] <= np.where(stay, _ROUND_OFF, _CHANGE)).all())
