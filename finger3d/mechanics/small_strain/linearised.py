"""Equations of the active set of one increment, linearised about its solution, for its derivatives and its adjoint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from finger3d._types import Float
from finger3d.contact.acceleration import assemble_in_place
from finger3d.contact.conditions import ContactProblem, augmentation_parameters
from finger3d.contact.friction import OPEN, SLIP
from finger3d.contact.newton import ActiveSet
from finger3d.contact.state import ContactState
from finger3d.fem.tensors import block_diagonal, rotated_delassus
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.linear_contact import transported
from finger3d.objects import Move, vertical_frame


@dataclass(frozen=True)
class LinearisedIncrement:
    """Equations of the active set of one increment, in the directions of an upright object (c d contact directions).

    Attributes
    ----------
    forces : (c d, k) sparse, P
    weights : (k, c d) sparse, D
    diagonal : (k,), E
    matrix : (k, k), A
    """

    forces: Any
    weights: Any
    diagonal: Float
    matrix: Float

    @classmethod
    def of(
        cls, problem: Problem, before: ContactState, after: ContactState, own: Float | None = None
    ) -> LinearisedIncrement:
        """Linearise the increment between two states; `own` is a Delassus operator in the directions of the points.

        The equations are then in these directions.
        """
        c, d = after.force.shape
        rotations = after.own_bases @ vertical_frame(d).T if own is None else np.broadcast_to(np.eye(d), (c, d, d))
        turn = block_diagonal(rotations)
        rho = augmentation_parameters(problem.delassus.reshape(c * d, c * d), d)
        slip = after.tangential_displacement - transported(before, after.own_bases).tangential_displacement
        normal, friction = after.force[:, 0], np.linalg.norm(after.force[:, 1:], axis=1)
        slips = after.status == SLIP
        mu = np.divide(friction, normal, out=np.zeros(c), where=slips & (normal > 0.0))
        moved = np.concatenate([after.gap[:, None], slip], axis=1)
        augmented = after.force - rho * np.where(slips[:, None], moved, 0.0)
        if (rotations == np.eye(d)).all():
            points, delassus = np.arange(c), problem.delassus if own is None else own
        else:
            points = np.flatnonzero(after.status != OPEN)
            delassus = rotated_delassus(problem.delassus, rotations[points], points)
        k = len(points)
        local = ContactProblem(
            previous=before.of_points(points),
            free_motion=moved[points],
            delassus=delassus.reshape(k * d, k * d),
            law=problem.model.contact_law,
            length_scale=1.0,
            friction=mu[points],
            augmentation=rho[points],
        )
        active = ActiveSet.of(local, after.status[points], augmented[points])
        matrix = cast("Float", assemble_in_place(local, active, np.float64))
        turned = turn[(points[:, None] * d + np.arange(d)).ravel()]
        diagonal = np.diagonal(active.with_turning(np.zeros((active.size, active.size))))
        return cls(turned.T @ active.force_matrix(), active.weight_matrix(rho[points]) @ turned, diagonal, matrix)

    @cached_property
    def _factor(self) -> Any:
        return lu_factor(self.matrix, check_finite=False)

    def correction(self, displacement: Float, unknowns: Float) -> Float:
        """Return A^-1 (D w + E x) (k, p), for relative displacements w (c d, p) and unknowns x (k, p)."""
        if not len(unknowns):
            return unknowns
        right = self.weights @ displacement + self.diagonal[:, None] * unknowns
        return np.asarray(lu_solve(self._factor, right))

    def adjoint(self, gradient: Float) -> Float:
        """Return z (c d, g), D^T A^-T P^T times gradients (c d, g)."""
        if not self.weights.shape[0]:
            return np.zeros_like(gradient)
        return np.asarray(self.weights.T @ lu_solve(self._factor, self.forces.T @ gradient, trans=1))


def upright(state: ContactState, local: Float) -> Float:
    """Return vectors (c, d) in the directions of an upright object."""
    d = local.shape[1]
    return np.asarray(np.einsum("ca,cak->ck", local, state.own_bases) @ vertical_frame(d).T)


@dataclass(frozen=True)
class Part:
    """Part of an increment, linearised, with its motion, between two shares of that of the increment."""

    before: State[Any]
    after: State[Any]
    linear: Any
    move: Move
    start: float
    end: float


@dataclass(frozen=True)
class Linear:
    """Equations of the active set of an increment in small strain, and the compliance (c, d, c, d) mm/N within it."""

    active: LinearisedIncrement
    delassus: Float


def slopes(values: Sequence[Float] | Float, steps: Float) -> Float:
    """Return the derivatives (k, p) of values (2 p, ...) below and above parameters, by their steps (2 p,)."""
    array = np.reshape(values, (len(steps), -1))
    return np.asarray((array[1::2] - array[::2]).T / (2.0 * steps[1::2]))
