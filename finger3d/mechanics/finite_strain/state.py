"""States and linearisations of a body at finite strain, and the geometry of its contact."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.laws.relaxation import InternalVariables
from finger3d.fem.solvers.condense import Condensation
from finger3d.fem.surface.finite_contact import DeformedContact, deformed_contact
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.fem.tensors import bases_of
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.finite_strain.body import FiniteBody
from finger3d.mechanics.formulation import Workspace
from finger3d.objects import DistanceTracker, Move, ObjectPose

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
    gap, normal = problem.placed(target).distance(face.samples + face.interpolate @ u)
    return deformed_contact(
        face,
        points=problem.mesh.points,
        displacement=u,
        gap=gap,
        normal=normal,
        axes=problem.axes,
        object_share=problem.system.object_share if face is problem.surface else None,
    )


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
