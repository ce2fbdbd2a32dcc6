"""The finger's body at finite strain: a hyperelastic solid with embedded bars, its states and its linearisations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.assembly import Pattern, Stiffness
from finger3d.fem.embedded import BarRelaxation, Bars
from finger3d.fem.hyperelastic import Hyperelastic, Relaxing, TotalLagrangian
from finger3d.fem.laws.base import Inhomogeneous, least_stiffness, unstable_from
from finger3d.fem.laws.relaxation import InternalVariables, Relaxation, Step
from finger3d.fem.recovery import displacement
from finger3d.fem.solvers.condense import Condensation
from finger3d.fem.surface import BoundarySurface, DeformedContact, deformed_contact
from finger3d.fem.tensors import bases_of
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.objects import DistanceTracker, Move, ObjectPose


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


TARGET_RESIDUAL = 5e-9
"""Residual at which the iteration ends; where round-off prevents it, one up to the tolerance that no longer falls."""

_ROUGH = 1e-3
"""Residual of a solution near which others begin."""

_CURVATURE_STEP, _LOCAL_STEP = 0.1, 1e-3
"""Steps of the differences of the object's normals, over the edge length of the mesh: one in which an edge of the
object counts as round, and one that mostly stays on the same facet."""


@dataclass(frozen=True)
class DeformedBody:
    """State of a body at finite strain.

    Attributes
    ----------
    unknowns : (N,) of the meshed part
    memory : internal variables of a body that relaxes
    previous : motion in the increment that led here, and unknowns at its start
    """

    unknowns: Float
    memory: InternalVariables | None = None
    previous: tuple[Move, Float] | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class Linearisation:
    """Body linearised at one configuration: the factored tangent and the compliance of the contact points.

    Attributes
    ----------
    condensation : of the tangent, to the rows of the contact forces, and others along which gaps are read
    reads : (r,) numbers of the rows that tell the displacement along each force
    bases : (c, d, d) directions of the contact points
    delassus : (c, d, c, d) mm/N, in these directions; symmetric beside a rigid object
    turning : (n d, n d) N/mm, geometric stiffness by which nodal contact forces turn with the surface of a curved
        object; None beside a flat one
    reusable : whether an increment may begin with it; otherwise only its sparsity pattern serves
    """

    condensation: Condensation
    reads: Int
    bases: Float
    delassus: Float
    turning: sp.csr_matrix | None = None
    reusable: bool = True

    def rotation(self, bases: Float) -> Float:
        """Return the rotation (c, d, d) from its directions to others (c, d, d)."""
        return bases @ np.swapaxes(self.bases, 1, 2)


@dataclass
class FiniteStrainWorkspace(Workspace):
    """Discretisation and last linearisation of a body, with which its next increment begins.

    Both have two entries: of the body with its inclusions (True) and without.

    Attributes
    ----------
    target : residual at which the iteration of an increment ends
    """

    target: float = TARGET_RESIDUAL
    bodies: dict[bool, FiniteBody] = field(default_factory=dict)
    linearisations: dict[bool, Linearisation] = field(default_factory=dict)

    def beside(self) -> Self:
        """Return a workspace for another body, with the same linearisations."""
        return replace(self, factorizations=0, tracker=DistanceTracker(), bodies={})

    def rough(self) -> Self:
        """Return a workspace for solutions near which others begin, with the same factors and a count of its own."""
        return replace(self, factorizations=0, target=_ROUGH)


def contact_of(problem: Problem, face: BoundarySurface, u: Float, target: ObjectPose) -> DeformedContact:
    """Return the contact of a face displaced by u (n, d) with the object in a pose."""
    distance = problem.placed(target).distance(face.samples + face.interpolate @ u)
    object_share = problem.system.object_share if face is problem.surface else None
    return deformed_contact(face, problem.mesh.points, u, distance, problem.axes, object_share)


def curvature_of(
    problem: Problem, face: BoundarySurface, u: Float, target: ObjectPose, local: bool = False
) -> Float | None:
    """Return the second derivatives (q, d, d) 1/mm of the distance at the samples of a face; None for a flat object.

    They are differences over a fraction of an edge of the mesh, so that an edge of the object counts as round, unless
    those of its facets are asked for, `local`.
    """
    if problem.model.object.is_flat:
        return None
    d, placed = problem.dim, problem.placed(target)
    samples = face.samples + face.interpolate @ u
    tangents = bases_of(placed.distance(samples)[1])[:, 1:]
    out, step = np.zeros((len(samples), d, d)), (_LOCAL_STEP if local else _CURVATURE_STEP) * problem.model.mesh.size_mm
    for t in range(d - 1):
        ahead, behind = (placed.distance(samples + sign * step * tangents[:, t])[1] for sign in (1.0, -1.0))
        turn = np.einsum("qk,qtk->qt", ahead - behind, tangents) / (2.0 * step)
        out += np.einsum("qs,qsi,qj->qij", turn, tangents, tangents[:, t])
    return 0.5 * (out + np.swapaxes(out, 1, 2))
