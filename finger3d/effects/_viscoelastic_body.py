"""Bodies whose moduli relax: the response of their condensed rows over one increment of time, see `viscosity`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.assembly import Stiffness, stiffness, times
from finger3d.fem.condense import Condensation
from finger3d.fem.material import Elasticity
from finger3d.fem.recover import displacement, nodal_strain, pressure, stress
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.relaxation import InternalVariables, Prony, Step, relaxed

_FACTORS_KEPT = 5
"""Number of condensations kept; each holds a factor, and a path rarely has more than four lengths of step."""


@dataclass
class RelaxationWorkspace(Workspace):
    """Condensed bodies for the last time steps, by alpha, and the shear part of the stiffness."""

    shear_part: sp.csr_matrix | None = None
    _condensations: dict[float, Condensation] = field(default_factory=dict)

    def condensation(self, alpha: float, make: Callable[[], Condensation]) -> Condensation:
        """Return the condensation for alpha, made unless it is one of the last few."""
        found = self._condensations.pop(alpha, None)
        if found is None:
            found = make()
            self.factorizations += found.factorizations
        self._condensations[alpha] = found
        if len(self._condensations) > _FACTORS_KEPT:
            self._condensations.pop(next(iter(self._condensations)))
        return found


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

    def nodal_forces(self, prony: Prony, memory: InternalVariables) -> Float:
        """Nodal forces (n, d) of the relaxed stress."""
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

    def nodal_forces(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the nodal forces of the elastic body under the relaxed row forces."""
        mesh = self.problem.mesh
        forces = times(self.problem.part.stiffness.upper, self.unknowns(relaxed(prony, memory)))
        return forces[: mesh.points.size].reshape(-1, mesh.dim)


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
            return times(self._shear_part(workspace), shape)
        deviator = shape.copy()
        deviator[n:] *= -2.0 / 3.0 * self._elastic.shear / problem.part.stiffness.pressure_scale
        load = times(problem.part.stiffness.upper, deviator)
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

    def nodal_forces(self, prony: Prony, memory: InternalVariables) -> Float:
        """Return the instantaneous nodal forces, less the part of the shear stress that has relaxed."""
        mesh, lost = self.problem.mesh, memory.elastic - relaxed(prony, memory)
        forces = times(self.problem.part.stiffness.upper, self.unknowns(memory.elastic))
        forces -= self._shear_force(lost[: self._own], RelaxationWorkspace())
        return forces[: mesh.points.size].reshape(-1, mesh.dim)

    def _strain(self, shape: Float) -> tuple[Float, Float]:
        problem = self.problem
        strain = nodal_strain(problem.mesh, displacement(problem.mesh, shape))
        if not problem.part.elastic.mixed:
            return strain, np.trace(strain, axis1=1, axis2=2)
        return strain, pressure(problem.mesh, problem.part.stiffness, shape) / problem.part.stiffness.pressure_scale
