"""Whether contact stayed within the candidate points of a condensed body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from finger3d.fem.traces import surface
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.problem import Problem

_TOUCHES = 1e-9
"""Overlap outside the candidate points that counts as contact there, in depths of the press: round-off of a gap."""


def step_within_candidates(problem: Problem, step: StepResult) -> bool:
    """Return whether no point of the contact face outside the candidates went through the object."""
    return contact_within_candidates(problem, [step])[0]


def contact_within_candidates(problem: Problem, steps: Sequence[StepResult]) -> list[bool]:
    """Return, for each step, whether contact stayed within the candidates; in small strain by one back-substitution."""
    if candidates_cover_face(problem):
        return [True] * len(steps)
    face = surface(problem.part.mesh, "contact", problem.part.thickness)
    others = ~np.isin(face.nodes, problem.system.surface.nodes)
    parts, ends = [f.part for f in steps], [f.target for f in steps]
    gaps = problem.model.formulation.gaps(problem, parts, ends, face)
    return [bool(gap[others].min() > -_TOUCHES * end.depth_mm) for gap, end in zip(gaps, ends, strict=True)]


def candidates_cover_face(problem: Problem) -> bool:
    """Return whether all points of the contact face are candidates."""
    mesh = problem.part.mesh
    corners = mesh.facets["contact"][:, : mesh.dim]
    return len(np.unique(corners)) == len(problem.system.surface.nodes)
