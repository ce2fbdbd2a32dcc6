"""Bodies and paths that differ by a tolerance from those of a problem."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from finger3d.accuracy.modulus import times_modulus
from finger3d.fem.laws.material import MIXED_FROM
from finger3d.mechanics.discretise.build import changed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg, MeshOptions

_TILTED_POINTS = {2: 100, 3: 500}
"""Contact points, by dimension, that the mesh of a tilted body has about."""


def deeper(legs: tuple[Leg, ...], step: float) -> tuple[Leg, ...]:
    """Return the legs with a step (mm) added to every depth but that of first touch."""
    return tuple(replace(leg, depth_mm=leg.depth_mm + step * (leg.depth_mm > 0.0)) for leg in legs)


def poisson_steps(nu: float, step: float) -> tuple[float, float]:
    """Return two steps of Poisson's ratio of the same element: to both sides, or one and two to the side with room."""
    low, high = (MIXED_FROM, 0.5) if nu >= MIXED_FROM else (0.0, MIXED_FROM - 1e-9)
    if low <= nu - step and nu + step <= high:
        return -step, step
    room = max(high - nu, low - nu, key=abs)
    step = math.copysign(min(step, 0.5 * abs(room)), room)
    return step, 2.0 * step


def with_modulus(problem: Problem, factor: float) -> Problem:
    """Return the problem with Young's moduli of all parts multiplied."""
    return changed(problem, times_modulus(problem.model, factor))


def tilted_mesh(problem: Problem) -> MeshOptions:
    """Return the mesh options of a tilted body: longer edges, and a structured mesh where the design allows one."""
    options, left = problem.model.mesh, len(problem.points.nodes) / _TILTED_POINTS[problem.dim]
    factor = min(2.0, max(1.0, left)) if problem.dim == 2 else min(1.5, max(1.25, math.sqrt(left)))
    mesher: Any = "swept" if problem.model.design.section() is not None else options.mesher
    return replace(options, size_mm=factor * options.size_mm, base_size_mm=factor * options.base_size_mm, mesher=mesher)
