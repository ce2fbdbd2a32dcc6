"""Variations of a condensed body: what a small change of a parameter changes in its displacements and its readings.

The displacements of contact points and readings under contact forces r are ``L u`` with ``u = K^-1 L_c^T r``.  Their
derivative is ``L K^-1 (dL_c^T r - dK u) + dL u``, where dK and dL are central differences of assembled matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Pattern, stiffness, times
from finger3d.fem.mesh.parts import elasticity_of
from finger3d.fem.mesh.simplex import FREE_FACES, Mesh
from finger3d.fem.solvers.condense import Condensation
from finger3d.fem.surface.traces import BoundarySurface, joined, local_rows, restrict, surface
from finger3d.mechanics.discretise.build import bars_of, mesh_part, rows_of_readings, widened
from finger3d.mechanics.discretise.elastic_object import (
    assembled_object,
    law_of_object,
    object_mesh,
)
from finger3d.mechanics.discretise.foils import EmbeddedBars
from finger3d.mechanics.discretise.moved_mesh import stretched, stretched_object, with_points_of
from finger3d.mechanics.discretise.problem import CondensedObject, Problem, object_share, under_pressure
from finger3d.mechanics.discretise.symmetry import unfold_points
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.state import State
from finger3d.objects import ObjectPose, vertical_frame
from finger3d.progress import QUIET

_READINGS = {"gauges", "markers", "taxels"}
_IN_BODY = ("design", "material", "parts", *_READINGS)
_CHANGES = (*_IN_BODY, "friction", "legs", "object", "object_compliance", "inclusions", "relaxation")
"""What a parameter may change in a model, in the body and elsewhere."""


_MANY = 0.5
"""Number of forces, over that of rows, from which the derivative of the whole compliance takes less time."""

_AT_ONCE = 32
"""Forces that a body is solved for at once, which costs less than one after another."""

_OTHER_ELEMENTS = "it switches between elements for compressible and nearly incompressible materials"

_Matrices: TypeAlias = tuple[sp.csr_matrix, sp.csr_matrix]
"""Upper triangle (N, N) of the stiffness of a body, and its rows (r, N)."""

_Assembled: TypeAlias = tuple[Problem, _Matrices, EmbeddedBars | None]
"""Problem with another body on the same cells, the matrices of the body, and the bars of its foils."""


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
    """Derivatives of a condensed body by a parameter.

    Attributes
    ----------
    condensed : the body
    stiffness : (N, N) sparse, the upper triangle
    rows : (r, N) sparse, of the condensed rows
    subgrid : (k, k), of the compliance of the last rows, gauges and bars, that the mesh lacks; empty without foils
    bars : (s,), of the stiffness of bars, over itself
    """

    condensed: Condensation
    stiffness: sp.csr_matrix
    rows: sp.csr_matrix
    subgrid: Float = field(default_factory=lambda: np.zeros((0, 0)))
    bars: Float = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def between(cls, condensed: Condensation, low: _Matrices, high: _Matrices, step: float) -> BodyChange:
        """Return the central difference of the matrices of two bodies."""
        stiffness, rows = ((above - below) / (2.0 * step) for below, above in zip(low, high, strict=True))
        return cls(condensed, stiffness, rows)

    def moved(self, forces: Float, unknowns: Float) -> Float:
        """Return the derivatives (r, k) of the rows at fixed forces (r, k) on them, which cause unknowns (N, k)."""
        load, moved = self.rows.T @ forces - times(self.stiffness, unknowns), self.rows @ unknowns
        if load.any():
            moved += self.condensed.eliminated(load).displacement
        return self._with_subgrid(moved, forces)

    def compliance(self, unknowns: Float) -> Float:
        """Return the derivatives (r, r) of the rows under forces of 1 N on each, which cause unknowns (N, r)."""
        half = self.rows @ unknowns
        if self.stiffness.nnz:  # each half of the symmetric matrix has half of the diagonal
            upper = self.stiffness - sp.diags_array(0.5 * self.stiffness.diagonal())
            half -= unknowns.T @ (upper @ unknowns)
        return self._with_subgrid(half + half.T, np.eye(len(half)))

    def _with_subgrid(self, moved: Float, forces: Float) -> Float:
        first = len(moved) - len(self.subgrid)
        moved[first:] += self.subgrid @ forces[first:]
        return np.asarray(moved)


@dataclass(frozen=True)
class Variation:
    """A parameter of a press, by the problem at its value less and plus a small step, with the same contact points.

    Attributes
    ----------
    ends : below and above, with the compliance of the press itself
    step : of the parameter
    body, thing : what changes in the finger's body, and in that of an elastic object; None if nothing does
    of_readings : whether it changes readings only, and nothing in the contact
    """

    ends: tuple[Problem, Problem]
    step: float
    body: BodyChange | None
    thing: BodyChange | None
    of_readings: bool = False

    def difference(self, low: Float | float, high: Float | float) -> Float:
        """Return the central difference of two values."""
        return np.asarray((np.asarray(high) - low) / (2.0 * self.step))


@dataclass(frozen=True)
class VariedBody:
    """A condensed body whose parameters vary, with what its variations have in common."""

    problem: Problem

    def variation(self, low: Model, high: Model, step: float) -> Variation:
        """Return the variation between two models; the mesh moves with the dimensions of the design.

        They may differ in friction, path, object, materials, readings, and in dimensions that keep the cells of the
        meshes.

        Raises
        ------
        Finger3dError
            If the models differ in anything else.
        """
        problem, own = self.problem, self.problem.model
        kept = {name: getattr(own, name) for name in _CHANGES}
        for model in (low, high):
            if replace(model, **kept) != own or type(model.design) is not type(own.design):
                raise Finger3dError("it changes the mesh")
        changed = {name for name in _CHANGES for model in (low, high) if getattr(model, name) != getattr(own, name)}
        touches = [problem.system.first_contact_mm] * 2
        if changed & {"object", "design"}:
            touches = [model.first_contact.first_contact_mm for model in (low, high)]
        ends = [
            replace(problem, model=model, system=replace(problem.system, first_contact_mm=touch))
            for model, touch in zip((low, high), touches, strict=True)
        ]
        change = thing = None
        if changed & {*_IN_BODY, "inclusions"}:
            ends, change = self._changed([self._assembled(end) for end in ends], step)
        if own.object_compliance is not None and changed & {"design", "object", "object_compliance"}:
            softer, stiffer = (self._assembled_object(end) for end in ends)
            thing = BodyChange.between(self._object.condensed, softer, stiffer, step)
        if own.object_compliance is not None and (change or thing):
            ends = self._beside_object(ends, step, change, thing)
        of_readings = changed <= _READINGS and own.inclusions is None and own.relaxation is None
        return Variation((ends[0], ends[1]), step, change, thing, of_readings)

    @cached_property
    def _pattern(self) -> Pattern:
        return Pattern.of(self.problem.mesh, self.problem.body.elastic.mixed)

    @property
    def _object(self) -> CondensedObject:
        assert self.problem.system.object_body is not None
        return self.problem.system.object_body

    @cached_property
    def _pattern_of_object(self) -> Pattern:
        model = self.problem.model
        assert model.object_compliance is not None
        return Pattern.of(self._object.mesh, law_of_object(model, model.object_compliance).mixed)

    @cached_property
    def _object_unknowns(self) -> Float:
        """All unknowns (N, r) of an elastic object under forces of 1 N on each of its rows."""
        condensed = self._object.condensed
        return condensed.unknowns(np.eye(len(condensed.compliance)))

    def _changed(self, both: Sequence[_Assembled], step: float) -> tuple[list[Problem], BodyChange]:
        """Return the problems of two bodies, and what changes between these."""
        (one, first, below), (other, last, above) = both
        own, condensed = self.problem.inclusions, self.problem.body.condensed
        change = BodyChange.between(condensed, first, last, step)
        if below is None or above is None:
            return [one, other], change
        count, size = len(own.bar_stiffness), len(condensed.compliance)
        pulls = np.eye(size, count, count - size)
        slope = change.moved(pulls, condensed.unknowns(pulls))[-count:]
        of_mesh = condensed.compliance[-count:, -count:] - own.subgrid_compliance[-count:, -count:]
        low, high = below.in_mesh(of_mesh - step * slope), above.in_mesh(of_mesh + step * slope)
        subgrid = (high.subgrid_compliance - low.subgrid_compliance) / (2.0 * step)
        bars = (high.bar_stiffness - low.bar_stiffness) / (2.0 * step * own.bar_stiffness)
        ends = [replace(one, inclusions=low), replace(other, inclusions=high)]
        return ends, replace(change, subgrid=subgrid, bars=bars)

    def _beside_object(
        self, ends: Sequence[Problem], step: float, change: BodyChange | None, thing: BodyChange | None
    ) -> list[Problem]:
        """Return problems with the share of an elastic object by both bodies, at finite strain with its compliance."""
        problem, system, image = self.problem, self.problem.system, self.problem.symmetry.image_of
        compliance, active = system.object_compliance, system.active_dofs
        assert compliance is not None
        assert system.object_share is not None
        pressed = np.zeros(problem.surface.points.shape)
        pressed[:, 0] = problem.surface.area
        bodies = [Variation((ends[0], ends[1]), step, *both) for both in ((change, None), (None, thing))]
        moved = changes_of_points(problem, bodies, pressed.reshape(-1, 1))[: pressed.size, 0]
        slopes = moved.T.reshape(2, *pressed.shape)
        rate, out = None, []
        if thing is not None and problem.model.finite_strain:
            rate = np.zeros((pressed.size, pressed.size))
            rate[np.ix_(active, active)] = thing.compliance(self._object_unknowns)
        for end, t in zip(ends, (-step, step), strict=True):
            both = [under_pressure(end.surface, one) for one in (system.delassus - compliance, compliance)]
            share, points = object_share(*(both + t * slopes[..., 0])), end.system.points
            of_points = points.compliance * (1.0 - system.object_share[image]) / (1.0 - share[image])
            points = replace(points, compliance=of_points)
            other = compliance if rate is None else compliance + t * rate.reshape(compliance.shape)
            of_end = replace(end.system, object_share=share, object_compliance=other, points=points)
            out.append(replace(end, system=of_end))
        return out

    def _assembled(self, end: Problem) -> _Assembled:
        """Return the problem of a changed model, with the compliance of another."""
        problem, own, model, body = self.problem, self.problem.model, end.model, self.problem.body
        mesh, thickness, elastic, matrix = body.mesh, body.thickness, body.elastic, body.stiffness
        face, axes = problem.surface, problem.axes
        active, points, is_other = problem.system.active_dofs, end.system.points, model.design != own.design
        if is_other:
            if mesh.dim == 3 and model.mesh.mesher != "swept":
                mesh = stretched(mesh, own.design, model.design)
            else:
                mesh = with_points_of(mesh, mesh_part(model, own.first_contact.contact_box, axes)[0])
            thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
            face = restrict(self._faces(mesh, thickness), self._places)
        if is_other or (model.material, model.parts) != (own.material, own.parts):
            is_other = True
            elastic = elasticity_of(model.materials(mesh.part_labels), mesh, model.domain == "plane-stress")
            if elastic.mixed != body.elastic.mixed:
                raise Finger3dError(_OTHER_ELEMENTS)
            matrix = stiffness(mesh, elastic, thickness, self._pattern)
            points = unfold_points(model, mesh, face, axes, elastic)[1]
            if (share := end.system.object_share) is not None:
                points = replace(points, compliance=points.compliance / (1.0 - share[problem.symmetry.image_of]))
        bars = bars_of(model, mesh, axes)
        if bars and len(bars.bar_stiffness) != len(problem.inclusions.bar_stiffness):
            raise Finger3dError("it changes which foils are mirror images of each other")
        changed = replace(body, mesh=mesh, elastic=elastic, stiffness=matrix, thickness=thickness)
        system = replace(end.system, surface=face, points=points)
        end = replace(end, system=system, condensed_body=changed)
        if is_other or bars:
            readings = rows_of_readings(model, end.meshed_body, bars)
            parts = [local_rows(face, vertical_frame(mesh.dim))[active], *readings]
        else:
            parts = self._rows_of_readings(end)
        rows = sp.vstack([widened(part, matrix.upper.shape[0]) for part in parts], format="csr")
        return end, (matrix.upper, rows), bars

    def _rows_of_readings(self, end: Problem) -> list[sp.csr_matrix]:
        """Return the condensed rows with those of the readings of another problem, where they are others."""
        rows, first = self.problem.body.condensed.rows, len(self.problem.system.active_dofs)
        parts = [rows[:first]]
        for before, reading in zip(self.problem.model.readings, end.model.readings, strict=True):
            count = len(reading.columns(end.dim))
            parts.append(rows[first : first + count] if reading == before else reading.rows(end.meshed_body))
            first += count
        return parts

    def _faces(self, mesh: Mesh, thickness: float) -> BoundarySurface:
        """Return the points of a mesh on the faces that contact points belong to."""
        return joined([surface(mesh, FREE_FACES[k], thickness) for k in np.unique(self.problem.surface.face)])

    @cached_property
    def _places(self) -> Int:
        """Numbers of the contact points among those of their faces."""
        face, free = self.problem.surface, self._faces(self.problem.mesh, self.problem.body.thickness)
        place = {(int(node), int(label)): k for k, (node, label) in enumerate(zip(free.nodes, free.face, strict=True))}
        return np.array([place[int(n), int(f)] for n, f in zip(face.nodes, face.face, strict=True)])

    def _assembled_object(self, end: Problem) -> _Matrices:
        """Return the matrices of an elastic object by a model, whose mesh moves with the dimensions of both bodies."""
        model, other = self.problem.model, end.model
        own, thing, mesh = model.object_compliance, other.object_compliance, self._object.mesh
        assert own is not None
        assert thing is not None
        if law_of_object(other, thing).mixed != law_of_object(model, own).mixed:
            raise Finger3dError(_OTHER_ELEMENTS)
        if (other.design, other.object, thing.height_mm) != (model.design, model.object, own.height_mm):
            zone = model.first_contact.contact_box
            mesh = stretched_object(mesh, model, other) or with_points_of(mesh, object_mesh(end, thing, zone, QUIET)[0])
        matrix, rows = assembled_object(end, thing, mesh, self._object.is_whole, self._pattern_of_object)
        return matrix.upper, widened(rows, matrix.upper.shape[0])


def changes_of_rows(changes: Sequence[BodyChange | None], forces: Float) -> Float:
    """Return what p parameters change in the rows' displacements (r, k, p) at fixed forces (r, k) on them.

    For many forces the whole compliance is differentiated, which needs no solution for each of them.
    """
    moved, changed = np.zeros((*forces.shape, len(changes))), [(k, one) for k, one in enumerate(changes) if one]
    if not changed:
        return moved
    condensed = changed[0][1].condensed
    if forces.shape[1] > _MANY * len(forces):
        unknowns = np.ascontiguousarray(condensed.unknowns(np.eye(len(forces))))
        for k, one in changed:
            moved[..., k] = one.compliance(unknowns) @ forces
        return moved
    for start in range(0, forces.shape[1], _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        unknowns = condensed.unknowns(forces[:, some])
        for k, one in changed:
            moved[:, some, k] = one.moved(forces[:, some], unknowns)
    return moved


def changes_of_points(problem: Problem, variations: Sequence[Variation], forces: Float) -> Float:
    """Return what p parameters change in contact displacements and readings, (c d + g, k, p), at fixed contact forces.

    Forces (c d, k) and displacements are in the directions of an upright object.
    """
    active, compliance = problem.system.active_dofs, problem.body.condensed.compliance
    rows = np.zeros((len(compliance), forces.shape[1]))
    rows[: len(active)] = forces[active]
    rows = problem.inclusions.with_spring_forces(compliance, rows)
    of_body = changes_of_rows([one.body for one in variations], rows)
    of_thing = changes_of_rows([one.thing for one in variations], forces[active])
    out = np.zeros((len(forces) + len(problem.system.reading_rows), *of_body.shape[1:]))
    for k, one in enumerate(variations):
        moved = of_body[..., k]
        if one.body and (count := len(one.body.bars)):
            own = np.zeros_like(moved)
            own[-count:] = one.body.bars[:, None] * rows[-count:]
            moved = moved + compliance @ own
            moved += compliance @ problem.inclusions.with_spring_forces(compliance, np.zeros_like(moved), moved)
        if one.body:
            out[active, :, k] = moved[: len(active)]
            out[len(forces) :, :, k] = moved[len(active) :][: len(out) - len(forces)]
        if one.thing:
            out[active, :, k] += of_thing[..., k]
    return out
