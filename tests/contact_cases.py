"""Contact problems without a mesh: random ones, and the elastic half-plane by its closed form."""

from __future__ import annotations

import numpy as np

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.state import ContactState


def random_compliance(rng: np.random.Generator, points: int, dim: int, softness: float = 0.05) -> np.ndarray:
    """Symmetric positive compliance (c, d, c, d) with strong coupling between normal and tangential motion."""
    a = rng.normal(size=(points * dim, points * dim))
    c = a @ a.T / (points * dim) + softness * np.eye(points * dim)
    return c.reshape(points, dim, points, dim)


def half_plane(points: int, dim: int, beta: float, spacing: float = 0.1) -> np.ndarray:
    """Compliance (c, d, c, d) of points on a line: log kernels, and beta times a sign kernel that couples n and x."""
    x = spacing * np.arange(points)
    r = np.abs(x[:, None] - x) + 0.3 * spacing * np.eye(points)
    normal = -np.log(r / (40.0 * spacing * points)) / np.pi
    sign = 0.5 * beta * np.sign(x[:, None] - x)
    out = np.zeros((points, dim, points, dim))
    for i in range(dim):
        out[:, i, :, i] = normal
    out[:, 1, :, 0], out[:, 0, :, 1] = sign, -sign
    return out


def violation(
    before: ContactState, after: ContactState, free: np.ndarray, compliance: np.ndarray, mu: float | np.ndarray
) -> float:
    """Largest violation of Eqs. (1)-(4) and of friction opposing slip, written out point by point.

    Independent of finger3d.contact.conditions; gaps in units of 1, forces in units of the largest.
    """
    moved = free + np.einsum("idjk,jk->id", compliance, after.force)
    scale = max(np.abs(after.force).max(), 1e-300)
    worst = max(
        np.abs(moved[:, 0] - after.gap).max(), np.abs(moved[:, 1:] - after.tangential_displacement).max(initial=0.0)
    )
    coefficient = np.broadcast_to(mu, len(after.status))
    for i, status in enumerate(after.status):
        mu = float(coefficient[i])
        n, t = after.force[i, 0], after.force[i, 1:]
        slip = moved[i, 1:] - before.tangential_displacement[i]
        if status == OPEN:  # Eq. 1
            worst = max(worst, -moved[i, 0], np.abs(after.force[i]).max() / scale)
            continue
        worst = max(worst, abs(moved[i, 0]), -n / scale)  # Eq. 2
        if status == STICK:  # Eq. 3
            worst = max(worst, np.abs(slip).max(), (np.linalg.norm(t) - mu * n) / scale)
        if status == SLIP:  # Eq. 4
            worst = max(worst, abs(np.linalg.norm(t) - mu * n) / scale)
            if np.linalg.norm(t) > 0:
                e = t / np.linalg.norm(t)
                worst = max(worst, slip @ e, np.linalg.norm(slip - (slip @ e) * e))
    return float(worst)


def half_space(x: np.ndarray, z: np.ndarray, spacing: float, nu: float, modulus: float = 1.0) -> np.ndarray:
    """Compliance (c, 3, c, 3) of points on an elastic half-space: Boussinesq's and Cerruti's kernels (Johnson, 3.2).

    A point's own entry is that of a disc of the point's area under uniform traction, at its centre.
    """
    dx, dz = x[:, None] - x, z[:, None] - z
    r = np.hypot(dx, dz)
    own = np.eye(len(x), dtype=bool)
    r[own] = 1.0
    a = spacing / np.sqrt(np.pi)
    shear = modulus / (2.0 * (1.0 + nu))
    k = 1.0 / (2.0 * np.pi * shear)
    out = np.empty((len(x), 3, len(x), 3))
    out[:, 0, :, 0] = np.where(own, k * (1 - nu) * 2.0 / a, k * (1 - nu) / r)
    for i, di in ((1, dx), (2, dz)):
        out[:, i, :, i] = np.where(own, k * (2.0 - nu) / a, k * ((1 - nu) / r + nu * di**2 / r**3))
        # gap and normal force point along the inward normal, so the coupling enters with this sign
        out[:, i, :, 0] = np.where(own, 0.0, -k * 0.5 * (1 - 2 * nu) * di / r**2)
        out[:, 0, :, i] = -out[:, i, :, 0]
    out[:, 1, :, 2] = out[:, 2, :, 1] = np.where(own, 0.0, k * nu * dx * dz / r**3)
    return out


def problem_of(
    compliance: np.ndarray, free: np.ndarray, mu: float, scale: float = 1.0, state: ContactState | None = None
) -> ContactProblem:
    """Problem of points under Coulomb's friction, which touch without force at first unless a state is given."""
    before = ContactState.at_rest(np.zeros(len(free)), free.shape[1]) if state is None else state
    return ContactProblem.of(before, free, compliance, Coulomb(mu), scale)


def random_problem(dim: int, seed: int = 0, points: int = 7) -> tuple[ContactProblem, np.ndarray]:
    """Contact problem of a random symmetric positive definite operator, and random forces (c, d)."""
    rng = np.random.default_rng(seed)
    delassus = random_compliance(rng, points, dim, 1.0).reshape(points * dim, points * dim)
    free, force = rng.normal(size=(points, dim)), rng.normal(size=(points, dim))
    return problem_of(delassus, free, 0.5), force
