"""Derivatives of the numbers of a press by its parameters.

Along an exact path they are those of its events (`finger3d.mechanics.small_strain.path_tangents`), else those of its
increments (`finger3d.mechanics.small_strain.increment_tangents`, `finger3d.mechanics.small_strain.viscous_tangents` and
`finger3d.mechanics.finite_strain.increment_tangents`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from finger3d.contact.events import Event
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.path import Station, stations
from finger3d.mechanics.march.solve import Press
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import in_order
from finger3d.mechanics.results.history import StepResult, table_row
from finger3d.mechanics.small_strain.elastic import at_rest
from finger3d.mechanics.small_strain.exact_path import has_exact_path
from finger3d.mechanics.small_strain.increment_tangents import IncrementTangents
from finger3d.mechanics.small_strain.path_tangents import (
    PathTangent,
    PathTangents,
    compliance_changes,
    moved_pose,
)
from finger3d.mechanics.small_strain.variations import Side, Variation
from finger3d.mechanics.small_strain.viscous_tangents import ViscousTangents

_NONE = ("largest_penetration_mm", "iterations", "residual", "time_s")
"""Numbers of an increment that have no derivative."""

Numbers: TypeAlias = dict[str, float]
"""Numbers of an increment by the names of their columns in history.csv, or their derivatives."""


def refusal(model: Model) -> str:
    """Return why the numbers of a press have no derivatives here; empty if they have."""
    if model.relaxation is not None and model.finite_strain:
        return "derivatives are not known at large deformation with viscosity"
    if model.rule != "projection":
        return 'derivatives need contact.rule = "projection"'
    return ""


def tangents(problem: Problem, variations: Sequence[Variation]) -> Iterator[tuple[StepResult, list[Side]]]:
    """Yield every increment of a press, and the sides (2 p,) of p variations at its end.

    Raises
    ------
    Finger3dError
        If the numbers of this press have no derivatives, or an increment does not converge.
    """
    if text := refusal(problem.model):
        raise Finger3dError(text)
    follow = _on_exact_path if has_exact_path(problem.model) else _by_increments
    yield from follow(problem, variations)


def derivatives(step: StepResult, variations: Sequence[Variation], sides: Sequence[Side]) -> list[Numbers]:
    """Return the derivatives (p,) of the numbers of an increment, per unit of each parameter.

    The numbers are the columns of history.csv, by their names.
    """
    return [_of_numbers(step, *one) for one in zip(variations, sides[::2], sides[1::2], strict=True)]


def _advanced(press: Press, station: Station) -> StepResult:
    step = press.advance(station)
    if press.has_failed:
        raise Finger3dError(f"at depth {step.target.depth_mm:.4g} mm: {step.outcome}")
    return step


def _by_increments(problem: Problem, variations: Sequence[Variation]) -> Iterator[tuple[StepResult, list[Side]]]:
    press, tangents = Press(problem), _increment_tangents(problem, variations)
    for station in stations(problem.model.legs):
        step = _advanced(press, station)
        yield step, tangents.advance(step)


def _increment_tangents(problem: Problem, variations: Sequence[Variation]) -> IncrementTangents:
    if not problem.model.finite_strain:
        viscous = problem.model.relaxation is not None
        return ViscousTangents(problem, variations) if viscous else IncrementTangents(problem, variations)
    from finger3d.mechanics.finite_strain.increment_tangents import FiniteIncrementTangents

    return FiniteIncrementTangents(problem, variations)


def _on_exact_path(problem: Problem, variations: Sequence[Variation]) -> Iterator[tuple[StepResult, list[Side]]]:
    press, count = Press(problem), len(variations)
    c = len(press.state.contact.gap)
    ends = [[at_rest(end).gap for end in one.ends] for one in variations]
    rest = np.array([one.difference(*gaps) for one, gaps in zip(variations, ends, strict=True)]).reshape(count, c)
    moved = np.stack([rest, np.zeros_like(rest)], axis=2)
    tangent, motion = PathTangent(np.zeros_like(moved), moved, np.zeros(count), np.zeros(count)), np.zeros((count, 2))
    energies, number, follower = np.zeros((2, count)), 0, None
    changes = compliance_changes(problem, variations)
    for station in stations(problem.model.legs):
        step = _advanced(press, station)
        if press.path is None:
            raise Finger3dError("the path of the press is not exact")
        follower = follower or PathTangents(press.path, variations, changes, rest, tangent, motion, number)
        tangent, added = follower.at_share(station.share)
        motion, total = follower.motion(tangent, station.share), energies + added
        here = Event(0.0, 0.0, step.meshed_state.contact, 0.0, 0)
        force, sides = problem.upright_force(step.meshed_state.contact).ravel(), []
        for k, one in enumerate(variations):
            change = changes[k]
            read = change[1] @ force if change else np.zeros(len(problem.system.reading_rows))
            for end, t in zip(one.ends, (-one.step, one.step), strict=True):
                contact = tangent.changed(here, k, t).state
                sides.append(
                    Side(
                        end,
                        replace(step.meshed_state, contact=contact),
                        moved_pose(step.target, t * motion[k]),
                        t * read + problem.system.reading_rows @ problem.upright_force(contact).ravel(),
                        step.external_work_mJ + t * total[0, k],
                        step.dissipation_mJ + t * total[1, k],
                    )
                )
        yield step, sides
        if station.share == 1.0:
            number, follower, energies = number + 1, None, total
            tangent = replace(tangent, amplitude=np.zeros(count))


def _of_numbers(step: StepResult, one: Variation, low: Side, high: Side) -> Numbers:
    """Return the derivatives of the numbers of an increment, by differences of their formulas."""

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
        row = table_row(problem.points, changed)
        return {name: value for name, value in row.items() if isinstance(value, float) and name not in _NONE}

    below, above = numbers(low), numbers(high)
    return {name: float(one.difference(below[name], above[name])) for name in above}
