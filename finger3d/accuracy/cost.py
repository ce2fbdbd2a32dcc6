"""Forecast of the size, time and memory of a press from a calibrated cost model.

Calibrated on the Fig. 9 finger on 2 cores, by the runs of validation/cost_of_accuracy.py and scaling.py: up to 386 000
unknowns in 2D and 509 000 in 3D. The real time of other presses was 0.63 to 2.5 times the forecast, and their memory up
to 1.58 times, of solids meshed by fTetWild.
"""

from __future__ import annotations

from dataclasses import dataclass

from finger3d._types import Tree
from finger3d.mechanics.build import MARGIN, candidate_points
from finger3d.mechanics.cost import PressCost, added_cost, state_size
from finger3d.mechanics.gauge_refinement import refined_at_gauges
from finger3d.mechanics.model import Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.problem import free_surface
from finger3d.mechanics.step_halving import automatic, condensation_s, contact_s, limits
from finger3d.mechanics.symmetry import symmetry
from finger3d.meshing.given import GivenMesh
from finger3d.meshing.limits import check_memory, rows_gb

_BASE_MB = 170.0
_TETWILD_MB = 500.0  # while meshing, even for a small mesh
_IMPORT_S = 0.4
_FIGURES_S = {2: 1.0, 3: 4.5}
_GAUGE_S, _GAUGE_CELL_S = 3e-3, 7e-7  # for each gauge, and for each cell searched for it


@dataclass(frozen=True)
class _Size:
    cells: float
    points: float
    dofs: float
    contact_points: float


def forecast(model: Model) -> Tree:
    """Size, seconds and memory of a press.

    Returns
    -------
    dict
        Printable values by name: domain, symmetry, cells, dofs, contact points, steps, seconds of each stage, memory.
    """
    d = 3 if model.domain == "solid" else 2
    axes = symmetry(model)
    zone = model.first_contact.contact_box
    mixed = model.mixed
    size = _size(model, zone, axes, mixed)
    runs, free = _runs(model, size, d), sum(leg.steps == "auto" for leg in model.legs)
    fixed = sum(leg.steps for leg in model.legs if isinstance(leg.steps, int))
    marched = len(runs) * fixed + sum(runs) * free
    tetwild = d == 3 and model.mesh.mesher == "ftetwild" and not isinstance(model.design, GivenMesh)
    seconds = _seconds(size, d, marched, tetwild)
    seconds["assembly"] += len(model.gauges) * (_GAUGE_S + _GAUGE_CELL_S * size.cells)
    memory = max(_memory(size, d, len(model.gauges)), _TETWILD_MB if tetwild else 0.0)
    press = PressCost(
        dim=d,
        dofs=size.dofs,
        contact_points=size.contact_points,
        increments=marched,
        runs=len(runs),
        seconds=seconds,
        factor_mb=_memory(size, d) - _BASE_MB,
    )
    memory += _states_mb(model, press, axes)
    costs = {name: added_cost(slot, model, press) for slot, name in model.filled}
    check_memory((memory + sum(cost.memory_mb for cost in costs.values())) / 1e3, "this press")
    return {
        "domain": model.domain,
        "formulation": "mixed quadratic/linear" if mixed else "quadratic displacement",
        "symmetry": " and ".join(axes) if axes else "none",
        "cells": round(size.cells),
        "dofs": round(size.dofs),
        "contact_points": round(size.contact_points),
        **({"gauges": len(model.gauges)} if model.gauges else {}),
        **_triangles(model),
        "steps": fixed + runs[-1] * free,
        **({"steps_of_all_runs": marched} if len(runs) > 1 else {}),
        **{f"{stage}_s": round(s, 2) for stage, s in seconds.items()},
        **{name: f"costs {cost}" for name, cost in costs.items()},
        "total_s": round(sum(seconds.values()) + sum(cost.seconds for cost in costs.values()), 1),
        "memory_MB": round(memory + sum(cost.memory_mb for cost in costs.values())),
    }


_USUAL = 80  # the median of automatic increments over the cases of validation/error_bars.py


def _runs(model: Model, size: _Size, d: int) -> list[int]:
    """Increments of an automatic leg in every run that chooses them; the last is reported."""
    if not automatic(model):
        return [AUTO_START]
    first, last = limits(model, size.dofs, size.contact_points)
    runs = [first]
    while runs[-1] < min(_USUAL, last):
        runs.append(2 * runs[-1])
    return runs


def _size(model: Model, zone: tuple[float, float, float, float], axes: tuple[str, ...], mixed: bool) -> _Size:
    """Return the size of a structured mesh, or an estimate from the size field of pytetwild."""
    from finger3d.meshing.generate import mesh_solid
    from finger3d.meshing.swept import mesh_section

    h = model.mesh.size_mm
    if model.domain != "solid" or model.mesh.mesher == "swept" or isinstance(model.design, GivenMesh):
        make = mesh_solid if model.domain == "solid" else mesh_section
        mesh, report = refined_at_gauges(model, *make(model.design, model.mesh, zone, axes), axes)
        d, vertices = mesh.dim, len(mesh.part_corners[0])
        points, cells = report.points, report.cells
        first = model.first_contact.first_contact_mm
        touching = len(candidate_points(model, free_surface(model, mesh, 1.0), first, MARGIN).nodes)
    else:
        from finger3d.meshing.sizing import forecast as count_cells
        from finger3d.meshing.sizing import sizing
        from finger3d.meshing.solids import box

        low, high = box(model.design, axes)
        d, cells = 3, int(count_cells(model.design, sizing(model.design, model.mesh, zone, low, high)))
        points, vertices = int(1.55 * cells), int(0.24 * cells)
        touching = (zone[1] - zone[0]) * (zone[3] - zone[2]) / (0.87 * h**2) / 2 ** len(axes)
    return _Size(cells, points, d * points + (vertices if mixed else 0), touching)


def _seconds(size: _Size, d: int, steps: int, tetwild: bool) -> dict[str, float]:
    return {
        "start": _IMPORT_S,
        "mesh": 3.0 + 3.5e-4 * size.cells if tetwild else 3e-7 * size.dofs,
        "assembly": 8e-6 * size.dofs if d == 3 else 0.005 + 3e-6 * size.dofs,
        "condensation": condensation_s(size.dofs, d),
        "contact": steps * contact_s(size.contact_points, d),
        "output": _FIGURES_S[d],
    }


def _triangles(model: Model) -> dict[str, int]:
    """Triangles of a finger and of an object from files."""
    bodies = {"finger_triangles": model.design, "object_triangles": model.object}
    return {name: len(body.surface.faces) for name, body in bodies.items() if hasattr(body, "surface")}


def _states_mb(model: Model, press: PressCost, axes: tuple[str, ...]) -> float:
    """Memory of the states of all increments, MB: those of the part, of the whole finger and of the formulation."""
    steps = sum(leg.steps if isinstance(leg.steps, int) else 8 * AUTO_START for leg in model.legs)
    numbers = 3 * press.dim * press.contact_points * (1 + 2 ** len(axes)) + state_size(model, press)
    return float(8e-6 * steps * numbers)


def _memory(size: _Size, d: int, gauges: int = 0) -> float:
    body = 1.19e-3 * size.dofs**1.2 if d == 3 else 2.5e-3 * size.dofs
    return _BASE_MB + body + 1e3 * rows_gb(d * size.contact_points + gauges)
