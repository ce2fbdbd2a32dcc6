"""Forecast of the size, time and memory of a press, and of what its effects add, from the cost model.

The size of a structured or given mesh is counted on the mesh itself.  That of an unstructured one follows from the
field of edge lengths: 11 solids that fTetWild meshed had 0.83 to 1.22 times the cells and 0.68 to 1.17 times the
contact points; 10 coarse ones 0.85 to 1.18 times the cells, and 5 with a layer thinner than the edges 0.9 to 1.4 times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from finger3d._cost import (
    BORDER_POINTS,
    BORDER_UNKNOWNS,
    CAD_MB,
    COMPANIONS,
    COMPANIONS_BESIDE,
    CONTACT_EXTENT,
    FIGURES_S,
    FINER_COMPANION,
    FOIL_ROWS,
    FOIL_S,
    GAUGE_CELL_S,
    GAUGE_S,
    GAUGE_UNKNOWNS,
    JUDGEMENT_S,
    JUDGEMENT_SHARE,
    LEAST_BARS_S,
    SOLUTIONS,
    START_S,
    USUAL_INCREMENTS,
    PressSize,
    meshing_s,
    tet_unknowns,
    tets_of_ftetwild,
)
from finger3d._types import Tree
from finger3d.mechanics.discretise.body_mesh import face_near_gauge, locally_refined
from finger3d.mechanics.discretise.build import WHOLE_FACE, candidate_points, poses
from finger3d.mechanics.discretise.companions import LEAST_IN_SOLID
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import free_surface
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.march.step_halving import automatic, limits
from finger3d.mechanics.model import Model
from finger3d.mechanics.path import AUTO_START
from finger3d.meshing.given import GivenMesh
from finger3d.meshing.limits import check_memory
from finger3d.meshing.sizing import Sizing
from finger3d.objects import PlacedObject

_LATTICE = 100
"""Places along each side of a part at which the contact face of an unstructured mesh is counted."""


@dataclass(frozen=True, kw_only=True)
class PressCost:
    """Estimated cost of a press without effects.

    Attributes
    ----------
    size : of the meshed part
    cells : number of its cells
    steps, increments : number of increments in the last run, and in all runs
    runs : number of runs, each with another number of increments
    seconds : time of each stage by name
    """

    size: PressSize
    cells: int
    steps: int
    increments: int
    runs: int
    seconds: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class AddedCost:
    """Seconds and memory that an effect adds to a press, and the reason."""

    seconds: float = 0.0
    memory_mb: float = 0.0
    reason: str = "no factorisation and no further increment"

    def __str__(self) -> str:
        return f"about {self.seconds:.2g} s and {self.memory_mb:.2g} MB: {self.reason}"


def press_cost(model: Model) -> PressCost:
    """Return the estimated cost of a press without its effects."""
    axes = symmetry(model)
    made, coarse = _size(model, axes)
    cells, size = _with_borders(model, axes, made, coarse)
    finds_borders = size is not coarse
    cells, size = _with_gauges(model, axes, cells, size)
    runs, free = _runs(model, size), sum(leg.steps == "auto" for leg in model.legs)
    fixed = sum(leg.steps for leg in model.legs if isinstance(leg.steps, int))
    marched = len(runs) * fixed + sum(runs) * free
    solutions = 1 if model.object.is_flat or model.finite_strain else SOLUTIONS
    seconds = {
        "start": START_S,
        "mesh": meshing_s(made) if _is_meshed_by_tetwild(model) else 3e-7 * size.dofs,
        "assembly": size.assembly_s + len(model.gauges) * (GAUGE_S + GAUGE_CELL_S * cells),
        "condensation": size.condensation_s,
        "contact": marched * solutions * size.contact_s,
        **({"borders": _passes(model) * (coarse.assembly_s + coarse.press_s(AUTO_START))} if finds_borders else {}),
        "output": FIGURES_S[size.dim],
    }
    return PressCost(
        size=size, cells=cells, steps=fixed + runs[-1] * free, increments=marched, runs=len(runs), seconds=seconds
    )


def forecast(model: Model, bars: bool = False) -> Tree:
    """Size, seconds and memory of a press.

    Parameters
    ----------
    bars : whether the seconds of its error bars are among them

    Returns
    -------
    dict
        Printable values by name: domain, symmetry, cells, dofs, contact points, steps, seconds of each stage, memory.
    """
    axes, press = symmetry(model), press_cost(model)
    size, seconds = press.size, press.seconds
    costs = {name: added_cost(slot, model, press) for slot, name in model.filled}
    added = sum(cost.seconds for cost in costs.values())
    if bars:
        seconds = seconds | {"error_bars": _error_bars_s(model, size, seconds, added)}
    memory = 1e3 * size.press_gb(len(model.gauges)) + sum(cost.memory_mb for cost in costs.values())
    memory += CAD_MB * _is_meshed_by_tetwild(model) + _states_mb(model, press, axes)
    check_memory(memory / 1e3, "this press")
    return {
        "domain": model.domain,
        "formulation": "mixed quadratic/linear" if model.mixed else "quadratic displacement",
        "symmetry": " and ".join(axes) if axes else "none",
        "cells": round(press.cells),
        "dofs": round(size.dofs),
        "contact_points": round(size.contact_points),
        **({"gauges": len(model.gauges)} if model.gauges else {}),
        **_triangles(model),
        "steps": press.steps,
        **({"steps_of_all_runs": press.increments} if press.runs > 1 else {}),
        **{f"{stage}_s": round(s, 2) for stage, s in seconds.items()},
        **{name: f"costs {cost}" for name, cost in costs.items()},
        "total_s": round(sum(seconds.values()) + added, 1),
        "memory_MB": round(memory),
    }


def _error_bars_s(model: Model, size: PressSize, seconds: dict[str, float], added_s: float) -> float:
    """Return the seconds of the error bars of a press from those of its stages, and of its effects."""
    solving = sum(seconds[stage] for stage in ("assembly", "condensation", "contact"))
    more = FINER_COMPANION if size.dim == 3 and size.dofs < LEAST_IN_SOLID else 0.0
    if model.finite_strain:
        return LEAST_BARS_S + (COMPANIONS_BESIDE + more) * (solving + added_s)
    return LEAST_BARS_S + (COMPANIONS + more) * solving + max(JUDGEMENT_S, JUDGEMENT_SHARE * solving)


def without_output_s(expected: Tree) -> float:
    """Return the seconds of a forecast without those to start and to draw."""
    return float(expected["total_s"] - expected["start_s"] - expected["output_s"])


def _is_meshed_by_tetwild(model: Model) -> bool:
    return model.domain == "solid" and model.mesh.mesher == "ftetwild" and not isinstance(model.design, GivenMesh)


def _runs(model: Model, size: PressSize) -> list[int]:
    """Increments of an automatic leg in every run of the mesh that chooses them; the last is reported."""
    if not automatic(model):
        return [AUTO_START]
    first, last = limits(model, size)
    if model.finite_strain:  # they are chosen on a coarser mesh
        return [last]
    runs = [first]
    while runs[-1] < min(USUAL_INCREMENTS, last):
        runs.append(2 * runs[-1])
    return runs


def _size(model: Model, axes: tuple[str, ...]) -> tuple[int, PressSize]:
    """Return the cells and the size of a structured or given mesh, or estimates from the field of edge lengths."""
    from finger3d.meshing.generate import mesh_solid
    from finger3d.meshing.swept import mesh_section

    zone = model.first_contact.contact_box
    if model.domain != "solid" or model.mesh.mesher == "swept" or isinstance(model.design, GivenMesh):
        make = mesh_solid if model.domain == "solid" else mesh_section
        mesh, report = locally_refined(model, *make(model.design, model.mesh, zone, axes), axes)
        first = model.first_contact.first_contact_mm
        touching = len(candidate_points(model, free_surface(model, mesh, 1.0), first, MARGIN).nodes)
        dofs = mesh.dim * report.points + (len(mesh.part_corners[0]) if model.mixed else 0)
        return report.cells, PressSize(mesh.dim, dofs, touching)
    from finger3d.meshing.sizing import count_cells, sizing
    from finger3d.meshing.unstructured.solids import box

    field = sizing(model.design, model.mesh, zone, *box(model.design, axes))
    cells = count_cells(model.design, field)
    cells = int(tets_of_ftetwild(cells) if model.mesh.mesher == "ftetwild" else cells)
    return cells, PressSize(3, tet_unknowns(cells, model.mixed), _candidates(model, field))


def _with_borders(model: Model, axes: tuple[str, ...], cells: int, size: PressSize) -> tuple[int, PressSize]:
    """Return cells and size of a mesh that is refined at the border of stick in a solid.

    The border is taken to be that of a contact whose extents are a share of those over which the rigid object overlaps
    the finger.  In seven solids the contact points were 0.75 to 1.21 times those that follow, the unknowns 0.81 to 1.19
    times.
    """
    mesh = model.mesh
    if size.dim == 2 or _passes(model) == 0 or model.friction.largest == 0.0 or mesh.borders is not None:
        return cells, size
    x_min, x_max, z_min, z_max = model.first_contact.contact_box
    edges = 2.0 * CONTACT_EXTENT * (x_max - x_min + z_max - z_min) / 2 ** len(axes) / mesh.size_mm
    finer = mesh.stick_refinement
    points = BORDER_POINTS[mesh.mesher == "swept"] * (0.3 * finer**2 + finer - 1.0) * edges
    return _with_points(cells, size, points, BORDER_UNKNOWNS)


def _with_gauges(model: Model, axes: tuple[str, ...], cells: int, size: PressSize) -> tuple[int, PressSize]:
    """Return cells and size of a solid whose edges are shorter at the contact face close to its gauges."""
    mesh = model.mesh
    if size.dim == 2 or mesh.gauge_refinement == 1.0:
        return cells, size
    points = 0.0
    for gauge in model.gauges:
        x, y, z = gauge.middle
        depth = float(model.design.top(np.array([x]), np.array([z]))[0] - y)
        if not depth > 0.0:
            continue
        reach, edge = face_near_gauge(depth, mesh.size_mm / mesh.gauge_refinement)
        mirrored = sum(abs(at) < reach for axis, at in (("x", x), ("z", z)) if axis in axes)
        face = min(math.pi * reach, 2.0 * model.design.width_mm) * reach / 2.0**mirrored
        points += max(face / 0.866 * (edge**-2 - mesh.size_mm**-2), 0.0)
    return _with_points(cells, size, points, GAUGE_UNKNOWNS)


def _with_points(cells: int, size: PressSize, points: float, unknowns: float) -> tuple[int, PressSize]:
    """Return cells and size of a mesh with more contact points, each with so many unknowns in and below the face."""
    dofs = size.dofs + unknowns * points
    return round(cells * dofs / size.dofs), PressSize(size.dim, dofs, size.contact_points + points)


def _passes(model: Model) -> int:
    """Return the number of coarser presses that find the border of stick."""
    return math.ceil(math.log2(max(model.mesh.stick_refinement, 1.0)))


def _candidates(model: Model, field: Sizing) -> float:
    """Estimate the candidate contact points of an unstructured mesh, as the vertices of equilateral triangles."""
    middles, span = (np.arange(_LATTICE) + 0.5) / _LATTICE, field.high - field.low
    x, z = np.meshgrid(field.low[0] + middles * span[0], field.low[2] + middles * span[2], indexing="ij")
    top = model.design.top(x.ravel(), z.ravel()).reshape(x.shape)
    inside = np.isfinite(top)
    slopes = np.gradient(np.where(inside, top, 0.0), span[0] / _LATTICE, span[2] / _LATTICE)
    area = np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2) * span[0] * span[2] / _LATTICE**2
    edge = field.at(np.stack([x, np.where(inside, top, 0.0), z], axis=-1).reshape(-1, 3)).reshape(x.shape)
    vertices = np.where(inside, area / (0.866 * edge**2), 0.0)
    path, touch = poses(model), model.first_contact.first_contact_mm
    objects = (PlacedObject.of(model.object, touch, pose) for pose in path)
    overlap = np.max([obj.overlap(x.ravel(), top.ravel(), z.ravel()) for obj in objects], axis=0).reshape(x.shape)
    near = float(vertices[overlap > -MARGIN * max(pose.depth_mm for pose in path)].sum())
    whole = float(vertices.sum())
    made = field.share_made**0.5 * (whole if near >= WHOLE_FACE * whole else near)
    return float(made + 1.9 * made**0.5)  # vertices on the rim have half of the area of others


def _triangles(model: Model) -> dict[str, int]:
    """Triangles of a finger and of an object from files."""
    bodies = {"finger_triangles": model.design, "object_triangles": model.object}
    return {name: len(body.surface.faces) for name, body in bodies.items() if hasattr(body, "surface")}


def _states_mb(model: Model, press: PressCost, axes: tuple[str, ...]) -> float:
    """Memory of the states of all increments, MB: those of the part, of the whole finger and of the formulation."""
    steps = sum(leg.steps if isinstance(leg.steps, int) else 8 * AUTO_START for leg in model.legs)
    numbers = 3 * press.size.dim * press.size.contact_points * (1 + 2 ** len(axes)) + _state_size(model, press.size)
    return float(8e-6 * steps * numbers)


def _state_size(model: Model, size: PressSize) -> float:
    """Return how many numbers the state of the body holds: its unknowns, and its internal variables if it relaxes.

    At finite strain these are 9 at 4 points of each of some dofs / 4.5 cells.
    """
    branches = len(model.relaxation.prony) if model.relaxation else 0
    if model.finite_strain:
        return size.dofs * (1.0 + 8.0 * (branches + 1 if branches else 0))
    if model.relaxation is None:
        return 0.0
    return (1 + branches) * (size.dim * size.contact_points if model.relaxation.bulk else size.dofs)


def added_cost(slot: str, model: Model, press: PressCost) -> AddedCost:
    """Return the cost that the effect in a slot of the model adds; a friction law adds none."""
    match slot:
        case "hyperelastic_law":
            return AddedCost(
                seconds=press.increments * press.size.finite_strain_s,
                memory_mb=press.size.factor_mb,
                reason=f"about one factorisation and nine iterations in each of {press.increments} steps",
            )
        case "relaxation" if model.refactorises and not model.finite_strain:
            lengths = _lengths_of_time_step(model, press)
            return AddedCost(
                seconds=lengths * press.seconds["condensation"] + press.seconds["assembly"],
                memory_mb=lengths * press.size.factor_mb,
                reason=f"{lengths} more factorisation{'s' * (lengths > 1)}, one for each length of the increments",
            )
        case "inclusions":
            foils, d = len(model.gauges), press.size.dim
            rows = FOIL_ROWS[d] * foils
            share = min(rows / max(d * press.size.contact_points, 1.0), 1.0)
            return AddedCost(
                seconds=share * press.seconds["condensation"] + press.seconds["contact"] + FOIL_S[d] * foils,
                memory_mb=40e-6 * rows**2,
                reason=f"{rows} more rows, and every increment once more without the foils",
            )
        case "object_compliance":
            return AddedCost(
                seconds=press.seconds["condensation"] + press.seconds["assembly"] + press.seconds["mesh"],
                memory_mb=0.5 * press.size.factor_mb,
                reason="the object is meshed and condensed like the finger; taken to be of its size",
            )
    return AddedCost()


def _lengths_of_time_step(model: Model, press: PressCost) -> int:
    """Return the number of different lengths of the increments of time, each of which has a factor of its own."""
    fixed = {leg.duration_s / leg.steps for leg in model.legs if leg.duration_s and leg.steps != "auto"}
    automatic = {leg.duration_s for leg in model.legs if leg.steps == "auto"}
    return max(len(fixed) + press.runs * len(automatic), 1)
