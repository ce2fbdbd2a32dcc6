"""Probable cause of an increment at finite strain that did not converge, from object, mesh and last state."""

from __future__ import annotations

from collections import Counter
from itertools import chain

import numpy as np

from finger3d._types import Float
from finger3d.fem.quality import most_distorted
from finger3d.fem.simplex import FREE_FACES, Mesh
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.resolution import unresolved_details

_DISTORTED = 0.7
"""Ratio of volumes below which the most distorted cell is named."""

_NEAR = 2.0
"""Distance, in lengths of the cell, at which a cell is beside a sharp edge of the finger."""


def cause_of_failure(problem: Problem, u: Float) -> str:
    """Return the probable cause and its cure in one line; empty if there is none to name.

    It is a length of the object that the contact points do not resolve, else the cell that is distorted most.

    Parameters
    ----------
    u : (n, d) mm, displacement of the nodes at the last converged state
    """
    if details := unresolved_details(problem.model):
        return details[0]
    mesh = problem.mesh
    cell, ratio = most_distorted(mesh, u)
    if ratio > _DISTORTED:
        return ""
    corners = mesh.points[mesh.cells[cell, : mesh.dim + 1]]
    place = corners.mean(axis=0)
    at = ", ".join(f"{axis} = {x:.3g}" for axis, x in zip("xyz", place, strict=False))
    line = f"the cell at {at} mm is compressed to {ratio:.2g} of its volume in the step before"
    length = float(np.ptp(corners, axis=0).max())
    edges = mesh.points[_sharp_edges(mesh)]
    if len(edges) and float(np.linalg.norm(edges - place, axis=1).min()) < _NEAR * length:
        line += f"; it is at a sharp edge of the finger, which a fillet of {length:.2g} mm or more would round"
    return line


def _sharp_edges(mesh: Mesh) -> list[int]:
    """Return the vertices that belong to two faces of the finger."""
    labels = [np.unique(mesh.facets[name][:, : mesh.dim]) for name in (*FREE_FACES, "base") if name in mesh.facets]
    return [int(vertex) for vertex, count in Counter(chain.from_iterable(labels)).items() if count > 1]
