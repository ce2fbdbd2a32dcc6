"""Discretisation errors of the body in the numbers of a press, by dual-weighted residuals.

The contact forces of a press act on a linear body, so that its discretisation changes nothing but the Delassus operator
and the rows of the readings.  By Galerkin orthogonality the error of an entry is the energy product of two errors,
``W - W_h = a(e_i, e_j)``, e_i the error of the displacements under the load i.  With the adjoint loads l_k of a number
(`finger3d.accuracy.adjoint`) its error is the sum over the increments of ``-a(e(l_k), e(r_k))``, the residual of the
press weighted with the error of the adjoint (Becker and Rannacher 2001; contact: Schroeder and Rademacher 2011).  The
errors e are those of recovered strains (`finger3d.fem.recovery.patch_recovery`), hence known cell by cell and with
their sign.

Near a point gauge the adjoint is singular, and its recovery poor.  There, the difference between the recovered strain
and the strain itself takes its place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.accuracy.adjoint import adjoint_loads, forces_of, press_goals
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.locate import cells_at
from finger3d.fem.recovery.patch_recovery import PatchRecovery, RecoveredErrors
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Taxel
from finger3d.mechanics.results.history import StepResult

_COMPRESSION = 0.05
"""Singular values of loads, over the largest, below which they are neglected: a few per cent of accuracy suffice."""

_PLACES = 5
"""Places along a gauge at which the error of the strain is taken."""


@dataclass(frozen=True)
class BodyErrors:
    """Errors of numbers that the mesh of the body causes, number minus exact number.

    Attributes
    ----------
    signed : by name, in the unit of the number, unless it is zero by symmetry; of a gauge without the cells around it
    local : by name, for gauges: the error of the strain in the cells that hold the gauge, not signed
    shares : by name, (e,) shares of the cells
    around : by name, for gauges: which cells (e,) hold the gauge or touch those that do
    """

    signed: Mapping[str, float]
    local: Mapping[str, float]
    shares: Mapping[str, Float]
    around: Mapping[str, NDArray[np.bool_]]

    def bar(self, name: str, share: float = 1.0) -> float:
        """Return the magnitude of the error of a number, if its signed part is `share` times its estimate."""
        return float(np.hypot(share * self.signed.get(name, 0.0), self.local.get(name, 0.0)))


def body_errors(problem: Problem, steps: Sequence[StepResult]) -> BodyErrors:
    """Estimate the errors that the mesh of the body leaves in the numbers of the last increment.

    Parameters
    ----------
    problem : with an elastic body in small strain, without inclusions, and a rigid object
    steps : all increments, converged

    Raises
    ------
    numpy.linalg.LinAlgError
        If the active set of an increment is singular.
    """
    goals = press_goals(problem, steps)
    modes, weights = _compressed(forces_of(problem, steps))
    loads = np.einsum("kcg,mk->cgm", adjoint_loads(problem, steps, goals), weights)
    basis, coefficients = _compressed((loads / _sizes(loads)[None, :, None]).reshape(len(loads), -1))
    coefficients = coefficients.reshape(len(coefficients), *loads.shape[1:]) * _sizes(loads)[None, :, None]
    errors = _errors(problem, modes, basis)
    m, q = modes.shape[1], basis.shape[1]
    products = errors.products(slice(0, m), slice(m, None))
    signed, local, shares, around = {}, {}, {}, {}
    for g, goal in enumerate(goals):
        share = -np.einsum("emq,qm->e", products[:, :, :q], coefficients[:, g])
        if goal.row is not None:
            share -= products[:, :, q + goal.row] @ weights[:, -1]
        gauge = next((g for g in problem.model.gauges if goal.column in g.columns(problem.dim)), None)
        if gauge is not None:
            error, near = _at_gauge(problem, gauge, errors, np.append(weights[:, -1], np.zeros(q + _rows(problem))))
            local[goal.name], around[goal.name] = error, near
            share[near] = np.sign(share[near]) * error / max(np.count_nonzero(near), 1)
            signed[goal.name] = float(share[~near].sum())
        else:
            signed[goal.name] = float(share.sum())
        shares[goal.name] = share
    return BodyErrors(signed, local, shares, around)


def _compressed(vectors: Float) -> tuple[Float, Float]:
    """Return a basis (n, m) and coefficients (m, k) of vectors (n, k), without singular values that are small."""
    left, sizes, right = np.linalg.svd(vectors, full_matrices=False)
    kept = max(1, int(np.count_nonzero(sizes > _COMPRESSION * sizes[0])))
    return left[:, :kept], sizes[:kept, None] * right[:kept]


def _sizes(loads: Float) -> Float:
    """Return the Euclidean sizes (g,) of loads (c d, g, m), 1 where they are zero."""
    size: Float = np.sqrt(np.einsum("cgm,cgm->g", loads, loads))
    return np.where(size > 0.0, size, 1.0)


def _rows(problem: Problem) -> int:
    return len(problem.system.reading_rows)


def _errors(problem: Problem, modes: Float, basis: Float) -> RecoveredErrors:
    """Return the errors of the fields under the modes of the forces, the adjoint loads' basis, and the readings."""
    part, active, rows = problem.body, problem.system.active_dofs, _rows(problem)
    forces = np.zeros((len(part.condensed.compliance), modes.shape[1] + basis.shape[1] + rows))
    forces[: len(active), : forces.shape[1] - rows] = np.concatenate([modes, basis], axis=1)[active]
    forces[len(active) + np.arange(rows), forces.shape[1] - rows + np.arange(rows)] = 1.0
    unknowns = part.condensed.unknowns(forces)
    for row, displacement in _base_displacements(problem):
        unknowns[: len(displacement), forces.shape[1] - rows + row] -= displacement
    recovery = PatchRecovery.of(problem.mesh)
    return RecoveredErrors(recovery, part.elastic, part.stiffness, part.thickness, unknowns)


def _base_displacements(problem: Problem) -> list[tuple[int, Float]]:
    """Return row number and displacements (n d,) of the base in the adjoint of every taxel, a reading of reactions."""
    found, row = [], 0
    for reading in problem.model.readings:
        if isinstance(reading, Taxel):
            found.append((row, reading.base_displacement(problem.meshed_body)))
        row += len(reading.columns(problem.dim))
    return found


def _at_gauge(problem: Problem, gauge: Gauge, errors: RecoveredErrors, field: Float) -> tuple[float, NDArray[np.bool_]]:
    """Return the error of the strain at a gauge, and which cells (e,) hold it or touch those that do.

    It is the mean over the gauge, or the root mean square in the cells that hold it if that is larger, since the error
    at one place may vanish by chance.
    """
    mesh = problem.mesh
    start, end = gauge.ends
    inside: list[Int] = []
    means = []
    bary, _ = quadrature(mesh.dim, 4)
    direction = np.zeros(mesh.dim)
    for share in np.linspace(0.0, 1.0, 1 if gauge.is_point else _PLACES):
        place, along = problem.symmetry.reflect(start + share * (end - start), gauge.direction)
        direction = along
        for cell, at in cells_at(mesh, place):
            means.append(float(errors.strain_along(field, along, np.array([cell]), at[None])[0, 0]))
            inside.append(np.array([cell]))
    cells = np.unique(np.concatenate(inside))
    square = errors.strain_along(field, direction, cells, bary) ** 2
    near = np.asarray(np.isin(mesh.cells[:, : mesh.dim + 1], mesh.cells[cells, : mesh.dim + 1]).any(axis=1))
    return max(abs(float(np.mean(means))), float(np.sqrt(square.mean()))), near
