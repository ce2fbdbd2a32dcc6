"""The finger's body at finite strain: a hyperelastic solid with embedded bars, whose stresses may relax."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.assembly import Pattern, Stiffness
from finger3d.fem.laws.base import Inhomogeneous
from finger3d.fem.laws.relaxation import InternalVariables, Relaxation, Step
from finger3d.fem.laws.stability import least_stiffness, unstable_from
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.solids.bars import BarRelaxation, Bars
from finger3d.fem.solids.hyperelastic import Hyperelastic, Relaxing, TotalLagrangian
from finger3d.mechanics.discretise.problem import Problem


@dataclass(frozen=True)
class FiniteBody:
    """Hyperelastic solid and embedded bars, with the relaxation of one increment of time.

    Attributes
    ----------
    contact_rows : (r, n d) sparsity pattern of the contact rows
    relaxing, bars_relaxing : None without relaxation
    """

    solid: TotalLagrangian
    bars: Bars | None
    contact_rows: sp.csr_matrix
    relaxing: Relaxing | None = None
    bars_relaxing: BarRelaxation | None = None

    @classmethod
    def of(cls, problem: Problem, material: Hyperelastic) -> FiniteBody:
        """Return the body of a problem; the tangent has places for what contact and bars couple."""
        face, d = problem.surface, problem.dim
        coupled = sp.csr_matrix((face.average != 0).astype(float) @ (face.interpolate != 0).astype(float))
        pairs = (coupled.T @ coupled).tocoo()
        rows = sp.kron(coupled, np.ones((d, d)), format="csr")[problem.system.active_dofs]
        rows.sort_indices()
        linked = pairs.row.astype(np.int64), pairs.col.astype(np.int64)
        bars = problem.inclusions.bars
        if bars is not None:
            first, second = bars.coupled_nodes
            linked = np.concatenate([linked[0], first]), np.concatenate([linked[1], second])
        pattern = Pattern.of(problem.mesh, material.mixed, linked)
        return cls(TotalLagrangian(problem.mesh, material, problem.body.thickness, pattern), bars, rows)

    def over(self, relaxation: Relaxation, memory: InternalVariables, seconds: float) -> FiniteBody:
        """Return the body over an increment of time that begins with these internal variables."""
        step = Step(relaxation.prony, seconds)
        past, bars = step.history_load(memory), 0 if self.bars is None else len(self.bars.stiffness)
        solid = past[: len(past) - bars].reshape(-1, 3, 3)
        return replace(
            self,
            relaxing=Relaxing(step.alpha, step.alpha if relaxation.bulk else 1.0, solid),
            bars_relaxing=BarRelaxation(step.alpha, past[len(past) - bars :]) if bars else None,
        )

    @property
    def points(self) -> int:
        """Number of quadrature points of the solid."""
        return len(self.solid.slopes(np.zeros(self.solid.mesh.points.size)))

    def relaxing_variables(self, x: Float, bulk: bool) -> Float:
        """Return the relaxing quantities (k,): elastic stresses of the solid, and strains of the bars' surroundings."""
        stress = self.solid.elastic_stress(x, self.relaxing, bulk).ravel()
        if self.bars is None:
            return stress
        return np.concatenate([stress, self.bars.yielded(displacement(self.solid.mesh, x), self.bars_relaxing)])

    def internal_forces(self, x: Float) -> Float:
        """Return the internal forces (N,); raises InvertedError."""
        force = self.solid.internal_forces(x, self.relaxing)
        if self.bars is not None:
            u = displacement(self.solid.mesh, x)
            force[: u.size] += self.bars.forces(u, self.bars_relaxing)
        return force

    def tangent(self, x: Float) -> Stiffness:
        """Return the derivative of the internal forces; raises InvertedError."""
        tangent = self.solid.tangent(x, self.relaxing)
        if self.bars is None:
            return tangent
        return tangent.less(-self.bars.tangent(displacement(self.solid.mesh, x), self.bars_relaxing))

    def instability(self, x: Float) -> str:
        """Return where the material law is unstable, in words; empty if it is stable."""
        law = self.solid.material.law
        if isinstance(law, Inhomogeneous):
            law = law.law  # the strains at which a law is unstable do not depend on its shear modulus
        if law.is_stable:
            return ""
        f = self.solid.deformation(x, self.relaxing)
        stretches = np.asarray(np.linalg.svd(f, compute_uv=False)[:, ::-1], dtype=np.float64)
        stiffness = least_stiffness(law, stretches)
        if (stiffness > 0.0).all():
            return ""
        reached = ", ".join(f"{stretch:.3g}" for stretch in stretches[stiffness.argmin()])
        limits = (f"{strain:.3g} in {mode}" for mode, strain in unstable_from(law).items())
        return f"principal stretches reach {reached}; the stress falls from nominal strains of {', '.join(limits)}"
