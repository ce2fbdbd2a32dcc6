"""Variations of a condensed body: what a small change of a parameter changes in its displacements and its readings.

The displacements of contact points and readings under contact forces r are ``L u`` with ``u = K^-1 L_c^T r``.  Their
derivative is ``L K^-1 (dL_c^T r - dK u) + dL u``, where dK and dL are central differences of assembled matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.mesh.parts import elasticity_of, moduli_of
from finger3d.fem.mesh.simplex import Mesh
from finger3d.fem.solvers.condense import stiffened
from finger3d.fem.surface.traces import local_rows, restrict
from finger3d.mechanics.discretise.build import contact_rows, mesh_part, widened
from finger3d.mechanics.discretise.problem import Problem, free_surface, object_share
from finger3d.mechanics.discretise.symmetry import unfold_points
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.reading import MeshedBody
from finger3d.mechanics.results.state import State
from finger3d.objects import ObjectPose, vertical_frame

_FARTHEST = 1e-2
"""Motion of the vertices, over the least size of the body, beyond which they are others."""

_IN_BODY = ("design", "material", "parts", "gauges", "markers", "taxels")
_CHANGES = (*_IN_BODY, "friction", "legs", "object", "object_compliance", "inclusions", "relaxation")
"""What a parameter may change in a model, in the body and elsewhere."""


class Side(NamedTuple):
    """A press at a parameter less or plus its step, to first order, at the end of an increment.

    Attributes
    ----------
    problem, state, pose : of the press
    readings : (g,)
    work_mJ, dissipation_mJ : since its start
    """

    problem: Problem
    state: State[Any]
    pose: ObjectPose
    readings: Float
    work_mJ: float
    dissipation_mJ: float


@dataclass(frozen=True)
class BodyChange:
    """Derivatives of a body by a parameter.

    Attributes
    ----------
    stiffness : (N, N) sparse
    contact : (c d, N) sparse, of the rows of the contact points
    readings : (g, N) sparse, of the rows of the readings
    """

    stiffness: Any
    contact: Any
    readings: Any

    def of(self, problem: Problem, unknowns: Float, force: Float) -> tuple[Float, Float]:
        """Return the derivatives of contact displacements (c d, k) and readings (g, k) in several solutions.

        Parameters
        ----------
        unknowns : (N, k), of the body under each of k loads
        force : (c d, k) N, contact forces that are these loads
        """
        active, body = problem.system.active_dofs, problem.body
        load = self.contact.T @ force - self.stiffness @ unknowns
        moved = body.condensed.eliminated(load).displacement
        displacement = np.zeros_like(force)
        displacement[active] = moved[: len(active)] + (self.contact @ unknowns)[active]
        return displacement, moved[len(active) :][: self.readings.shape[0]] + self.readings @ unknowns


@dataclass(frozen=True)
class ComplianceChange:
    """Derivatives by a parameter of the compliance of contact points (c d, c d) and of readings (g, c d)."""

    compliance: Float
    readings: Float

    def of(self, problem: Problem, unknowns: Float, force: Float) -> tuple[Float, Float]:
        """Return the derivatives of contact displacements (c d, k) and readings (g, k), as of a `BodyChange`."""
        return self.compliance @ force, self.readings @ force


@dataclass(frozen=True)
class Variation:
    """A parameter of a press, by the problem at its value less and plus a small step, with the same contact points.

    Attributes
    ----------
    low, high : with the compliance of the press itself
    step : of the parameter
    body : what changes in the body; None if nothing does
    """

    low: Problem
    high: Problem
    step: float
    body: BodyChange | ComplianceChange | None

    @property
    def ends(self) -> tuple[Problem, Problem]:
        """Both problems."""
        return self.low, self.high

    def difference(self, low: Float | float, high: Float | float) -> Float:
        """Return the central difference of two values."""
        return np.asarray((np.asarray(high) - low) / (2.0 * self.step))


def variation(problem: Problem, low: Model, high: Model, step: float) -> Variation:
    """Return the variation between two models; the mesh moves with the dimensions of the design.

    They may differ in friction, path, object, materials, readings, and in dimensions that keep the cells of the mesh.

    Raises
    ------
    Finger3dError
        If the models differ in anything else.
    """
    own = problem.model
    kept = {name: getattr(own, name) for name in _CHANGES}
    for model in (low, high):
        if replace(model, **kept) != own or type(model.design) is not type(own.design):
            raise Finger3dError("it changes the mesh")
    models = [replace(own, **{name: getattr(model, name) for name in _CHANGES}) for model in (low, high)]
    if any(model.object != own.object or model.design != own.design for model in models):
        touches = [model.first_contact.first_contact_mm for model in (low, high)]
    else:
        touches = [problem.system.first_contact_mm] * 2
    ends = [
        replace(problem, model=model, system=replace(problem.system, first_contact_mm=touch))
        for model, touch in zip(models, touches, strict=True)
    ]
    changed = {name for name in _CHANGES for end in ends if getattr(end.model, name) != getattr(own, name)}
    if own.object_compliance is not None:
        ends = [_beside_object(problem, end, changed) for end in ends]
    if "inclusions" in changed:
        return Variation(ends[0], ends[1], step, _of_foils(problem, ends[0].model, ends[1].model, step))
    if "object_compliance" in changed:
        size = problem.surface.points.size
        softer, stiffer = (np.asarray(end.system.object_compliance) for end in ends)
        delassus = (stiffer - softer) / (2.0 * step)
        none = np.zeros((len(problem.system.reading_rows), size))
        return Variation(ends[0], ends[1], step, ComplianceChange(delassus.reshape(size, size), none))
    if not changed & {*_IN_BODY}:
        return Variation(ends[0], ends[1], step, None)
    if own.inclusions is not None:
        raise Finger3dError("it changes a body with foils")
    below, above = (_assembled(problem, end) for end in ends)
    change = BodyChange(
        *((high - low) / (2.0 * step) for low, high in zip(below.matrices, above.matrices, strict=True))
    )
    return Variation(below.problem, above.problem, step, change)


def _beside_object(problem: Problem, end: Problem, changed: set[str]) -> Problem:
    """Return a problem with the share of an elastic object by the moduli of its model, which alone may change it."""
    own, model, system = problem.model, end.model, problem.system
    assert own.object_compliance is not None
    assert model.object_compliance is not None
    assert system.object_compliance is not None
    assert system.object_share is not None
    materials = [m.isotropic("derivatives") for m in (own.material, model.material)] if "material" in changed else []
    finger = materials[0].E_MPa / materials[1].E_MPa if materials else 1.0
    softer = own.object_compliance.E_MPa / model.object_compliance.E_MPa
    same = replace(model.object_compliance, E_MPa=own.object_compliance.E_MPa) == own.object_compliance
    if changed & {"design", "parts", "object"} or not same or len({m.nu for m in materials}) > 1:
        raise Finger3dError("it changes the share of an elastic object in the compliance")
    thing, image = softer * system.object_compliance, problem.symmetry.image_of
    share = object_share(problem.surface, finger * (system.delassus - system.object_compliance), thing)
    compliance = finger * system.points.compliance * (1.0 - system.object_share[image]) / (1.0 - share[image])
    points = replace(system.points, compliance=compliance)
    return replace(end, system=replace(end.system, object_compliance=thing, object_share=share, points=points))


def _of_foils(problem: Problem, low: Model, high: Model, step: float) -> ComplianceChange:
    """Return what the stiffness of all foils along their length changes."""
    own = problem.model.inclusions
    assert own is not None
    assert low.inclusions is not None
    assert high.inclusions is not None
    stiff = [foils.E_MPa * foils.thickness_mm for foils in (own, low.inclusions, high.inclusions)]
    same = all(replace(own, E_MPa=m.E_MPa, thickness_mm=m.thickness_mm) == m for m in (low.inclusions, high.inclusions))
    if not same or not problem.model.is_linear_elastic:
        raise Finger3dError("it changes the foils in their plane, at large deformation or with viscosity")
    springs, system = problem.inclusions.bar_stiffness, problem.system
    loads = stiffened(problem.body.condensed.compliance, springs)[:, -len(springs) :]
    change = -(stiff[2] - stiff[1]) / (2.0 * step * stiff[0]) * (loads * springs) @ loads.T
    delassus, readings = contact_rows(change, system.active_dofs, problem.surface, len(system.reading_rows))
    return ComplianceChange(delassus.reshape(problem.surface.points.size, -1), readings)


class _Assembled(NamedTuple):
    """Problem with another body on the same cells, and its matrices as in a `BodyChange`."""

    problem: Problem
    matrices: tuple[Any, Any, Any]


def _moved(mesh: Mesh, other: Mesh) -> Mesh:
    """Return a mesh with the points of another one; where that has other diagonals, with those of its vertices."""
    if mesh.cells.shape != other.cells.shape or mesh.points.shape != other.points.shape:
        raise Finger3dError("it changes the cells of the mesh")
    if (mesh.cells == other.cells).all():
        return other
    moved, corners = other.points - mesh.points, mesh.cells[:, : mesh.dim + 1]
    moved[mesh.cells[:, mesh.dim + 1 :]] = 0.5 * moved[mesh.cells[:, mesh.element.edges]].sum(axis=2)
    if np.abs(moved[corners]).max() > _FARTHEST * np.ptp(mesh.points, axis=0).min():
        raise Finger3dError("it numbers the points of the mesh anew")
    return replace(mesh, points=mesh.points + moved)


def _assembled(problem: Problem, end: Problem) -> _Assembled:
    """Return the problem of a changed model, with the compliance of another."""
    model, body, face = end.model, problem.body, problem.surface
    mesh, thickness = body.mesh, body.thickness
    if model.design != problem.model.design:
        mesh = _moved(mesh, mesh_part(model, problem.model.first_contact.contact_box, problem.axes)[0])
        thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
        free, own = (free_surface(problem.model, one, thickness) for one in (mesh, body.mesh))
        place = {(int(node), int(label)): k for k, (node, label) in enumerate(zip(own.nodes, own.face, strict=True))}
        face = restrict(free, np.array([place[int(n), int(f)] for n, f in zip(face.nodes, face.face, strict=True)]))
    elastic = elasticity_of(model.materials(mesh.part_labels), mesh, model.domain == "plane-stress")
    if elastic.mixed != body.elastic.mixed:
        raise Finger3dError("it switches between elements for compressible and nearly incompressible materials")
    matrix = stiffness(mesh, elastic, thickness)
    upper = matrix.upper
    rows = [local_rows(face, vertical_frame(mesh.dim))]
    rows += [r.rows(MeshedBody(mesh, problem.axes, matrix, thickness, moduli_of(elastic))) for r in model.readings]
    contact, *readings = (widened(part, upper.shape[0]) for part in rows)
    read = sp.vstack(readings, format="csr") if readings else sp.csr_matrix((0, upper.shape[0]))
    points = unfold_points(model, mesh, face, problem.axes, elastic)[1]
    if (share := end.system.object_share) is not None:
        points = replace(points, compliance=points.compliance / (1.0 - share[problem.symmetry.image_of]))
    system = replace(end.system, surface=face, points=points)
    changed = replace(body, mesh=mesh, elastic=elastic, stiffness=matrix, thickness=thickness)
    return _Assembled(
        replace(end, system=system, condensed_body=changed), ((upper + sp.triu(upper, 1).T).tocsr(), contact, read)
    )
