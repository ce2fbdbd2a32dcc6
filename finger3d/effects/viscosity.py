"""Viscoelasticity: moduli that relax as a Prony series r(t) = 1 - sum g_i (1 - exp(-t/tau_i)), E_MPa at t = 0.

With ``bulk`` Poisson's ratio is constant and everything follows from the instantaneous compliance C.  Let f_e be the
row forces that would hold the present shape of the elastic body, u = K^-1 B^T f_e; f is the convolution r * df_e/dt, or
``f = r_inf f_e + sum h_i`` with ``h_i' = e_i h_i + g_i gamma_i (f_e' - f_e)``, e_i = exp(-dt/tau_i) and
gamma_i = (1 - e_i) tau_i/dt: exact where f_e moves at a constant rate within the step (Taylor, Pister and Goudreau
1970).  So ``f_e' = (f + past)/alpha``, alpha = r_inf + sum g_i gamma_i: contact is solved with the compliance C/alpha
and points displaced by the past.  f_e is defined at all contact points: an open one has f = 0 but still creeps back.

Without ``bulk`` only the shear modulus relaxes.  The same holds of the shear part K_s of K = K_b + K_s, with the whole
displacement in place of f_e: one factorisation of K_b + alpha K_s for each length of step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import MinLen

from finger3d._ranges import Fraction, Seconds
from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.effects._viscoelastic_body import (
    ConstantBulkModulus,
    ConstantPoissonRatio,
    RelaxationWorkspace,
    ViscoelasticBody,
)
from finger3d.effects.base import fill, warn
from finger3d.errors import Finger3dError
from finger3d.fem.condense import spring_forces, stiffened
from finger3d.fem.recover import displacement
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.linear_contact import LinearBody, LinearState, solve_increment
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem, scatter_to_points
from finger3d.mechanics.relaxation import InternalVariables, Prony, Step
from finger3d.mechanics.small_strain import SmallStrain
from finger3d.objects import ObjectPose

_ROUNDING = 5e-3
"""Largest excess over 1 of a sum of relative moduli that is taken for rounding."""

_LEAST_LONG_TIME = 1e-6
"""Least long-time modulus over E: a body without one would be a liquid."""


@dataclass(frozen=True, kw_only=True)
class ViscousState(LinearState):
    """Contact state with the internal variables of the meshed part."""

    memory: InternalVariables


@dataclass(frozen=True)
class Viscoelastic(SmallStrain):
    """Small strain with relaxing moduli."""

    is_linear_elastic: ClassVar[bool] = False

    prony: Prony
    bulk: bool

    @property
    def refactorises(self) -> bool:
        """Without `bulk` every length of step has a factor of its own."""
        return not self.bulk

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost of a factorisation for each length of step; none if the bulk modulus relaxes too."""
        if self.bulk:
            return AddedCost()
        fixed = {leg.duration_s / leg.steps for leg in model.legs if leg.duration_s and leg.steps != "auto"}
        automatic = {leg.duration_s for leg in model.legs if leg.steps == "auto"}
        lengths = max(len(fixed) + press.runs * len(automatic), 1)
        return AddedCost(
            seconds=lengths * press.seconds["condensation"] + press.seconds["assembly"],
            memory_mb=lengths * press.factor_mb,
            reason=f"{lengths} more factorisation{'s' * (lengths > 1)}, one for each length of step",
        )

    def state_size(self, press: PressCost) -> float:
        """Return the number of internal variables, and of the elastic response with them."""
        return (1 + len(self.prony)) * (press.dim * press.contact_points if self.bulk else press.dofs)

    def workspace(self) -> RelaxationWorkspace:
        """Return a workspace without a factor."""
        return RelaxationWorkspace()

    def _body(self, problem: Problem) -> ViscoelasticBody:
        return ConstantPoissonRatio(problem) if self.bulk else ConstantBulkModulus(problem)

    def _memory(self, state: ContactState) -> InternalVariables:
        assert isinstance(state, ViscousState)
        return state.memory

    def start(self, problem: Problem) -> ViscousState:
        """State at rest, with internal variables zero."""
        _check_domain(problem.model, self.bulk)
        empty = InternalVariables.at_rest(self.prony, self._body(problem).size)
        return ViscousState(**vars(super().start(problem)), memory=empty)

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Apply the contact rule once, with the compliance for this time step and the displacement due to the past."""
        assert isinstance(workspace, RelaxationWorkspace)
        assert isinstance(state, ViscousState)
        memory, step = self._memory(state), Step(self.prony, b.time_s - a.time_s)
        body = self._body(problem).respond(step, memory, workspace)
        own, springs = body.compliance, problem.inclusions.bar_stiffness
        first = len(own) - len(springs)
        moved = body.moved
        if len(springs):
            moved = moved + own[:, first:] @ spring_forces(own, springs, moved)
        c, d = len(problem.surface.nodes), problem.dim
        past = np.zeros(c * d)
        past[problem.system.active_dofs] = moved[: len(problem.system.active_dofs)]
        # an elastic object does not relax
        rest = problem.delassus - scatter_to_points(
            stiffened(problem.body.condensed.compliance, springs), problem.system.active_dofs, c, d
        )
        compliance = scatter_to_points(stiffened(own, springs), problem.system.active_dofs, c, d) + rest
        found = solve_increment(problem, state, a, b, LinearBody(compliance, past.reshape(c, d)), guess, workspace)
        if found.state is state:
            return found
        rows = problem.row_forces(problem.upright_force(found.state))
        if len(springs):
            rows[first:] = spring_forces(own, springs, body.moved + own @ rows)
        after = ViscousState(**vars(found.state), memory=step.after(memory, body.shape(rows)))
        return ContactSolution(after, found.outcome, found.residual, found.iterations, found.method)

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """Yield the unknowns of each state from its internal variables."""
        return (self._body(problem).unknowns(self._memory(state).elastic) for state in states)

    def readings(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Return the readings from the internal variables by their rows; pressures are those of the relaxed stress."""
        first, body, memory = len(problem.system.active_dofs), self._body(problem), self._memory(state)
        rows = body.read(memory.elastic)[first:]
        found = dict(zip(problem.model.reading_names, map(float, rows), strict=False))
        if problem.model.taxels:
            forces = body.nodal_forces(self.prony, memory)
            meshed, u = problem.meshed_body, np.zeros((0, problem.dim))
            found |= {t.name: float(t.at_finite_strain(meshed, u, forces)[0]) for t in problem.model.taxels}
        return found

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and relaxed stress."""
        unknowns = self.unknowns(problem, state)
        strain, _ = problem.strain_and_stress(unknowns)
        return displacement(problem.mesh, unknowns), strain, self._body(problem).stress(self.prony, self._memory(state))


@dataclass(frozen=True)
class PronySeries:
    """Relaxation by a Prony series; the attributes are those of `finger3d.mechanics.relaxation.Relaxation`."""

    prony: Prony
    bulk: bool

    def small_strain(self) -> Viscoelastic:
        """Return linear viscoelasticity."""
        return Viscoelastic(self.prony, self.bulk)


def _check_domain(model: Model, bulk: bool) -> None:
    if model.domain == "plane-stress" and not bulk:
        raise Finger3dError(
            "effects.viscosity.bulk = false: not in plane stress, where the thickness follows neither modulus alone; "
            'set bulk = true, or model.domain = "plane-strain" or "solid"'
        )


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.viscosity].

    Attributes
    ----------
    prony : (relative modulus, time in s) of every branch; the rest is the long-time modulus
    bulk : whether the bulk modulus relaxes too, so that nu is constant; else only the shear modulus does
    """

    slot: ClassVar[str] = "relaxation"

    prony: Annotated[tuple[tuple[Fraction, Seconds], ...], MinLen(1)]
    bulk: bool = True

    def __post_init__(self) -> None:
        """Refuse a series whose long-time modulus is negative by more than round-off in a data sheet."""
        if self._total > 1.0 + _ROUNDING:
            raise Finger3dError(
                f"prony: the relative moduli sum to {self._total:.6g}; must be below 1, the rest is the long-time "
                "modulus"
            )

    @property
    def _total(self) -> float:
        return math.fsum(share for share, _ in self.prony)

    def apply(self, model: Model) -> Model:
        """Set the formulation of the model; every leg needs a duration."""
        most = 1.0 - _LEAST_LONG_TIME
        scale = min(most / self._total, 1.0)
        prony = tuple((share * scale, time) for share, time in self.prony)
        if scale < 1.0:
            model = warn(
                model,
                f"effects.viscosity.prony: the relative moduli sum to {self._total:.6g}, taken as rounded: they are "
                f"scaled to {most:g}, and almost nothing is left of E at long times",
            )
        model = fill(model, "relaxation", PronySeries(prony, self.bulk), "viscosity")
        timeless = [i for i, leg in enumerate(model.legs) if leg.duration_s is None]
        if timeless:
            which = f"press.leg.{timeless[0]}.duration_s" if len(model.legs) > 1 else "press.duration_s"
            raise Finger3dError(f"{which} is missing: with effects.viscosity every leg needs its duration in seconds")
        _check_domain(model, self.bulk)
        return model
