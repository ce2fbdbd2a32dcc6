"""Cells that large deformation distorts most: the probable cause of an increment that failed, and folded nodes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import chain

import numpy as np

from finger3d._types import Float
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.contact.state import SNAPPED
from finger3d.fem.mesh.quality import most_distorted
from finger3d.fem.mesh.simplex import FREE_FACES, Mesh
from finger3d.fem.recovery.recover import displacement
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.resolution import unresolved_details
from finger3d.mechanics.results.history import StepResult

_DISTORTED = 0.7
"""Ratio of volumes below which the most distorted cell is named."""

_NEAR = 2.0
"""Distance, in lengths of the cell, at which a cell is beside a sharp edge of the finger."""


def cause_of_failure(problem: Problem, u: Float) -> str:
    """Return the probable cause and its cure in one line; empty if there is none to name.

    It is a length of the object that the contact points do not resolve, else a rule of contact without a solution, else
    the cell that is distorted most.

    Parameters
    ----------
    u : (n, d) mm, displacement of the nodes at the last converged state
    """
    if details := unresolved_details(problem.model):
        return details[0]
    if problem.model.rule in STEP_DEPENDENT_RULES:
        return "the paper's rule of contact may have no answer here; use [contact] rule = 'projection'"
    mesh = problem.mesh
    cell, ratio = most_distorted(mesh, u)
    if ratio > _DISTORTED:
        return ""
    corners = mesh.points[mesh.cells[cell, : mesh.dim + 1]]
    place = corners.mean(axis=0)
    state = f"compressed to {ratio:.2g} of its volume" if ratio > 0.0 else "folded over at a node"
    line = f"the cell at {_text(place)} mm is {state} in the increment before"
    length = float(np.ptp(corners, axis=0).max())
    edges = mesh.points[_sharp_edges(mesh)]
    if len(edges) and float(np.linalg.norm(edges - place, axis=1).min()) < _NEAR * length:
        line += f"; it is at a sharp edge of the finger, which a fillet of {length:.2g} mm or more would round"
    return line


def fold_warnings(problem: Problem, steps: Sequence[StepResult]) -> list[str]:
    """Return a warning about the cell that is folded most at a node after any of the converged steps of a press.

    The strain at a bonded or sharp edge grows without limit, so that the displacement of a fine mesh folds over there
    while its quadrature points, on which equilibrium depends, are sound.
    """
    mesh, worst = problem.mesh, (0.0, 0, 0)
    for number, step in enumerate(steps if problem.model.finite_strain else (), 1):
        cell, ratio = most_distorted(mesh, displacement(mesh, step.meshed_state.body.unknowns))
        worst = min(worst, (ratio, cell, number))
    ratio, cell, number = worst
    if ratio == 0.0:
        return []
    place = mesh.points[mesh.cells[cell, : mesh.dim + 1]].mean(axis=0)
    return [
        f"the cell at {_text(place)} mm is folded over at a node, most in increment {number}: equilibrium holds, "
        "stress and strain at that place do not, and nothing keeps surfaces that fold over apart; a fillet or longer "
        "edges there avoid it"
    ]


def snap_warnings(steps: Sequence[StepResult]) -> list[str]:
    """Return a warning about the increments in which the body snapped to another equilibrium."""
    snapped = [str(number) for number, step in enumerate(steps, 1) if step.method == SNAPPED]
    if not snapped:
        return []
    return [
        f"the finger snaps to another equilibrium in increment {', '.join(snapped)}: the one before ends there, and "
        "the one that follows depends on mesh and increments; a fillet where a sharp edge folds, or a smaller depth, "
        "avoids it"
    ]


def _text(place: Float) -> str:
    return ", ".join(f"{axis} = {x:.3g}" for axis, x in zip("xyz", place, strict=False))


def _sharp_edges(mesh: Mesh) -> list[int]:
    """Return the vertices that belong to two faces of the finger."""
    labels = [np.unique(mesh.facets[name][:, : mesh.dim]) for name in (*FREE_FACES, "base") if name in mesh.facets]
    return [int(vertex) for vertex, count in Counter(chain.from_iterable(labels)).items() if count > 1]
