"""Shorter edges where the border of stick crosses the contact face, found by presses on coarser meshes.

What limits the area of stick in a solid is the distance of the contact points at its border, not the cells of the body.
The cells that the border crosses are bisected, once for every factor of two of `mesh.stick_refinement`, each time from
the press on the mesh before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import SLIP, STICK
from finger3d.fem.mesh.simplex import axis_numbers
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import with_few_increments
from finger3d.mechanics.model import Model
from finger3d.meshing.refinement.grading import SizedPlaces
from finger3d.progress import QUIET, Progress

MOST_STICK_REFINEMENT = 16.0
"""Largest `mesh.stick_refinement`."""

_REACH = 0.6
"""Distance from the border up to which edges are shortest, over the length of the edges that it crosses."""

_RATE = 1.0
"""Growth of the edge length per distance beyond."""


def with_refined_borders(model: Model, report: Progress = QUIET) -> Problem:
    """Return the body on a mesh with edges of ``mesh.size_mm / mesh.stick_refinement`` at the border of stick.

    The coarser meshes that find the border have no shorter edges around gauges.  If nothing slips on one of them, or if
    its press does not converge, the mesh stays as coarse at the contact.

    Raises
    ------
    Finger3dError
        If the refined mesh is estimated to need too much memory.
    """
    options, factor, borders = model.mesh, 1.0, None
    while factor < options.stick_refinement:
        coarse = build(replace(model, mesh=replace(options, gauge_refinement=1.0, borders=borders)), report)
        short = with_few_increments(coarse)
        steps = list(march(short))
        places = stick_borders(short, _ends_of_legs(short, steps)) if steps[-1].outcome.ok else np.zeros((0, 3))
        if not len(places) and options.gauge_refinement == 1.0:
            return coarse
        if not len(places):
            break
        edge = options.size_mm / factor
        factor = min(2.0 * factor, options.stick_refinement)
        report.say(f"border of stick: edges of {options.size_mm / factor:.3g} mm")
        borders = SizedPlaces(places, options.size_mm / factor, _RATE, _REACH * edge)
    return build(replace(model, mesh=replace(options, borders=borders)), report)


def _ends_of_legs(problem: Problem, steps: Sequence[StepResult]) -> list[StepResult]:
    """Return the last increments of the legs, between which the border moves."""
    counts = [leg.steps if isinstance(leg.steps, int) else 1 for leg in problem.model.legs]
    return [steps[end - 1] for end in np.cumsum(counts) if end <= len(steps)]


def stick_borders(problem: Problem, steps: Sequence[StepResult]) -> Float:
    """Return the middles (k, d) mm of edges between points that stick and slip, mirrored into the meshed part."""
    points, middles = problem.points, [np.zeros((0, 3))]
    for step in steps:
        ends = step.state.status[points.edges]
        border = (ends == STICK).any(axis=1) & (ends == SLIP).any(axis=1)
        middles.append(points.points[points.edges[border]].mean(axis=1))
    places = np.vstack(middles)
    for axis in axis_numbers(problem.axes):
        places[:, axis] = np.abs(places[:, axis])
    return np.unique(np.round(places[:, : problem.dim], 9), axis=0)
