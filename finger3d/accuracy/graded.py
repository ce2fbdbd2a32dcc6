"""Edge lengths of a mesh graded towards one number, from the shares of the cells in its error.

A cell of edge length h has the share s of the error.  It falls as h^p, and the number of cells grows as h^-d, so that
the fewest cells for a given error have equal shares: the wanted length is ``h (C / s)^(1 / (p + d))``, with C from the
error that is allowed (Becker and Rannacher 2001).  The edge length at the contact follows from the error of the
contact discretisation alone.

The strain at a gauge has two errors more: that of the cells which hold the gauge, and that of the contact close to it.
Both call for short edges around the gauge only, hence for `mesh.gauge_refinement`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.accuracy.adjoint_bars import AdjointBars
from finger3d.fem.mesh.simplex import Mesh, signed_volumes
from finger3d.mechanics.discretise.gauge_refinement import edge_lengths_at_gauges
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.refinement.grading import Grading
from finger3d.meshing.structured.grid import STRUCTURED_GROWTH

_POWER = 3.0
"""Order p of a share: 4 where the solution is smooth, 2 lambda = 1.2 at the bonded corners."""

_BODY_SHARE = 0.85
"""Error of the body over the whole error that is allowed; errors add as squares, which leaves half for the contact."""

_LOCAL_SHARE = 0.6
"""Allowed error of the cells around a gauge, and likewise of all others, over the allowed error of its strain; errors
add as squares."""

_LOCAL_ORDER = 2.0
"""Order of the strain in the cells around a gauge, away from its singularities."""

_LARGEST_REFINEMENT = 8.0
"""Largest edge length at the contact over that around a gauge."""

_FACTORS = (0.5, 2.0)
"""Least and largest change of an edge length in one round."""

_CELLS_PER_CUBE = {2: 2.3, 3: 10.0}
"""Cells over (edge length)^d in a square or cube, by dimension."""

_FEWEST_POINTS = 8
"""Contact points that the half-length of contact keeps."""


def graded_sizes(problem: Problem, bars: AdjointBars, goal: str, allowed: float) -> MeshOptions:
    """Return the options of a mesh that is expected to give a number with an allowed error.

    Parameters
    ----------
    goal : name of the number
    allowed : its error, in its own unit
    """
    if goal in bars.body.local:
        return _for_gauge(problem, bars, goal, allowed)
    body, contact = bars.parts[goal]
    wanted = _BODY_SHARE * allowed / body if body > 0.0 else math.inf
    grading = _grading(problem, np.abs(bars.body.shares[goal]), wanted)
    factor = _contact_factor(bars, goal, math.sqrt(1.0 - _BODY_SHARE**2) * allowed, contact)
    return _options(problem, bars, grading, factor)


def finest(options: Sequence[MeshOptions]) -> MeshOptions:
    """Return the options of a mesh that is everywhere as fine as the finest of several."""
    if len(options) == 1:
        return replace(options[0], borders=None)
    gradings = [one.grading for one in options if one.grading]
    points, sizes = ([getattr(grading, name) for grading in gradings] for name in ("points", "sizes"))
    gauges = [one for one in options if one.gauge_refinement > 1.0]
    size = min(one.size_mm for one in options)
    return replace(
        options[0],
        size_mm=size,
        base_size_mm=max(size, min(one.base_size_mm for one in options)),
        grading=Grading(np.vstack(points), np.concatenate(sizes)) if gradings else None,
        gauge_refinement=max(one.gauge_refinement * size / one.size_mm for one in options) if gauges else 1.0,
        refined_gauges=() if any(not one.refined_gauges for one in gauges) else _union(gauges),
        stick_refinement=max(1.0, *(one.stick_refinement * size / one.size_mm for one in options)),
        borders=None,
    )


def _union(options: Sequence[MeshOptions]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for one in options for name in one.refined_gauges))


def _for_gauge(problem: Problem, bars: AdjointBars, goal: str, allowed: float) -> MeshOptions:
    """Return the mesh for a gauge: graded away from it, and refined around it.

    Most of the contact's error comes from the points close to the gauge.  The edges of the whole contact face hence
    become shorter only where `gauge_refinement` would exceed `_LARGEST_REFINEMENT`.  Those around the gauge never
    become longer.
    """
    options, shares, own = problem.model.mesh, bars.body.shares[goal], bars.body.around[goal]
    around = own
    if options.gauge_refinement > 1.0:
        size = edge_lengths_at_gauges(problem.model, problem.mesh, problem.axes)
        around = own | (size(_centroids(problem)) < options.size_mm)
    if around.all():  # gauges everywhere
        around = np.zeros_like(own)
    local = math.hypot(bars.body.local[goal], shares[around & ~own].sum())
    far = bars.body_share(goal, problem.dim) * abs(float(shares[~around].sum()))
    wanted = _LOCAL_SHARE * allowed / far if far > 0.0 else math.inf
    grading = _grading(problem, np.where(around, 0.0, np.abs(shares)), wanted, ~around)
    left = math.sqrt(1.0 - 2.0 * _LOCAL_SHARE**2) * allowed
    contact = _contact_factor(bars, goal, left, bars.parts[goal][1])
    nearby = _factor(_LOCAL_SHARE * allowed, local, _LOCAL_ORDER)
    shortest = min(1.0, contact, nearby) * options.size_mm / options.gauge_refinement
    largest = max(_LARGEST_REFINEMENT, options.gauge_refinement)
    graded = _options(problem, bars, grading, min(1.0, largest * shortest / options.size_mm))
    names = options.refined_gauges
    if options.gauge_refinement == 1.0:
        names = tuple(column.sensor for column in problem.model.columns if column.key == goal)
    return replace(graded, gauge_refinement=max(1.0, graded.size_mm / shortest), refined_gauges=names)


def _grading(problem: Problem, share: Float, wanted: float, chosen: NDArray[np.bool_] | slice = slice(None)) -> Grading:
    """Return the lengths in the chosen cells that multiply the sum of the shares (e,) by `wanted`."""
    mesh = problem.mesh
    factors = _factors(_smoothed(mesh, share)[chosen], wanted, mesh.dim)
    points = np.zeros((len(factors), 3))
    points[:, : mesh.dim] = np.abs(_centroids(problem)[chosen])
    return Grading(points, np.minimum(factors * _edge_lengths(mesh)[chosen], _largest(problem)))


def _options(problem: Problem, bars: AdjointBars, grading: Grading, contact_factor: float) -> MeshOptions:
    """Return the options of a graded mesh whose edges at the contact change by a factor."""
    options = problem.model.mesh
    at_contact = min(options.size_mm * contact_factor, _largest(problem), bars.contact_half_length_mm / _FEWEST_POINTS)
    if problem.dim == 3:
        at_contact = min(at_contact, 0.25 * problem.model.design.width_mm)
    at_contact = max(at_contact, _FACTORS[0] * options.size_mm)
    base = max(at_contact, float(grading.sizes.max()))
    return replace(options, size_mm=at_contact, base_size_mm=base, grading=grading)


def _largest(problem: Problem) -> float:
    """Return the longest edge, mm: half of the body."""
    design = problem.model.design
    return 0.5 * min(design.height_mm, 2.0 * design.half_length_mm)


def cell_growth(problem: Problem, options: MeshOptions) -> float:
    """Return the estimated number of cells of a graded mesh, over that of the present mesh."""
    assert options.grading is not None
    places, model = _centroids(problem), replace(problem.model, mesh=options)
    wanted = options.grading.at(places, STRUCTURED_GROWTH)
    if options.gauge_refinement > 1.0:
        wanted = np.minimum(wanted, edge_lengths_at_gauges(model, problem.mesh, problem.axes)(places))
    return float(np.mean((_edge_lengths(problem.mesh) / wanted) ** problem.dim))


def _centroids(problem: Problem) -> Float:
    """Return the centroids (e, d) mm of the cells."""
    mesh = problem.mesh
    return np.asarray(mesh.points[mesh.cells[:, : mesh.dim + 1]].mean(axis=1))


def _edge_lengths(mesh: Mesh) -> Float:
    """Return the edge lengths (e,) mm of a mesh's cells, from their volumes."""
    return np.asarray((_CELLS_PER_CUBE[mesh.dim] * signed_volumes(mesh)) ** (1.0 / mesh.dim))


def _contact_factor(bars: AdjointBars, goal: str, allowed: float, contact: float) -> float:
    """Return the factor of the edge length at the contact for an allowed error of the contact."""
    return _factor(allowed, contact, bars.contact_order(goal))


def _factor(allowed: float, error: float, order: float) -> float:
    """Return the factor of an edge length, within its bounds, for an allowed error of a given order."""
    return float(np.clip((allowed / error) ** (1.0 / order), *_FACTORS)) if error > 0.0 else _FACTORS[1]


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
