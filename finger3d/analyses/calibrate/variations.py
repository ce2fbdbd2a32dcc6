"""Bodies and paths that differ by a tolerance from those of a problem."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.fem.laws.material import MIXED_FROM, Isotropic, Material
from finger3d.fem.solvers.condense import stiffened
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem, object_share, scatter_to_points, under_pressure
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Plane

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
    """Return the problem with Young's moduli of all parts multiplied; in small strain the condensation is reused."""
    model = problem.model
    if not model.is_linear_elastic:
        parts = tuple((label, _stiffer(material, factor)) for label, material in model.parts)
        return build(replace(model, material=_stiffer(model.material, factor), parts=parts))
    c, d = problem.delassus.shape[:2]

    def scaled(one: Problem) -> Problem:
        own = stiffened(one.body.condensed.compliance, one.inclusions.bar_stiffness)
        active, readings = one.system.active_dofs, len(one.system.reading_rows)
        of_object = one.delassus - scatter_to_points(own, active, c, d)
        changed = stiffened(one.body.condensed.compliance / factor, one.inclusions.bar_stiffness)
        rows = np.zeros_like(one.system.reading_rows)
        rows[:, active] = changed[len(active) : len(active) + readings, : len(active)]
        rows[len(rows) - len(model.gauges) - len(model.taxels) : len(rows) - len(model.gauges)] *= factor  # of forces
        finger = scatter_to_points(changed, active, c, d)
        both = [under_pressure(one.surface, compliance) for compliance in (finger, of_object)]
        share = None if one.system.object_share is None else object_share(*both)
        system = replace(one.system, delassus=finger + of_object, reading_rows=rows, object_share=share)
        return replace(one, system=system)

    changed, bare = scaled(problem), problem.without_inclusions
    return replace(changed, without_inclusions=scaled(bare)) if bare else changed


def _stiffer(material: Material, factor: float) -> Isotropic:
    isotropic = material.isotropic("the tolerance of E_MPa")
    return replace(isotropic, E_MPa=isotropic.E_MPa * factor)


def with_plane(problem: Problem, plane: Plane) -> Problem:
    """Return the problem under another plane; under a rigid one its body is kept."""
    model, bare = replace(problem.model, object=plane), problem.without_inclusions
    if model.object_compliance is not None:
        return build(model)
    touch = model.first_contact
    system = replace(problem.system, first_contact_mm=touch.first_contact_mm, place_mm=touch.place)
    return replace(problem, model=model, system=system, without_inclusions=with_plane(bare, plane) if bare else None)


def tilted_mesh(problem: Problem) -> MeshOptions:
    """Return the mesh options of a tilted body: longer edges, and a structured mesh where the design allows one."""
    options, left = problem.model.mesh, len(problem.points.nodes) / _TILTED_POINTS[problem.dim]
    factor = min(2.0, max(1.0, left)) if problem.dim == 2 else min(1.5, max(1.25, math.sqrt(left)))
    mesher: Any = "swept" if problem.model.design.section() is not None else options.mesher
    return replace(options, size_mm=factor * options.size_mm, base_size_mm=factor * options.base_size_mm, mesher=mesher)
