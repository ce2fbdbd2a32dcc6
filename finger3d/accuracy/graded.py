"""Edge lengths of a mesh graded towards one number, from the shares of the cells in its error.

A cell of edge length h has the share s of the error.  It falls as h^p, and the number of cells grows as h^-d, so that
the fewest cells for a given error have equal shares: the wanted length is ``h (C / s)^(1 / (p + d))``, with C from the
error that is allowed (Becker and Rannacher 2001).  The edge length at the contact follows from the error of the
contact discretisation alone.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.accuracy.adjoint_bars import AdjointBars
from finger3d.fem.simplex import Mesh, signed_volumes
from finger3d.mechanics.model import MeshOptions
from finger3d.mechanics.problem import Problem
from finger3d.meshing.grading import Grading

_POWER = 3.0
"""Order p of a share: 4 where the solution is smooth, 2 lambda = 1.2 at the bonded corners."""

_BODY_SHARE = 0.85
"""Error of the body over the whole error that is allowed; errors add as squares, which leaves half for the contact."""

_FACTORS = (0.5, 2.0)
"""Least and largest change of an edge length in one round."""

_CELLS_PER_CUBE = {2: 2.3, 3: 10.0}
"""Cells over (edge length)^d in a square or cube, by dimension."""

_FEWEST_POINTS = 8
"""Contact points that the half-length of contact keeps."""


def graded_sizes(problem: Problem, bars: AdjointBars, goal: str, allowed: float) -> MeshOptions:
    """Return the mesh that is expected to leave an error in a number.

    Parameters
    ----------
    goal : name of the number
    allowed : its error, in its own unit
    """
    body, contact = bars.parts[goal]
    mesh, options = problem.mesh, problem.model.mesh
    length = _edge_lengths(mesh)
    share = _smoothed(mesh, np.abs(bars.body.shares[goal]))
    factors = _factors(share, _BODY_SHARE * allowed / body if body > 0.0 else math.inf, mesh.dim)
    largest = 0.5 * min(problem.model.design.height_mm, 2.0 * problem.model.design.half_length_mm)
    sizes = np.minimum(factors * length, largest)
    corners = mesh.points[mesh.cells[:, : mesh.dim + 1]].mean(axis=1)
    points = np.zeros((len(corners), 3))
    points[:, : mesh.dim] = np.abs(corners)
    at_contact = options.size_mm * _contact_factor(bars, goal, math.sqrt(1.0 - _BODY_SHARE**2) * allowed, contact)
    at_contact = min(at_contact, largest, bars.contact_half_length_mm / _FEWEST_POINTS)
    if mesh.dim == 3:
        at_contact = min(at_contact, 0.25 * problem.model.design.width_mm)
    at_contact = max(at_contact, _FACTORS[0] * options.size_mm)
    base = max(at_contact, float(sizes.max()))
    return replace(options, size_mm=at_contact, base_size_mm=base, grading=Grading(points, sizes))


def cell_growth(problem: Problem, options: MeshOptions) -> float:
    """Return the number of cells that the grading of options asks for, over that of the mesh that it was made from."""
    assert options.grading is not None
    return float(np.mean((_edge_lengths(problem.mesh) / options.grading.sizes) ** problem.dim))


def _edge_lengths(mesh: Mesh) -> Float:
    """Return the edge lengths (e,) mm that cells of the volumes of a mesh's cells have."""
    return np.asarray((_CELLS_PER_CUBE[mesh.dim] * signed_volumes(mesh)) ** (1.0 / mesh.dim))


def _contact_factor(bars: AdjointBars, goal: str, allowed: float, contact: float) -> float:
    """Return the change of the edge length at the contact that leaves an allowed error of the contact."""
    if contact <= 0.0:
        return _FACTORS[1]
    return float(np.clip((allowed / contact) ** (1.0 / bars.contact_order(goal)), *_FACTORS))


def _factors(share: Float, wanted: float, dim: int) -> Float:
    """Return the changes (e,) of edge lengths that multiply the sum of the shares by `wanted`, with equal shares."""
    share = np.maximum(share, 1e-12 * share.max(initial=1e-300))

    def changes(level: float) -> Float:
        return np.asarray(np.clip((level / share) ** (1.0 / (_POWER + dim)), *_FACTORS))

    def left(level: float) -> float:
        return float((share * changes(level) ** _POWER).sum() / share.sum())

    low, high = 1e-9 * share.min(), 1e9 * share.max()
    if left(high) <= wanted:
        return changes(high)
    if left(low) >= wanted:
        return changes(low)
    for _ in range(100):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if left(middle) < wanted else (low, middle)
    return changes(low)


def _smoothed(mesh: Mesh, share: Float) -> Float:
    """Return the mean (e,) of the shares around the vertices of each cell, since signs change from cell to cell."""
    corners = mesh.cells[:, : mesh.dim + 1]
    at = sp.csr_array(
        (np.ones(corners.size), (corners.ravel(), np.repeat(np.arange(len(corners)), corners.shape[1]))),
        shape=(len(mesh.points), len(corners)),
    )
    count = np.maximum(np.diff(at.indptr), 1)
    mean = (at @ share) / count
    return np.asarray(mean[corners].mean(axis=1))
