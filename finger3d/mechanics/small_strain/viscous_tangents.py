r"""Derivatives of the increments of a relaxing body in small strain (`finger3d.mechanics.small_strain.viscoelastic`).

Within an increment the body is linear in its contact forces and its past.  The internal variables q at its end solve
``alpha q = f + past`` if Poisson's ratio is constant, with row forces f, and else, as displacements, ::

    (K_b + alpha K_s) q = B^T f + K_s past

Their derivatives at fixed f are those of the other terms, central differences between presses below and above a
parameter, which carry their own internal variables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from finger3d._types import Float
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.increment_tangents import FixedForces, IncrementTangents, readings_of
from finger3d.mechanics.small_strain.linearised import Linear, LinearisedIncrement, Part, slopes
from finger3d.mechanics.small_strain.relaxation import InternalVariables, Step, relaxed
from finger3d.mechanics.small_strain.variations import Side, Variation, changes_of_rows
from finger3d.mechanics.small_strain.viscoelastic import Viscoelastic, ViscousBody
from finger3d.mechanics.small_strain.viscoelastic_body import ConstantBulkModulus, Response
from finger3d.objects import Move

_Past: TypeAlias = tuple[Step, InternalVariables]


@dataclass(frozen=True)
class _Linear(Linear):
    """Increment of a relaxing body, linearised at its end, with the response of its rows over the step."""

    step: Step
    response: Response


@dataclass(frozen=True)
class _FixedForces(FixedForces):
    """Derivatives at fixed contact forces, those of internal variables (q, p) and of rows (r, p) without springs, too.

    `readings` are those of the relaxed stress; `pasts` are the steps of all sides, and their internal variables before.
    """

    variables: Float
    rows: Float
    pasts: Sequence[_Past]


class ViscousTangents(IncrementTangents):
    """Derivatives of a press of a relaxing body in small strain, one increment after another."""

    formulation: Viscoelastic

    def __init__(self, problem: Problem, variations: Sequence[Variation], steps: Sequence[StepResult]) -> None:
        super().__init__(problem, variations, steps)
        self._without_past = [replace(one, body=None) for one in variations]  # an elastic object does not relax

    def _linearised(self, before: State[ViscousBody], after: State[ViscousBody], move: Move) -> _Linear:
        step = Step(self.formulation.relaxation.prony, move.duration_s)
        response, body = self.formulation.respond(self.problem, before.body.memory, step, self._workspace)
        problem = replace(self.problem, system=replace(self.problem.system, delassus=body.delassus))
        active = LinearisedIncrement.of(problem, before.contact, after.contact)
        return _Linear(active, body.delassus, step, response)

    def _at_fixed_forces(self, part: Part, sides: Sequence[Side], steps: Float, moves: Sequence[Move]) -> _FixedForces:
        problem, memory, response = self.problem, part.after.body.memory, part.linear.response
        body, active = self.formulation.body(problem), problem.system.active_dofs
        forces = problem.row_forces(problem.upright_force(part.after.contact))
        pasts = [
            (Step(series.prony, move.duration_s), side.state.body.memory)
            for side, move in zip(sides, moves, strict=True)
            if (series := side.problem.model.relaxation) is not None
        ]
        own = np.zeros((len(forces), len(steps) // 2))  # of springs whose stiffness changes
        if count := len(springs := problem.inclusions.bar_stiffness):
            forces[-count:] = -springs * body.read(memory.elastic)[-count:]
            for k, one in enumerate(self._variations):
                if one.body:
                    own[-count:, k] = one.body.bars * forces[-count:]
        held = relaxed(part.linear.step.prony, memory)
        variables = slopes([(held + step.history_load(past)) / step.alpha for step, past in pasts], steps)
        if isinstance(body, ConstantBulkModulus):
            now = then = self._with_constant_bulk(part, forces, sides, steps, pasts, variables)
        else:
            changes = [*(one.body for one in self._variations), *[None] * (len(steps) // 2 - len(self._variations))]
            both = changes_of_rows(changes, np.stack([memory.elastic, forces], axis=1))
            now, then = both[:, 0], both[:, 1] + body.read(own)
        variables += _variables_under(response, own)
        rows = body.read(variables) + now
        follow = problem.inclusions.with_spring_forces(response.compliance, np.zeros_like(rows), rows)
        displacement = super()._at_fixed_forces(part, sides, steps, moves).displacement
        displacement[active] += (rows + response.compliance @ follow)[: len(active)]
        return _FixedForces(displacement, then[len(active) :][: len(problem.model.columns)], variables, rows, pasts)

    def _with_constant_bulk(
        self, part: Part, forces: Float, sides: Sequence[Side], steps: Float, pasts: Sequence[_Past], variables: Float
    ) -> Float:
        """Enter the derivatives of displacements and dilatations (N, p) under row forces (r,); return those of rows."""
        now, rows = part.after.body.memory.elastic, np.zeros((len(forces), len(steps) // 2))
        bodies = [ConstantBulkModulus(side.problem) for side in sides]
        internal = [
            one.internal_forces(*past, now, workspace)
            for one, past, workspace in zip(bodies, pasts, self._workspaces_of(sides), strict=True)
        ]
        load = -slopes(internal, steps)
        for k, one in enumerate(self._variations):
            if one.body:
                load[:, k] += one.body.rows.T @ forces
                rows[:, k] = one.body.rows @ now[: len(load)]
                rows[len(rows) - len(one.body.subgrid) :, k] += one.body.subgrid @ now[len(load) :]
        body = ConstantBulkModulus(self.problem)
        alpha, condensed = body.condensed(part.linear.step, self._workspace)
        variables[: len(load)] = body.shape(condensed.solve(load), alpha)
        return rows

    def _reached(
        self, part: Part, fixed: FixedForces, states: Sequence[State[Float]], sides: Sequence[Side], steps: Float
    ) -> list[tuple[State[Any], Float]]:
        assert isinstance(fixed, _FixedForces)
        problem, response, memory = self.problem, part.linear.response, part.after.body.memory
        body, first = self.formulation.body(problem), len(problem.system.active_dofs)
        rows = slopes([problem.row_forces(problem.upright_force(state.contact)) for state in states], steps)
        rows = problem.inclusions.with_spring_forces(response.compliance, rows, fixed.rows)
        variables = fixed.variables + _variables_under(response, rows)
        read = (fixed.rows + response.compliance @ rows)[first:][: len(problem.model.columns)]
        is_pressure = np.array([column.kind == "taxel" for column in problem.model.columns], dtype=bool)
        if is_pressure.any() and not isinstance(body, ConstantBulkModulus):  # of the relaxed stress
            read[is_pressure] = (body.read(rows)[first:][: len(read)] + fixed.readings)[is_pressure]
        here, found = readings_of(problem, part.after), list[tuple[State[Any], Float]]()
        of_sides = zip(states, sides, fixed.pasts, steps, strict=True)
        for k, (state, side, (step, past), t) in enumerate(of_sides):
            viscous = ViscousBody(state.body, step.after(past, memory.elastic + t * variables[:, k // 2]))
            after, readings = State(state.contact, viscous, state.last), here + t * read[:, k // 2]
            if isinstance(body, ConstantBulkModulus) and is_pressure.any():
                readings[is_pressure] = readings_of(side.problem, after)[is_pressure]
            found.append((after, readings))
        return found


def _variables_under(response: Response, rows: Float) -> Float:
    """Return the internal variables (q, p) that forces (r, p) on the rows cause."""
    free = response.shape(np.zeros(len(rows)))
    return np.stack([response.shape(row) - free for row in rows.T], axis=-1)
