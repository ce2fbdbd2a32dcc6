"""Small strain with moduli that relax as a Prony series r(t) = 1 - sum g_i (1 - exp(-t/tau_i)).

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

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.contact.state import ContactSolution
from finger3d.fem.assembly import Stiffness, stiffness, times
from finger3d.fem.laws.material import Elasticity, ElasticityByPart
from finger3d.fem.laws.relaxation import InternalVariables, Prony, Relaxation, Step, relaxed
from finger3d.fem.mesh import MeshPart
from finger3d.fem.recovery import averaged, displacement, nodal_pressure, nodal_strain
from finger3d.fem.solvers.condense import Condensation, spring_forces, stiffened
from finger3d.fem.surface import BoundarySurface
from finger3d.mechanics.discretise.problem import Problem, scatter_to_points
from finger3d.mechanics.formulation import Loads, Workspace
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.history import State
from finger3d.mechanics.readings import Column, of_kind
from finger3d.mechanics.small_strain import LinearBody, at_rest, increment_of, linear_gap, linear_loads
from finger3d.objects import Move, ObjectPose

_FACTORS_KEPT = 5
"""Number of condensations kept, each with a factor: few paths have more than two lengths of step beside three parts."""


@dataclass
class RelaxationWorkspace(Workspace):
    """Condensed bodies for the last time steps, by alpha, and the shear part of the stiffness."""

    shear_part: sp.csr_matrix | None = None
    _condensations: dict[float, Condensation] = field(default_factory=dict)

    def condensation(self, alpha: float, make: Callable[[], Condensation]) -> Condensation:
        """Return the condensation for alpha, made unless it is one of the last few."""
        condensation = self._condensations.pop(alpha, None)
        if condensation is None:
            condensation = make()
            self.factorizations += condensation.factorizations
        self._condensations[alpha] = condensation
        if len(self._condensations) > _FACTORS_KEPT:
            self._condensations.pop(next(iter(self._condensations)))
        return condensation


@dataclass(frozen=True)
class Response:
    """Response of the condensed rows of a body over one step.

    Attributes
    ----------
    compliance : (r, r) mm/N
    moved : (r,) mm
        Displacement of the rows due to the past, without forces.
    shape : row forces (r,) -> the memory's vector `now`
    """

    compliance: Float
    moved: Float
    shape: Callable[[Float], Float]


@dataclass(frozen=True)
class ConstantPoissonRatio:
    """Constant Poisson's ratio; internal variables are the row forces that hold a shape of the elastic body."""

    problem: Problem

    @property
    def size(self) -> int:
        """Number of condensed rows."""
        return len(self.problem.body.condensed.compliance)

    def respond(self, step: Step, memory: InternalVariables, workspace: RelaxationWorkspace) -> Response:
        """The instantaneous compliance over alpha."""
        past, alpha = step.history_load(memory), step.alpha
        compliance = self.problem.body.condensed.compliance / alpha
        return Response(compliance, compliance @ past, lambda rows: (rows + past) / alpha)

    def unknowns(self, now: Float) -> Float:
        """Return the unknowns by a back-substitution."""
        return self.problem.body.condensed.unknowns(now)

    def read(self, now: Float) -> Float:
        """Return the row displacements by the compliance."""
        return self.problem.body.condensed.compliance @ now

    def stress(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the stress of the elastic body under the relaxed forces."""
        return self.problem.strain_and_stress(self.unknowns(relaxed(prony, memory)))[1]

    def nodal_forces(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the nodal forces of the elastic body under the relaxed row forces."""
        mesh = self.problem.mesh
        forces = times(self.problem.body.stiffness.upper, self.unknowns(relaxed(prony, memory)))
        return forces[: mesh.points.size].reshape(-1, mesh.dim)


@dataclass(frozen=True)
class ConstantBulkModulus:
    """Constant bulk modulus; internal variables are displacements and, in the mixed form, vertex dilatations.

    The subgrid compliance of inclusions acts on their row forces, and relaxes as if nu were constant.
    """

    problem: Problem

    @property
    def _own(self) -> int:
        return int(self.problem.body.stiffness.upper.shape[0])

    @property
    def size(self) -> int:
        """Number of unknowns, plus that of the rows with a subgrid compliance."""
        return self._own + len(self.problem.inclusions.subgrid_compliance)

    @cached_property
    def _laws(self) -> list[Elasticity]:
        """Laws of the parts by their number."""
        problem = self.problem
        materials = problem.model.materials(problem.mesh.part_labels)
        return [material.elasticity(mixed=problem.body.elastic.mixed) for material in materials]

    @cached_property
    def _of_pressures(self) -> tuple[Float, Float]:
        """Shear modulus and Lame's first constant (p,), MPa, of the part that each pressure belongs to."""
        mesh = self.problem.mesh
        number = np.zeros(len(mesh.part_corners[0]), dtype=np.int64)
        for part in mesh.by_part:
            number[part.corners] = part.number
        constants = np.array([[law.shear, law.lame] for law in self._laws])[number]
        return constants[:, 0], constants[:, 1]

    def _lame(self, alpha: float) -> Float:
        """Return Lame's first constant (p,) with the shear modulus multiplied by alpha."""
        shear, lame = self._of_pressures
        return np.asarray(lame + 2.0 / 3.0 * (1.0 - alpha) * shear)

    def condensed(self, step: Step, workspace: RelaxationWorkspace) -> tuple[float, Condensation]:
        """Return alpha of a step, and the body with its shear modulus multiplied by alpha."""
        # steps of one length differ by round-off of their ends
        alpha, own = Step(step.prony, float(f"{step.seconds:.12g}")).alpha, self.problem.body.condensed
        return alpha, workspace.condensation(alpha, lambda: own.again(self._stiffness(alpha, workspace)))

    def respond(self, step: Step, memory: InternalVariables, workspace: RelaxationWorkspace) -> Response:
        """Return the response of the body with its shear modulus multiplied by alpha, loaded by the past."""
        problem, (alpha, body) = self.problem, self.condensed(step, workspace)
        past, first = step.history_load(memory), len(body.compliance) - len(problem.inclusions.subgrid_compliance)
        settled = body.solve(self._shear_force(past[: self._own], workspace))
        compliance, moved = body.compliance.copy(), body.read(settled)
        compliance[first:, first:] += problem.inclusions.subgrid_compliance / alpha
        moved[first:] += problem.inclusions.subgrid_compliance @ past[self._own :] / alpha

        def shape(rows: Float) -> Float:
            unknowns = self.shape(settled + body.unknowns(rows), alpha)
            return np.concatenate([unknowns, (rows[first:] + past[self._own :]) / alpha])

        return Response(compliance, moved, shape)

    def shape(self, unknowns: Float, alpha: float) -> Float:
        """Return displacements and dilatations (N, ...) of unknowns of the body with its shear modulus times alpha."""
        return self._scaled(unknowns, alpha, -1)

    def internal_forces(
        self, step: Step, memory: InternalVariables, now: Float, workspace: RelaxationWorkspace
    ) -> Float:
        """Return the internal forces (N,) at the end of a step with the internal variables `now`."""
        forces = times(self._stiffness(step.alpha, workspace).upper, self._scaled(now[: self._own], step.alpha, 1))
        return forces - self._shear_force(step.history_load(memory)[: self._own], workspace)

    def _scaled(self, values: Float, alpha: float, power: int) -> Float:
        """Multiply pressures or dilatations (N, ...) by a power of Lame's first constant."""
        out, n = values.copy(), self.problem.mesh.points.size
        if self.problem.body.elastic.mixed:
            out[n:] = (out[n:].T * (self._lame(alpha) / self.problem.body.stiffness.pressure_scale) ** power).T
        return out

    def _shear_part(self, workspace: RelaxationWorkspace) -> sp.csr_matrix:
        """Return the deviatoric stiffness K_s of the displacement form; in a section, that in its plane."""
        if workspace.shear_part is None:
            problem, mesh = self.problem, self.problem.mesh
            laws = tuple(Elasticity(law.shear, -2.0 / 3.0 * law.shear, False) for law in self._laws)
            deviatoric = laws[0] if mesh.part is None else ElasticityByPart(laws, mesh.part)
            workspace.shear_part = stiffness(mesh, deviatoric, problem.body.thickness).upper
        return workspace.shear_part

    def _stiffness(self, alpha: float, workspace: RelaxationWorkspace) -> Stiffness:
        """Return K_b + alpha K_s; in the mixed form every block has a factor of its own."""
        problem = self.problem
        whole: Stiffness = problem.body.stiffness
        if not problem.body.elastic.mixed:
            return Stiffness(whole.upper - (1.0 - alpha) * self._shear_part(workspace), whole.pressure_vertices, 1.0)
        upper, n = whole.upper.copy(), problem.mesh.points.size
        row = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
        upper.data[upper.indices < n] *= alpha
        of_pressure = row >= n
        upper.data[of_pressure] *= (self._of_pressures[1] / self._lame(alpha))[row[of_pressure] - n]
        return Stiffness(upper, whole.pressure_vertices, whole.pressure_scale)

    def _shear_force(self, shape: Float, workspace: RelaxationWorkspace) -> Float:
        """Return the loads (N,), K_s times a shape (N,)."""
        problem, n = self.problem, self.problem.mesh.points.size
        if not problem.body.elastic.mixed:
            return times(self._shear_part(workspace), shape)
        deviator = shape.copy()
        deviator[n:] *= -2.0 / 3.0 * self._of_pressures[0] / problem.body.stiffness.pressure_scale
        load = times(problem.body.stiffness.upper, deviator)
        load[n:] = 0.0
        return load

    def unknowns(self, now: Float) -> Float:
        """Return the displacements, which are the shape."""
        return self._scaled(now[: self._own], 1.0, 1)

    def read(self, now: Float) -> Float:
        """Return the row displacements, with the compliance that the mesh lacks."""
        rows, beyond = self.problem.body.condensed.read(now[: self._own]), self.problem.inclusions.subgrid_compliance
        rows[len(rows) - len(beyond) :] += beyond @ now[self._own :]
        return rows

    def stress(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the stress (n, 3, 3): 2 G dev(eps) relaxed, and the bulk modulus times the dilatation."""
        mesh, d = self.problem.mesh, self.problem.dim
        left, now = relaxed(prony, memory)[: self._own], memory.elastic[: self._own]

        def of_part(part: MeshPart) -> tuple[Float]:
            law = self._laws[part.number]
            strain, swelling = self._strain(part, left)
            bulk = law.lame + 2.0 / 3.0 * law.shear
            spherical = bulk * self._strain(part, now)[1] - 2.0 / 3.0 * law.shear * swelling
            whole = np.zeros((len(strain), 3, 3))
            whole[:, :d, :d] = 2.0 * law.shear * strain
            return (whole + spherical[:, None, None] * np.eye(3),)

        return averaged(mesh, of_part)[0]

    def nodal_forces(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the instantaneous nodal forces, less the part of the shear stress that has relaxed."""
        mesh, lost = self.problem.mesh, memory.elastic - relaxed(prony, memory)
        forces = times(self.problem.body.stiffness.upper, self.unknowns(memory.elastic))
        forces -= self._shear_force(lost[: self._own], RelaxationWorkspace())
        return forces[: mesh.points.size].reshape(-1, mesh.dim)

    def _strain(self, part: MeshPart, shape: Float) -> tuple[Float, Float]:
        """Return strain (n', d, d) and dilatation (n',) of a shape at the nodes of a part."""
        mesh = self.problem.mesh
        strain = nodal_strain(part.mesh, displacement(mesh, shape)[part.nodes])
        if not self.problem.body.elastic.mixed:
            return strain, np.trace(strain, axis1=1, axis2=2)
        return strain, nodal_pressure(part.mesh, shape[mesh.points.size :][part.corners])


@dataclass(frozen=True)
class ViscousBody:
    """State of a relaxing body in small strain.

    Attributes
    ----------
    displacement : (c, d) mm of the contact points, in x, y, z
    memory : internal variables of the meshed part
    """

    displacement: Float
    memory: InternalVariables


@dataclass(frozen=True)
class Viscoelastic:
    """Small strain with relaxing moduli."""

    relaxation: Relaxation

    def workspace(self) -> RelaxationWorkspace:
        """Return a workspace without a factor."""
        return RelaxationWorkspace()

    def body(self, problem: Problem) -> ConstantPoissonRatio | ConstantBulkModulus:
        """Return the body of a problem."""
        return ConstantPoissonRatio(problem) if self.relaxation.bulk else ConstantBulkModulus(problem)

    def start(self, problem: Problem) -> State[ViscousBody]:
        """Return the state at rest, with internal variables zero."""
        self.relaxation.check_domain(problem.model.domain)
        empty = InternalVariables.at_rest(self.relaxation.prony, self.body(problem).size)
        return State(at_rest(problem), ViscousBody(np.zeros_like(problem.surface.points), empty))

    def increment(
        self,
        problem: Problem,
        state: State[ViscousBody],
        move: Move,
        guess: Float | None,
        workspace: RelaxationWorkspace,
        wanted: GeneralisedForces | None = None,
    ) -> ContactSolution[State[ViscousBody]]:
        """Apply the contact rule once, with the compliance for this time step and the displacement due to the past."""
        memory, step = state.body.memory, Step(self.relaxation.prony, move.duration_s)
        body, linear = self.respond(problem, memory, step, workspace)
        before = State(state.contact, state.body.displacement, state.last)
        solution = increment_of(problem, before, move, linear, workspace, wanted).solve(guess)
        if solution.state is before:
            return solution.with_state(state)
        contact = problem.row_forces(problem.upright_force(solution.state.contact))
        rows = problem.inclusions.with_spring_forces(body.compliance, contact, body.moved)
        after = ViscousBody(solution.state.body, step.after(memory, body.shape(rows)))
        return solution.with_state(State(solution.state.contact, after, solution.state.last))

    def respond(
        self, problem: Problem, memory: InternalVariables, step: Step, workspace: RelaxationWorkspace
    ) -> tuple[Response, LinearBody]:
        """Return the response of the condensed rows over a step, and of the contact points with what else there is."""
        body, springs = self.body(problem).respond(step, memory, workspace), problem.inclusions.bar_stiffness
        condensed, moved = body.compliance, body.moved
        first = len(condensed) - len(springs)
        if len(springs):
            moved = moved + condensed[:, first:] @ spring_forces(condensed, springs, moved)
        active, size = problem.system.active_dofs, problem.surface.points.shape
        past = np.zeros(size)
        past.flat[active] = moved[: len(active)]
        at_first, now = (stiffened(rows, springs) for rows in (problem.body.condensed.compliance, condensed))
        rest = problem.delassus - scatter_to_points(at_first, active, *size)  # an elastic object does not relax
        return body, LinearBody(scatter_to_points(now, active, *size) + rest, past)

    def unknowns(self, problem: Problem, states: Sequence[State[ViscousBody]]) -> Iterator[Float]:
        """Yield the unknowns of each state from its internal variables."""
        return (self.body(problem).unknowns(state.body.memory.elastic) for state in states)

    def readings(self, problem: Problem, state: State[ViscousBody]) -> dict[Column, float]:
        """Return the readings from the internal variables by their rows; pressures are those of the relaxed stress."""
        first, body, memory = len(problem.system.active_dofs), self.body(problem), state.body.memory
        rows = body.read(memory.elastic)[first:]
        values = dict(zip(problem.model.columns, map(float, rows), strict=False))
        if problem.model.taxels:
            forces = body.nodal_forces(self.relaxation.prony, memory)
            meshed, u = problem.meshed_body, np.zeros((0, problem.dim))
            pressures = (float(t.at_finite_strain(meshed, u, forces)[0]) for t in problem.model.taxels)
            values |= zip(of_kind(problem.model.columns, "taxel"), pressures, strict=True)
        return values

    def loads(self, problem: Problem, state: State[ViscousBody], pose: ObjectPose) -> Loads:
        """Return the forces of the points, at their centroids at rest."""
        return linear_loads(problem, state.contact, state.body.displacement)

    def gap(self, problem: Problem, u: Float, pose: ObjectPose, surface: BoundarySurface) -> tuple[Float, Float]:
        """Return gaps and normals at the displaced points."""
        return linear_gap(problem, u, pose, surface)

    def fields(self, problem: Problem, state: State[ViscousBody]) -> tuple[Float, Float, Float]:
        """Return displacement, linear strain and relaxed stress."""
        unknowns = next(self.unknowns(problem, [state]))
        strain, _ = problem.strain_and_stress(unknowns)
        stress = self.body(problem).stress(self.relaxation.prony, state.body.memory)
        return displacement(problem.mesh, unknowns), strain, stress
