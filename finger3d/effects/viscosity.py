"""Viscoelasticity: moduli that relax as a Prony series r(t) = 1 - sum g_i (1 - exp(-t/tau_i)), E_MPa at t = 0.

With ``bulk`` Poisson's ratio is constant and everything follows from the instantaneous compliance C.  Let f_e be the
row forces that would hold the present shape of the elastic body, u = K^-1 B^T f_e; then f = r * f_e', that is
``f = r_inf f_e + sum h_i`` with ``h_i' = e_i h_i + g_i gamma_i (f_e' - f_e)``, e_i = exp(-dt/tau_i) and
gamma_i = (1 - e_i) tau_i/dt: exact where f_e moves at a constant rate within the step (Taylor, Pister and Goudreau
1970).  So ``f_e' = (f + past)/alpha``, alpha = r_inf + sum g_i gamma_i: the contact rule sees the compliance C/alpha
and points that the past has moved.  f_e lives on all contact points: an open one has f = 0 and yet creeps back.

Without ``bulk`` only the shear modulus relaxes.  The same holds of the shear part K_s of K = K_b + K_s, with the whole
displacement in place of f_e: one factorisation of K_b + alpha K_s for each length of step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol

import numpy as np
import scipy.sparse as sp
from annotated_types import MinLen

from finger3d._ranges import Fraction, Seconds
from finger3d._types import Float
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.effects._prony import InternalVariables, Prony, Step, relaxed
from finger3d.effects._relaxation import RelaxationWorkspace
from finger3d.effects.base import fill
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.condense import spring_forces, stiffened
from finger3d.fem.material import Elasticity
from finger3d.fem.recover import across, displacement, nodal_strain, pressure, stress
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.linear_contact import LinearBody, LinearState, solve_increment
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem, scatter_to_points
from finger3d.mechanics.small_strain import SmallStrain
from finger3d.objects import ObjectPose


@dataclass(frozen=True)
class Response:
    """Response of the condensed rows of a body over one step.

    Attributes
    ----------
    compliance : (r, r) mm/N
    moved : (r,) mm
        Where the past takes the rows under no force.
    shape : row forces (r,) -> the memory's vector `now`
    """

    compliance: Float
    moved: Float
    shape: Callable[[Float], Float]


class ViscoelasticBody(Protocol):
    """A viscoelastic body with internal variables."""

    @property
    def size(self) -> int:
        """Number of internal variables of a branch."""
        ...

    def respond(self, step: Step, memory: InternalVariables, workspace: RelaxationWorkspace) -> Response:
        """Return the response of the rows over a step."""
        ...

    def unknowns(self, now: Float) -> Float:
        """Return all unknowns (N,) of a shape, with the pressures of the instantaneous modulus."""
        ...

    def read(self, now: Float) -> Float:
        """Return the row displacements (r,) of a shape."""
        ...

    def stress(self, prony: Prony, memory: InternalVariables) -> Float:
        """Nodal stress (n, 3, 3), or (n, 2, 2) and (n,) across the section."""
        ...


@dataclass(frozen=True)
class ConstantPoissonRatio:
    """Constant Poisson's ratio; internal variables are the row forces that hold a shape of the elastic body."""

    problem: Problem

    @property
    def size(self) -> int:
        """Number of condensed rows."""
        return len(self.problem.part.condensed.compliance)

    def respond(self, step: Step, memory: InternalVariables, workspace: RelaxationWorkspace) -> Response:
        """The instantaneous compliance over alpha."""
        past, alpha = step.history_load(memory), step.alpha
        compliance = self.problem.part.condensed.compliance / alpha
        return Response(compliance, compliance @ past, lambda rows: (rows + past) / alpha)

    def unknowns(self, now: Float) -> Float:
        """Return the unknowns by a back-substitution."""
        return self.problem.part.condensed.unknowns(now)

    def read(self, now: Float) -> Float:
        """Return the row displacements by the compliance."""
        return self.problem.part.condensed.compliance @ now

    def stress(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the stress of the elastic body under the relaxed forces."""
        problem = self.problem
        unknowns = self.unknowns(relaxed(prony, memory))
        strain = nodal_strain(problem.mesh, displacement(problem.mesh, unknowns))
        p = pressure(problem.mesh, problem.part.stiffness, unknowns) if problem.part.elastic.mixed else None
        return stress(strain, problem.part.elastic, p)


@dataclass(frozen=True)
class ConstantBulkModulus:
    """Constant bulk modulus; internal variables are displacements and, in the mixed form, vertex dilatations.

    The subgrid compliance of inclusions acts on their row forces, and relaxes as if nu were constant.
    """

    problem: Problem

    @property
    def _own(self) -> int:
        return int(self.problem.part.stiffness.upper.shape[0])

    @property
    def size(self) -> int:
        """Number of unknowns, and of rows that yield beyond the mesh."""
        return self._own + len(self.problem.inclusions.subgrid_compliance)

    @property
    def _elastic(self) -> Elasticity:
        return self.problem.model.material.isotropic("effects.viscosity.bulk = false").elasticity()

    @property
    def _bulk(self) -> float:
        return self._elastic.lame + 2.0 / 3.0 * self._elastic.shear

    def _lame(self, alpha: float) -> float:
        return self._bulk - 2.0 / 3.0 * alpha * self._elastic.shear

    def respond(self, step: Step, memory: InternalVariables, workspace: RelaxationWorkspace) -> Response:
        """Return the response of the body with its shear modulus multiplied by alpha, loaded by the past."""
        # steps of one length differ by round-off of their ends
        alpha = Step(step.prony, float(f"{step.seconds:.12g}")).alpha
        problem = self.problem
        body = workspace.condensation(alpha, lambda: problem.part.condensed.again(self._stiffness(alpha, workspace)))
        past, first = step.history_load(memory), len(body.compliance) - len(problem.inclusions.subgrid_compliance)
        settled = body.solve(self._shear_force(past[: self._own], workspace))
        compliance, moved = body.compliance.copy(), body.read(settled)
        compliance[first:, first:] += problem.inclusions.subgrid_compliance / alpha
        moved[first:] += problem.inclusions.subgrid_compliance @ past[self._own :] / alpha

        def shape(rows: Float) -> Float:
            found = settled + body.unknowns(rows)
            found[problem.mesh.points.size :] *= problem.part.stiffness.pressure_scale / self._lame(alpha)
            return np.concatenate([found, (rows[first:] + past[self._own :]) / alpha])

        return Response(compliance, moved, shape)

    def _shear_part(self, workspace: RelaxationWorkspace) -> sp.csr_matrix:
        """Return the deviatoric stiffness K_s of the displacement form; in a section, that in its plane."""
        if workspace.shear_part is None:
            problem, shear = self.problem, self._elastic.shear
            part = Elasticity(shear, -2.0 / 3.0 * shear, False)
            workspace.shear_part = stiffness(problem.mesh, part, problem.part.thickness).upper
        return workspace.shear_part

    def _stiffness(self, alpha: float, workspace: RelaxationWorkspace) -> Stiffness:
        """Return K_b + alpha K_s; in the mixed form every block has a factor of its own."""
        problem = self.problem
        whole: Stiffness = problem.part.stiffness
        if not problem.part.elastic.mixed:
            return Stiffness(whole.upper - (1.0 - alpha) * self._shear_part(workspace), whole.pressure_vertices, 1.0)
        upper, n = whole.upper.copy(), problem.mesh.points.size
        row = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
        upper.data[upper.indices < n] *= alpha
        upper.data[row >= n] *= self._elastic.lame / self._lame(alpha)
        return Stiffness(upper, whole.pressure_vertices, whole.pressure_scale)

    def _shear_force(self, shape: Float, workspace: RelaxationWorkspace) -> Float:
        """Return the loads (N,), K_s times a shape (N,)."""
        problem, n = self.problem, self.problem.mesh.points.size
        if not problem.part.elastic.mixed:
            return _times(self._shear_part(workspace), shape)
        deviator = shape.copy()
        deviator[n:] *= -2.0 / 3.0 * self._elastic.shear / problem.part.stiffness.pressure_scale
        load = _times(problem.part.stiffness.upper, deviator)
        load[n:] = 0.0
        return load

    def unknowns(self, now: Float) -> Float:
        """Return the displacements, which are the shape."""
        n = self.problem.mesh.points.size
        out = now[: self._own].copy()
        out[n:] *= self._elastic.lame / self.problem.part.stiffness.pressure_scale
        return out

    def read(self, now: Float) -> Float:
        """Return the row displacements, with the compliance that the mesh lacks."""
        rows, beyond = self.problem.part.condensed.read(now[: self._own]), self.problem.inclusions.subgrid_compliance
        rows[len(rows) - len(beyond) :] += beyond @ now[self._own :]
        return rows

    def stress(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the stress (n, 3, 3): 2 G dev(eps) relaxed, and the bulk modulus times the dilatation."""
        shear, left = self._elastic.shear, relaxed(prony, memory)
        strain, swelling = self._strain(left[: self._own])
        spherical = self._bulk * self._strain(memory.elastic[: self._own])[1] - 2.0 / 3.0 * shear * swelling
        d = self.problem.dim
        whole = np.zeros((len(strain), 3, 3))
        whole[:, :d, :d] = 2.0 * shear * strain
        return whole + spherical[:, None, None] * np.eye(3)

    def _strain(self, shape: Float) -> tuple[Float, Float]:
        problem = self.problem
        strain = nodal_strain(problem.mesh, displacement(problem.mesh, shape))
        if not problem.part.elastic.mixed:
            return strain, np.trace(strain, axis1=1, axis2=2)
        return strain, pressure(problem.mesh, problem.part.stiffness, shape) / problem.part.stiffness.pressure_scale


def _times(upper: sp.csr_matrix, vector: Float) -> Float:
    """Return the product of a symmetric matrix, given by its upper triangle, and a vector."""
    return np.asarray(upper @ vector + upper.T @ vector - upper.diagonal() * vector)


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
        size = self._body(problem).size
        empty = InternalVariables(np.zeros(size), np.zeros((len(self.prony), size)))
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
            stiffened(problem.part.condensed.compliance, springs), problem.system.active_dofs, c, d
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

    def gauges(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Return the strains from the internal variables by the rows of the gauges."""
        first = len(problem.system.active_dofs)
        rows = self._body(problem).read(self._memory(state).elastic)[first:]
        return {g.name: float(strain) for g, strain in zip(problem.model.gauges, rows, strict=False)}

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and relaxed stress."""
        u = displacement(problem.mesh, self.unknowns(problem, state))
        strain = nodal_strain(problem.mesh, u)
        sigma = self._body(problem).stress(self.prony, self._memory(state))
        if problem.dim == 3:
            return u, strain, sigma
        material, plane_strain = problem.model.material, problem.model.domain == "plane-strain"
        whole = across(strain, sigma[:, :2, :2], material, plane_strain)
        return u, whole[0], (whole[1] if self.bulk else sigma)


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

    slot: ClassVar[str] = "formulation"

    prony: Annotated[tuple[tuple[Fraction, Seconds], ...], MinLen(1)]
    bulk: bool = True

    def __post_init__(self) -> None:
        """Refuse a series whose long-time modulus is not positive."""
        total = math.fsum(share for share, _ in self.prony)
        if total >= 1.0 - 1e-12:
            raise Finger3dError(
                f"prony: the relative moduli sum to {total:.6g}; must be below 1, the rest is the long-time modulus"
            )

    def apply(self, model: Model) -> Model:
        """Set the formulation of the model; every leg needs a duration."""
        prony = tuple((share, time) for share, time in self.prony)
        model = fill(model, "formulation", Viscoelastic(prony, self.bulk), "viscosity")
        timeless = [i for i, leg in enumerate(model.legs) if leg.duration_s is None]
        if timeless:
            which = f"press.leg.{timeless[0]}.duration_s" if len(model.legs) > 1 else "press.duration_s"
            raise Finger3dError(f"{which} is missing: with effects.viscosity every leg needs its duration in seconds")
        _check_domain(model, self.bulk)
        return model
