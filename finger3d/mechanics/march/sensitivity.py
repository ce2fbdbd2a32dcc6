"""Derivatives of the numbers of a press by its parameters.

Along an exact path they are those of its events (`finger3d.mechanics.small_strain.path_tangents`), else those of its
increments (`finger3d.mechanics.small_strain.increment_tangents`, `finger3d.mechanics.small_strain.viscous_tangents` and
`finger3d.mechanics.finite_strain.increment_tangents`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.contact_geometry import contact_geometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.path import stations
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import in_order
from finger3d.mechanics.results.history import StepResult, table_row
from finger3d.mechanics.small_strain.increment_tangents import IncrementTangents, readings_of
from finger3d.mechanics.small_strain.kinks import Sides
from finger3d.mechanics.small_strain.path_tangents import Changes, PathTangents, PlaceOnPath
from finger3d.mechanics.small_strain.variations import Side, Variation, changes_of_points
from finger3d.mechanics.small_strain.viscous_tangents import ViscousTangents

_NONE = ("largest_penetration_mm", "iterations", "residual", "time_s")
"""Numbers of an increment that have no derivative."""

_TURNED = 1e-6
"""Angle (rad) between the normal of a point and that of the object there above which it was held fixed."""

_NO_FRICTION = 1e-8
"""Friction of a point, over the largest, that is none."""

Numbers: TypeAlias = dict[str, float]
"""Numbers of an increment by the names of their columns in history.csv, or their derivatives."""


def refusal(model: Model) -> str:
    """Return why the numbers of a press have no derivatives here; empty if they have."""
    if model.rule != "projection":
        return 'derivatives need contact.rule = "projection"'
    return ""


def held_normals(problem: Problem, step: StepResult) -> int:
    """Return how many points in contact have normals that an increment held fixed at an edge of the object.

    Derivatives take the normals of the object there, and are approximate.
    """
    state, contact = step.meshed_state, step.meshed_state.contact
    if step.path is not None or problem.model.finite_strain or problem.model.object.is_flat:
        return 0
    displacement = formulation_of(problem.model).loads(problem, state, step.target).displacement
    distance, share = problem.placed(step.target).distance, problem.system.object_share
    geometry = contact_geometry(distance, problem.surface, displacement, problem.axes, share)
    apart = np.linalg.norm(geometry.bases[:, 0] - contact.own_bases[:, 0], axis=1)
    return int(((apart > _TURNED) & (contact.force[:, 0] > 0.0)).sum())


Tangents: TypeAlias = Iterator[tuple[StepResult, Sides, Sides]]


def tangents(problem: Problem, variations: Sequence[Variation], steps: Sequence[StepResult] = ()) -> Tangents:
    """Yield every increment of a press, and the sides at its end of its variations as they fall and as they grow.

    Both are the same list until an increment ends at a kink, along an exact path until the press does.  They hold two
    sides of each variation but those of readings only, which change no contact.

    Parameters
    ----------
    problem : of the press
    variations : of p parameters
    steps : the increments, if the press is known

    Raises
    ------
    Finger3dError
        If the numbers of this press have no derivatives, or an increment does not converge.
    """
    if text := refusal(problem.model):
        raise Finger3dError(text)
    steps = steps or list(march(problem))
    if not steps[-1].outcome.ok:
        raise Finger3dError(f"at depth {steps[-1].target.depth_mm:.4g} mm: {steps[-1].outcome}")
    along = _by_increments if any(step.path is None for step in steps) else _on_exact_path
    others, none = [one for one in variations if not one.of_readings], list[Side | None]()
    yield from along(problem, others, steps) if others else ((step, none, none) for step in steps)


def _read(step: StepResult, one: Variation) -> tuple[Side, Side]:
    """Return the sides of a parameter that changes readings only at the end of an increment."""
    state, (problem, other) = step.meshed_state, one.ends
    low, high = (readings_of(end, state) for end in one.ends)
    moved = np.zeros(len(low))
    if not problem.model.finite_strain:
        force = problem.upright_force(state.contact).reshape(-1, 1)
        moved = changes_of_points(problem, [one], force)[len(force) :, 0, 0]
    side = Side(problem, state, step.target, low - one.step * moved, step.external_work_mJ, step.dissipation_mJ)
    return side, side._replace(problem=other, readings=high + one.step * moved)


def derivatives(
    step: StepResult, variations: Sequence[Variation], sides: Sides, way: int = 0, with_zones: bool = True
) -> list[Numbers]:
    """Return the derivatives (p,) of the numbers of an increment, per unit of each parameter; none if not known.

    The numbers are the columns of history.csv, by their names.  At points without friction the sum of its magnitudes
    has a kink; its derivative is that as parameters fall (`way` -1) or grow (1), or the mean of both (0).
    """
    friction = np.linalg.norm(step.meshed_state.contact.force[:, 1:], axis=1)
    starts = friction <= _NO_FRICTION * friction.max(initial=0.0)
    rest, found = iter(sides), list[Numbers]()
    for one in variations:
        low, high = _read(step, one) if one.of_readings else (next(rest), next(rest))
        found.append(_of_numbers(step, one, low, high, with_zones))
        if way and high is not None:
            begun = np.linalg.norm(high.state.contact.force[:, 1:], axis=1) * starts
            found[-1]["friction_sum_N"] += way * high.problem.symmetry.total(begun) / one.step
    return found


def _by_increments(problem: Problem, variations: Sequence[Variation], steps: Sequence[StepResult]) -> Tangents:
    kind = IncrementTangents if problem.model.relaxation is None else ViscousTangents
    if problem.model.finite_strain:
        from finger3d.mechanics.finite_strain.increment_tangents import FiniteIncrementTangents

        kind = FiniteIncrementTangents
    growing = falling = kind(problem, variations, steps)
    for step in steps:
        if growing is falling and falling.is_at_kink(step):
            growing = copy(falling)
        if growing is falling:
            sides = falling.advance(step)
            yield step, sides, sides
        else:
            yield step, falling.advance(step, -1), growing.advance(step, 1)


def _on_exact_path(problem: Problem, variations: Sequence[Variation], steps: Sequence[StepResult]) -> Tangents:
    changes = Changes.of(problem, variations)
    place, leg, along = PlaceOnPath.at_rest(changes), 0, None
    for station, step in zip(stations(problem.model.legs), steps, strict=True):
        along = along or PathTangents(step.path, changes, place, leg)
        here = along.at_share(station.share)
        sides: Sides = list(along.sides(step, here))
        both = along.one_sided(step, station.share) if step is steps[-1] else None
        yield step, *(both or (sides, sides))
        if station.share == 1.0:
            place, leg, along = here, leg + 1, None


def _of_numbers(step: StepResult, one: Variation, low: Side | None, high: Side | None, with_zones: bool) -> Numbers:
    """Return the derivatives of the numbers of an increment, by differences of their formulas."""
    if low is None or high is None:
        return {}

    def numbers(side: Side) -> Numbers:
        problem, contact = side.problem, side.state.contact
        moment = formulation_of(problem.model).loads(problem, side.state, side.pose).moment
        changed = replace(
            step,
            target=side.pose,
            state=problem.symmetry.unfold(contact),
            lowest=problem.placed(side.pose).lowest,
            moment=problem.symmetry.total_moment(moment),
            readings=in_order(dict(zip(problem.model.columns, side.readings.tolist(), strict=True))),
            external_work_mJ=side.work_mJ,
            dissipation_mJ=side.dissipation_mJ,
        )
        row = table_row(problem.points, changed, with_zones)
        return {name: value for name, value in row.items() if isinstance(value, float) and name not in _NONE}

    below, above = numbers(low), numbers(high)
    return {name: float(one.difference(below[name], above[name])) for name in above}
