"""Presses of one scene by different models, and their results per unit width."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np

from finger3d._types import Tree
from finger3d.accuracy.estimate import estimate
from finger3d.fem.mesh.simplex import CONTACT
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.history import StepResult, contact_table, measure
from finger3d.mechanics.march.step_halving import march_automatic
from finger3d.mechanics.model import Domain, Model
from finger3d.mechanics.readings import by_key, in_space, of_kind
from finger3d.objects import PlacedObject
from finger3d.results.comparison import Case

_POINTS = 600
"""Largest number of contact points of the meshed part of a solid of another width; a press then takes a few seconds."""


def resized(model: Model, size_mm: float) -> Model:
    """Return the model with all edge lengths scaled alike."""
    base = model.mesh.base_size_mm * size_mm / model.mesh.size_mm
    return replace(model, mesh=replace(model.mesh, size_mm=size_mm, base_size_mm=base))


def section_of(model: Model, domain: Domain) -> Model:
    """Return the 2D model of a solid; its object does not turn out of the plane."""
    return replace(model, domain=domain, legs=tuple(replace(leg, turn_x=0.0, turn_y=0.0) for leg in model.legs))


def widened(model: Model, width_mm: float) -> Model:
    """Return a solid of another width on a swept mesh, coarser than the scene's where needed for `_POINTS` points."""
    design = replace(model.design, width_mm=width_mm)
    free = 4 // 2 ** len(set(PlacedObject.of(model.object, 0.0).mirrors()) & {"x", "z"})
    size = min(model.mesh.size_mm, width_mm / FACTOR)
    largest = min(min(design.height_mm, design.half_length_mm) / 4.0, width_mm) / FACTOR

    def points(size_mm: float) -> float:
        layers = max(2, math.ceil(width_mm / (2.0 * size_mm)))
        return float(free * (design.half_length_mm / size_mm + 1) * (layers + 1))

    while points(size) > _POINTS and 1.2 * size <= largest:
        size *= 1.2
    return resized(replace(model, design=design, mesh=replace(model.mesh, mesher="swept")), size)


def press_with_errors(name: str, model: Model) -> Case:
    """Press the model and estimate its errors; see `finger3d.accuracy.estimate.estimate`."""
    start = time.perf_counter()
    # The whole contact face is a candidate, because the extent of contact differs from model to model.
    problem = build(model, margin=math.inf)
    steps, chosen = march_automatic(problem)
    step, points = steps[-1], problem.points
    mesher = "swept" if problem.dim == 2 else model.mesh.mesher
    case = Case(name, model.design.width_mm, model.mesh.size_mm, mesher, step.outcome)
    if case.ok:
        found = estimate(problem, steps, numbers=lambda p, f: quantities(p.points, f), chosen=chosen)
        case = replace(
            case,
            numbers=quantities(points, step),
            lines=lines_along_x(points, step),
            strains=of_kind(step.readings, "gauge"),
            errors=found.totals(),
            companion=found.companion_numbers,
            ratio=found.ratio,
            method=found.method,
        )
    return replace(case, seconds=time.perf_counter() - start)


def quantities(points: ContactPoints, step: StepResult) -> dict[str, float]:
    """Return the quantities of a step that sections and solids have in common: N per mm of width, mm, MPa, strains."""
    numbers = measure(points, step)
    width = 2.0 * points.half_width_mm
    friction = np.abs(points.friction(step.state.force)).sum(axis=0)
    out = {
        "force_N_per_mm": numbers["normal_force_N"] / width,
        "friction_sum_N_per_mm": numbers["friction_sum_N"] / width,
        "friction_along_x_N_per_mm": float(friction[0]) / width,
        "friction_along_z_N_per_mm": float(friction[2]) / width,
        "outward_friction_x_N_per_mm": numbers["outward_friction_x_N"] / width,
        "contact_length_mm": 2.0 * numbers["contact_half_length_mm"],
        "stick_length_mm": 2.0 * numbers["stick_half_length_mm"],
    }
    if "contact_half_length_end_mm" in numbers:
        out["contact_length_end_mm"] = 2.0 * numbers["contact_half_length_end_mm"]
    if points.dim == 3:
        out["moment_y_Nmm_per_mm"] = numbers["moment_y_Nmm"] / width
    middle = lines_along_x(points, step)["z = 0"]
    out["peak_pressure_MPa"] = float(np.max(middle["pressure_MPa"], initial=0.0))
    return out | by_key(in_space(step.readings))


def lines_along_x(points: ContactPoints, step: StepResult) -> dict[str, Tree]:
    """Return tractions along x at z = 0, or near it on an unstructured mesh, and at the end of a solid."""
    table = contact_table(points, step)
    z = table["z_mm"]
    exact = 1e-6 * points.half_width_mm
    top = points.face == CONTACT
    middle = np.flatnonzero((np.abs(z) <= exact) & top)
    if len(middle) < 5:
        middle = np.flatnonzero((np.abs(z) <= points.band_mm) & top)
    chosen = {"z = 0": middle}
    if points.dim == 3:
        chosen["end"] = np.flatnonzero((np.abs(z - points.half_width_mm) <= exact) & top)
    keys = ("x_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa", "status")
    out = {}
    for name, on in chosen.items():
        on = on[np.argsort(table["x_mm"][on], kind="stable")]
        out[name] = {k: np.asarray(table[k])[on].tolist() for k in keys}
    return out
