"""Variations of a condensed body: what a small change of a parameter changes in its displacements and its readings.

The displacements of contact points and readings under contact forces r are ``L u`` with ``u = K^-1 L_c^T r``.  Their
derivative is ``L K^-1 (dL_c^T r - dK u) + dL u``, where dK and dL are central differences of assembled matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.mesh.locate import locate
from finger3d.fem.mesh.parts import elasticity_of, moduli_of
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh
from finger3d.fem.surface.traces import local_rows, restrict
from finger3d.geometry.design import Design
from finger3d.mechanics.discretise.build import bars_of, mesh_part, rows_of_readings, widened
from finger3d.mechanics.discretise.elastic_object import object_mesh, response_of
from finger3d.mechanics.discretise.foils import EmbeddedBars
from finger3d.mechanics.discretise.problem import Problem, free_surface, object_share
from finger3d.mechanics.discretise.symmetry import unfold_points
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.mechanics.readings.reading import MeshedBody
from finger3d.mechanics.results.state import State
from finger3d.meshing.structured.swept import mesh_section
from finger3d.objects import ObjectPose, vertical_frame
from finger3d.progress import QUIET

_FARTHEST = 1e-2
"""Motion of the vertices, over the least size of the body, beyond which they are others."""

_VOLUME, _ROUND_OFF = 0.05, 1e-9
"""Relative errors of the growth of a stretched body, and of its volume, that are those of its mesh."""

_CELLS_OF_SECTION = 40
"""Edges along half the section in whose mesh the inside of a body of several parts moves."""

_INSIDE = 1.0 - 1e-9
"""Share of their distance from the axis at which points on the rim are inside in spite of round-off."""

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
    rows : (r, N) sparse, of the condensed rows
    subgrid : (k, k), of the compliance of the last rows, gauges and bars, that the mesh lacks; empty without foils
    bars : (s,), of the stiffness of bars, over itself
    """

    stiffness: Any
    rows: Any
    subgrid: Float
    bars: Float

    def moved(self, problem: Problem, forces: Float, unknowns: Float) -> Float:
        """Return the derivatives (r, k) of the rows at fixed forces (r, k) on them, which cause unknowns (N, k)."""
        load = self.rows.T @ forces - self.stiffness @ unknowns
        moved = problem.body.condensed.eliminated(load).displacement + self.rows @ unknowns
        return self._with_subgrid(moved, forces)

    def compliance(self, unknowns: Float) -> Float:
        """Return the derivatives (r, r) of the rows under forces of 1 N on each, which cause unknowns (N, r)."""
        half = self.rows @ unknowns
        moved = half + half.T - unknowns.T @ (self.stiffness @ unknowns)
        return self._with_subgrid(moved, np.eye(len(moved)))

    def _with_subgrid(self, moved: Float, forces: Float) -> Float:
        first = len(moved) - len(self.subgrid)
        moved[first:] += self.subgrid @ forces[first:]
        return np.asarray(moved)

    def of_points(self, problem: Problem, forces: Float, moved: Float) -> tuple[Float, Float]:
        """Return the derivatives of contact displacements (c d, k) and readings (g, k) at fixed contact forces.

        Parameters
        ----------
        forces : (r, k) N, on the rows, those of springs included
        moved : (r, k), derivatives of the rows' displacements at these forces
        """
        active, compliance = problem.system.active_dofs, problem.body.condensed.compliance
        if count := len(self.bars):
            own = np.zeros_like(moved)
            own[-count:] = self.bars[:, None] * forces[-count:]
            moved = moved + compliance @ own
            moved += compliance @ problem.inclusions.with_spring_forces(compliance, np.zeros_like(moved), moved)
        displacement = np.zeros((problem.surface.points.size, moved.shape[1]))
        displacement[active] = moved[: len(active)]
        return displacement, moved[len(active) :][: len(problem.system.reading_rows)]


@dataclass(frozen=True)
class Variation:
    """A parameter of a press, by the problem at its value less and plus a small step, with the same contact points.

    Attributes
    ----------
    low, high : with the compliance of the press itself, but for that of an elastic object
    step : of the parameter
    body : what changes in the finger's body; None if nothing does
    """

    low: Problem
    high: Problem
    step: float
    body: BodyChange | None

    @property
    def ends(self) -> tuple[Problem, Problem]:
        """Both problems."""
        return self.low, self.high

    @property
    def changes_compliance(self) -> bool:
        """Whether the finger's body changes, or an elastic object."""
        return self.body is not None or self.low.system.object_compliance is not self.high.system.object_compliance

    def object_displacement(self, force: Float) -> Float:
        """Return the derivatives (c d, k) of an elastic object's displacement at fixed contact forces (c d, k)."""
        low, high = (end.system.object_compliance for end in self.ends)
        if low is high or low is None or high is None:
            return np.zeros_like(force)
        return np.asarray(self.difference(low, high).reshape(len(force), -1) @ force)

    def difference(self, low: Float | float, high: Float | float) -> Float:
        """Return the central difference of two values."""
        return np.asarray((np.asarray(high) - low) / (2.0 * self.step))


