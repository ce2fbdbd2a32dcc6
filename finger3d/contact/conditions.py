"""Frictional contact conditions of one load increment.

Find contact forces r (c, d) such that the relative displacements ``w = W r + q`` satisfy Signorini's condition and the
friction law at every contact point.  W is the Delassus operator, the compliance of the body seen at its contact
points, and q the free motion.  Components are local, normal first::

    w_n >= 0,  r_n >= 0,  w_n r_n = 0                    Signorini; Maeno 2004, Eqs. (1), (2)
    stick:  w_t = 0,                    |r_t| <= mu r_n  Maeno 2004, Eq. (3)
    slip:   w_t = -s r_t with s >= 0,   |r_t|  = mu r_n  Maeno 2004, Eq. (4), and friction opposes slip

Equivalently r = P(r - rho w), where P projects on the friction cone and rho > 0 is arbitrary (Alart and Curnier 1991).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, STICK, FrictionLaw
from finger3d.contact.state import ContactState, pressure
from finger3d.errors import Outcome

TOLERANCE = 1e-8
"""Largest residual of an increment that is called converged."""


@dataclass(frozen=True)
class ContactProblem:
    """One increment of frictional contact, in local coordinates.

    Attributes
    ----------
    previous : ContactState
        State at the beginning of the increment.
    free_motion : (c, d) array, mm
        Gap and increment of tangential displacement that the points would have without contact forces.
    delassus : (c d, c d) array, mm/N
        Relative displacement per contact force.
    law : FrictionLaw
    length_scale : float, mm
        Length by which violated gaps and slips are divided in the residual: the press depth.
    friction : (c,) array
        Friction coefficient of every point; solvers replace it until it agrees with the law.
    augmentation : (c, d) array, N/mm
        Parameters rho of the projection.  They change the convergence, not the solution.
    area : (c,) array, mm2, optional
        Tributary areas of the points; only laws that depend on the pressure need them.
    is_definite : bool
        Whether the Delassus operator must be positive definite.  At finite strain it need not be: a body under contact
        forces may be stable by the contact alone.
    """

    previous: ContactState
    free_motion: Float
    delassus: Float
    law: FrictionLaw
    length_scale: float
    friction: Float
    augmentation: Float
    area: Float | None = None
    is_definite: bool = True

    @classmethod
    def of(
        cls,
        previous: ContactState,
        free_displacement: Float,
        delassus: Float,
        law: FrictionLaw,
        length_scale: float,
        area: Float | None = None,
    ) -> ContactProblem:
        """Return the increment from a state.

        Parameters
        ----------
        free_displacement : (c, d) array, mm
            Gap and tangential displacement relative to the object that the points would have without contact forces.
        delassus : (c, d, c, d) array, mm/N, positive definite
        """
        motion = free_displacement.copy()
        motion[:, 1:] -= previous.tangential_displacement
        matrix = delassus.reshape(motion.size, motion.size)
        return cls(
            previous=previous,
            free_motion=motion,
            delassus=matrix,
            law=law,
            length_scale=length_scale,
            friction=law.coefficients(previous.status, pressure(previous.force, area)),
            augmentation=augmentation_parameters(matrix, motion.shape[1]),
            area=area,
        )

    @property
    def refusal(self) -> Outcome | None:
        """Why the increment cannot be solved: NaN, or a definite operator without a positive diagonal; else None."""
        if not (np.isfinite(self.free_motion).all() and np.isfinite(self.delassus).all()):
            return Outcome.NOT_FINITE
        if self.is_definite and np.diagonal(self.delassus).min(initial=np.inf) <= 0.0:
            return Outcome.INDEFINITE
        return None

    def relative_displacement(self, force: Float) -> Float:
        """Return w = W r + q (c, d), mm, for forces (c, d), N."""
        return self.free_motion + (self.delassus @ force.ravel()).reshape(force.shape)

    def gap(self, force: Float) -> Float:
        """Return the normal component (c,) of `relative_displacement`, mm."""
        return self.free_motion[:, 0] + self.delassus[:: force.shape[1]] @ force.ravel()


def lengths(vectors: Float) -> Float:
    """Return the Euclidean lengths (c,) of vectors (c, k)."""
    return np.abs(vectors[:, 0]) if vectors.shape[1] == 1 else np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def augmentation_parameters(delassus: Float, dim: int) -> Float:
    """Return rho (c, d), N/mm, the reciprocal diagonal of the Delassus operator (c d, c d).

    The tangential directions of a point share the smaller value, so that the projection is isotropic.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # such an operator is refused
        rho = 1.0 / np.diagonal(delassus).reshape(-1, dim)
    rho = rho.copy()
    rho[:, 1:] = rho[:, 1:].min(axis=1, keepdims=True, initial=np.inf)
    return rho


def project_on_friction_cone(
    problem: ContactProblem, force: Float, displacement: Float
) -> tuple[Float, NDArray[np.int8], Float]:
    """Project the augmented force r - rho w on the friction disc of its own normal force.

    Returns
    -------
    projected : (c, d) array, N
    status : (c,) array
        OPEN, STICK or SLIP, by the part of the cone that the augmented force lies in.
    augmented_force : (c, d) array, N
        With negative normal forces set to zero, before the tangential force is reduced to mu r_n.
    """
    augmented = force - problem.augmentation * displacement
    augmented[:, 0] = np.maximum(augmented[:, 0], 0.0)
    normal = augmented[:, 0]
    length = lengths(augmented[:, 1:])
    limit = problem.friction * normal
    slips = (length > limit) | (problem.friction == 0.0)
    radial = np.where(slips, limit / np.where(length > 0.0, length, 1.0), 1.0)
    projected = augmented.copy()
    projected[:, 1:] *= radial[:, None]
    status = np.where(normal <= 0.0, OPEN, np.where(slips, SLIP, STICK)).astype(np.int8)
    return projected, status, augmented


def residual(force: Float, displacement: Float, status: NDArray[np.int8], mu: Float, length_scale: float) -> float:
    """Return the largest violation of the conditions, dimensionless; zero at a solution.

    Lengths are divided by `length_scale`, forces by the largest nodal force.

    Parameters
    ----------
    force, displacement : (c, d) arrays, N and mm
    status : (c,) array
    mu : (c,) array
    length_scale : float, mm
    """
    if not len(force):
        return 0.0
    if not np.isfinite(force).all():
        return float("inf")
    force_scale = float(lengths(force).max()) or 1.0
    normal, friction = force[:, 0], force[:, 1:]
    gap, slip = displacement[:, 0], displacement[:, 1:]
    length = lengths(friction)
    opened, stuck, slips = status == OPEN, status == STICK, status == SLIP
    direction = friction / np.where(length > 0.0, length, 1.0)[:, None]
    opposing = np.maximum(-np.sum(slip * direction, axis=1), 0.0)
    not_opposing = lengths(slip + opposing[:, None] * direction)
    violated_lengths = [
        np.where(opened, np.maximum(-gap, 0.0), np.abs(gap)),
        np.where(stuck, lengths(slip), 0.0),
        np.where(slips & (length > 0.0), not_opposing, 0.0),
    ]
    violated_forces = [
        np.where(opened, np.abs(normal) + length, np.maximum(-normal, 0.0)),
        np.where(stuck, np.maximum(length - mu * normal, 0.0), 0.0),
        np.where(slips, np.abs(length - mu * normal), 0.0),
    ]
    return float(max(np.max(violated_lengths) / length_scale, np.max(violated_forces) / force_scale))