def variation(problem: Problem, low: Model, high: Model, step: float) -> Variation:
    """Return the variation between two models; the mesh moves with the dimensions of the design.

    They may differ in friction, path, object, materials, readings, and in dimensions that keep the cells of the meshes.

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
    change = None
    if changed & {*_IN_BODY, "inclusions"}:
        below, above = (_assembled(problem, end) for end in ends)
        ends, change = _changed(problem, below, above, step)
    if own.object_compliance is not None:
        ends = _beside_object(problem, ends, step, change)
    return Variation(ends[0], ends[1], step, change)


def _changed(problem: Problem, below: _Assembled, above: _Assembled, step: float) -> tuple[list[Problem], BodyChange]:
    """Return the problems of two bodies, and what changes between these."""
    ends = [below.problem, above.problem]
    slopes = [(high - low) / (2.0 * step) for low, high in zip(below.matrices, above.matrices, strict=True)]
    change = BodyChange(slopes[0], slopes[1], np.zeros((0, 0)), np.zeros(0))
    if below.bars is None or above.bars is None:
        return ends, change
    own, condensed = problem.inclusions, problem.body.condensed
    count, size = len(own.bar_stiffness), len(condensed.compliance)
    pulls = np.eye(size, count, count - size)
    slope = change.moved(problem, pulls, condensed.unknowns(pulls))[-count:]
    of_mesh = condensed.compliance[-count:, -count:] - own.subgrid_compliance[-count:, -count:]
    low, high = below.bars.in_mesh(of_mesh - step * slope), above.bars.in_mesh(of_mesh + step * slope)
    ends = [replace(end, inclusions=added) for end, added in zip(ends, (low, high), strict=True)]
    subgrid = (high.subgrid_compliance - low.subgrid_compliance) / (2.0 * step)
    bars = (high.bar_stiffness - low.bar_stiffness) / (2.0 * step * own.bar_stiffness)
    return ends, replace(change, subgrid=subgrid, bars=bars)


def _beside_object(problem: Problem, ends: Sequence[Problem], step: float, change: BodyChange | None) -> list[Problem]:
    """Return problems with the compliance of an elastic object by their models, and its share by both bodies."""
    system, face, image = problem.system, problem.surface, problem.symmetry.image_of
    assert system.object_compliance is not None
    assert system.object_share is not None
    pressed = np.zeros(face.points.shape)
    pressed[:, 0] = face.area
    yielding, slope = system.delassus - system.object_compliance, np.zeros(len(pressed))
    soft = np.einsum("idje,je->id", yielding, pressed)[:, 0]
    if change is not None:
        forces = problem.inclusions.with_spring_forces(
            problem.body.condensed.compliance, problem.row_forces(pressed)[:, None]
        )
        moved = change.moved(problem, forces, problem.body.condensed.unknowns(forces))
        slope = change.of_points(problem, forces, moved)[0][:: problem.dim, 0]
    out = []
    for end, t in zip(ends, (-step, step), strict=True):
        thing, scale = _object_compliance(problem, end), 1.0 + t * slope / soft
        share, points = object_share(end.surface, yielding * scale[:, None, None, None], thing), end.system.points
        compliance = points.compliance * (1.0 - system.object_share[image]) / (1.0 - share[image])
        points = replace(points, compliance=compliance)
        out.append(replace(end, system=replace(end.system, object_compliance=thing, object_share=share, points=points)))
    return out


def _object_compliance(problem: Problem, end: Problem) -> Float:
    """Return the compliance (c, d, c, d) of an elastic object, whose mesh moves with the dimensions of both bodies."""
    own, thing, model = problem.model.object_compliance, end.model.object_compliance, problem.model
    assert own is not None
    assert thing is not None
    assert problem.system.object_compliance is not None
    is_moved = (end.model.design, end.model.object) != (model.design, model.object)
    if not is_moved and thing == own:
        return problem.system.object_compliance
    if not is_moved and replace(thing, E_MPa=own.E_MPa) == own:
        return own.E_MPa / thing.E_MPa * problem.system.object_compliance
    zone = model.first_contact.contact_box
    mesh, whole = object_mesh(problem, own, zone, QUIET)
    moved = stretched_object(mesh, model, end.model) or _moved(mesh, object_mesh(end, thing, zone, QUIET)[0])
    return response_of(end, thing, moved, whole).compliance


def stretched_object(mesh: Mesh, model: Model, other: Model) -> Mesh | None:
    """Return an unstructured mesh of the elastic object of a model with the dimensions of another; None for others."""
    bodies = [one.object.held_body(one.design, mesh.dim == 3) for one in (model, other)]
    if mesh.dim == 2 or bodies[0] is None or bodies[1] is None or bodies[0].mesher == "swept":
        return None
    own = replace(mesh, points=bodies[0].to_design(mesh.points))
    if bodies[0].design != bodies[1].design:
        own = stretched(own, bodies[0].design, bodies[1].design)
    return replace(mesh, points=bodies[1].to_scene(own.points))


class _Assembled(NamedTuple):
    """Problem with another body on the same cells, its matrices as in a `BodyChange`, and the bars of its foils."""

    problem: Problem
    matrices: tuple[Any, Any]
    bars: EmbeddedBars | None


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


def stretched(mesh: Mesh, design: Design, other: Design) -> Mesh:
    """Return an unstructured mesh of a design with the dimensions of another one of its kind.

    The footprint stretches along x and z, and every vertical line from the base to the contact face stretches as well.
    A body of several parts moves along x and y as a structured mesh of its section does.

    Raises
    ------
    Finger3dError
        If the body is not that between its base and its contact face, or has parts and no section.
    """
    points = mesh.points * [other.half_length_mm / design.half_length_mm, 1.0, other.width_mm / design.width_mm]
    if design.part_labels:
        size = design.half_length_mm / _CELLS_OF_SECTION
        zone = (-design.half_length_mm, design.half_length_mm, 0.0, 0.0)
        flat, end = (mesh_section(one, MeshOptions(size, size), zone)[0] for one in (design, other))
        cells, places = locate(flat, mesh.points[:, :2])
        motion = (_moved(flat, end).points - flat.points)[flat.cells[cells]]
        points[:, :2] = mesh.points[:, :2] + np.einsum("pk,pkd->pd", flat.element.shape(places), motion)
    else:
        heights = [one.top(*(_INSIDE * at[:, ::2]).T) for one, at in ((design, mesh.points), (other, points))]
        stands = mesh.points[:, 1] > 0.0
        points[stands, 1] *= heights[1][stands] / heights[0][stands]
    moved = replace(mesh, points=points)
    growth = curved_volume(moved) / curved_volume(mesh) - 1.0
    wanted = other.volume_mm3 / design.volume_mm3 - 1.0
    if not math.isclose(growth, wanted, rel_tol=_VOLUME, abs_tol=_ROUND_OFF):
        raise Finger3dError("it changes the cells of the mesh")
    return moved


def _assembled(problem: Problem, end: Problem) -> _Assembled:
    """Return the problem of a changed model, with the compliance of another."""
    model, body, face = end.model, problem.body, problem.surface
    mesh, thickness = body.mesh, body.thickness
    if model.design != problem.model.design:
        if mesh.dim == 3 and model.mesh.mesher != "swept":
            mesh = stretched(mesh, problem.model.design, model.design)
        else:
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
    bars = bars_of(model, mesh, problem.axes)
    if bars and len(bars.bar_stiffness) != len(problem.inclusions.bar_stiffness):
        raise Finger3dError("it changes which foils are mirror images of each other")
    meshed = MeshedBody(mesh, problem.axes, matrix, thickness, moduli_of(elastic))
    contact = local_rows(face, vertical_frame(mesh.dim))[problem.system.active_dofs]
    parts = (contact, *rows_of_readings(model, meshed, bars))
    rows = sp.vstack([widened(part, upper.shape[0]) for part in parts], format="csr")
    points = unfold_points(model, mesh, face, problem.axes, elastic)[1]
    if (share := end.system.object_share) is not None:
        points = replace(points, compliance=points.compliance / (1.0 - share[problem.symmetry.image_of]))
    system = replace(end.system, surface=face, points=points)
    changed = replace(body, mesh=mesh, elastic=elastic, stiffness=matrix, thickness=thickness)
    matrices = (upper + sp.triu(upper, 1).T).tocsr(), rows
    return _Assembled(replace(end, system=system, condensed_body=changed), matrices, bars)
