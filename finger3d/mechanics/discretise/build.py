"""Build of a problem: mesh, part, candidate points, inclusions, condensation, contact system."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from finger3d._cost import PressSize, duration
from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import elasticity_of, moduli_of
from finger3d.fem.mesh import CONTACT, Mesh
from finger3d.fem.solvers.condense import condense, stiffened
from finger3d.fem.surface import BoundarySurface, local_rows, points_at, restrict
from finger3d.mechanics.discretise.body_mesh import locally_refined, stretched, with_points_of
from finger3d.mechanics.discretise.contact_points import MARGIN, contact_geometry, may_touch
from finger3d.mechanics.discretise.problem import (
    CondensedBody,
    ContactSystem,
    Problem,
    free_surface,
    object_share,
    scatter_to_points,
    under_pressure,
)
from finger3d.mechanics.discretise.resolution import check
from finger3d.mechanics.discretise.symmetry import active_dofs, held_dofs, symmetry, unfold_points
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.readings import MeshedBody
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.limits import MeshReport, check_rows
from finger3d.meshing.swept import mesh_section
from finger3d.objects import DistanceTracker, ObjectPose, PlacedObject, vertical_frame
from finger3d.progress import QUIET, Progress

if TYPE_CHECKING:
    from finger3d.mechanics.discretise.elastic_object import ObjectResponse
    from finger3d.mechanics.discretise.foils import EmbeddedBars

_STATIONS = 4, 20
"""Least and largest number of poses along a leg at which rigid gaps are taken to find the candidate points."""

WHOLE_FACE = 0.95
"""Share of the contact face from which all its points are candidates: a few more rows cost less than the check."""

_LONG_S = 60.0
"""Forecast of a press from which it is said."""

_OF_MESH = "mesh", "domain", "held_ends"
_OF_BODY = (
    *_OF_MESH, "design", "material", "parts", "markers", "taxels", "other_readings", "gauges", "inclusions",
    "object_compliance",
)  # fmt: skip
"""Fields of a model that the cells of its mesh depend on, beside its dimensions, and that a condensed body does."""

_MANY_READINGS = 100
"""Gauges whose placing is announced: each takes some milliseconds."""


def build(model: Model, report: Progress = QUIET, margin: float = MARGIN, anywhere: bool = False) -> Problem:
    """Mesh, assemble and condense a model.

    Parameters
    ----------
    report : receives the messages
    margin : rigid gap that candidate points reach to, in depths of the press; infinite for all of the contact face
    anywhere : whether the object may touch the contact face anywhere, whatever the path of the model: edges are as
        short all over it, and its points are the candidate points; with an infinite margin those of all free faces

    Raises
    ------
    UnresolvedError
        If the object passes between the contact points.
    """
    contact, axes = model.first_contact, symmetry(model)
    design = model.design
    half_width = 0.5 * design.width_mm if model.domain == "solid" else 0.0
    face = (-design.half_length_mm, design.half_length_mm, -half_width, half_width)
    mesh, mesh_report = mesh_part(model, face if anywhere else contact.contact_box, axes, report)
    thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
    free = free_surface(model, mesh, thickness)
    check(model, free, contact.first_contact_mm, contact.place, axes)
    if anywhere:
        allowed = np.ones(len(free.nodes), dtype=bool) if math.isinf(margin) else free.face == CONTACT
        candidates = restrict(free, np.flatnonzero(allowed))
    else:
        candidates = candidate_points(model, free, contact.first_contact_mm, margin)
    return _condensed(model, mesh, mesh_report, candidates, report)


def changed(problem: Problem, model: Model) -> Problem:
    """Return the problem of a changed model, with the cells and the contact points of another one.

    Where only friction, path or a rigid object differ, the condensed body is shared.  The mesh moves with the
    dimensions of the design.  At finite strain the condensation, which only begins the iteration, is that of the other
    problem.

    Raises
    ------
    Finger3dError
        If the model needs other cells.
    """
    own = problem.model
    if axes := set(problem.axes) - set(symmetry(model)):
        raise Finger3dError(f"it breaks the symmetry about {' and '.join(sorted(axes))} = 0")
    fields = _OF_BODY if own.object_compliance is None else (*_OF_BODY, "object")
    if all(getattr(model, name) == getattr(own, name) for name in fields):
        bare, system = problem.without_inclusions, problem.system
        if model.object != own.object:
            touch = model.first_contact
            system = replace(system, first_contact_mm=touch.first_contact_mm, place_mm=touch.place)
        return replace(problem, model=model, system=system, without_inclusions=changed(bare, model) if bare else None)
    is_alike = all(getattr(model, name) == getattr(own, name) for name in _OF_MESH)
    if not is_alike or type(model.design) is not type(own.design):
        raise Finger3dError("it changes the mesh")
    if model.mixed != own.mixed:
        raise Finger3dError("it switches between elements for compressible and nearly incompressible materials")
    mesh, candidates = problem.mesh, problem.surface
    if model.design != own.design:
        mesh = _moved(problem, model)
        candidates = _same_points(problem, model, mesh)
    return _condensed(model, mesh, problem.body.report, candidates, QUIET, problem)


def _moved(problem: Problem, model: Model) -> Mesh:
    """Return the mesh of a problem with the dimensions of another model."""
    own, mesh = problem.model, problem.mesh
    if mesh.dim == 2 or model.mesh.mesher == "swept":
        with suppress(Finger3dError):  # where a structured mesh of the other dimensions has other cells
            return with_points_of(mesh, mesh_part(model, own.first_contact.contact_box, problem.axes)[0])
    return stretched(mesh, own.design, model.design)


def _same_points(problem: Problem, model: Model, mesh: Mesh) -> BoundarySurface:
    """Return the contact points of a problem in a mesh that has moved."""
    free = free_surface(model, mesh, 1.0 if mesh.dim == 3 else model.design.width_mm)
    return points_at(free, problem.surface.nodes, problem.surface.face)


def _condensed(
    model: Model,
    mesh: Mesh,
    mesh_report: MeshReport,
    candidates: BoundarySurface,
    report: Progress,
    like: Problem | None = None,
) -> Problem:
    """Assemble and condense a mesh of a model to its candidate points.

    Parameters
    ----------
    like : problem on the same cells, whose symmetry and whose elastic object's cells it shares; at finite strain also
        its condensation, which only begins the iteration, unless foils or an elastic object change it
    """
    contact, axes = model.first_contact, like.axes if like else symmetry(model)
    thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
    report.say("assembling")
    start = time.perf_counter()
    elastic = elasticity_of(model.materials(mesh.part_labels), mesh, model.domain == "plane-stress")
    matrix = stiffness(mesh, elastic, thickness)
    active = active_dofs(candidates, axes)
    count = len(model.columns)
    check_rows(len(active), count)
    bars = bars_of(model, mesh, axes)
    contact_part = local_rows(candidates, vertical_frame(mesh.dim))[active]
    readings = rows_of_readings(model, MeshedBody(mesh, axes, matrix, thickness, moduli_of(elastic)), bars, report)
    rows = sp.vstack([widened(part, matrix.upper.shape[0]) for part in (contact_part, *readings)], format="csr")
    assembly = time.perf_counter() - start
    report.say(f"condensing {matrix.upper.shape[0]} unknowns to {len(candidates.nodes)} contact points")
    size = PressSize(mesh.dim, matrix.upper.shape[0], len(candidates.nodes))
    if (seconds := size.press_s(len(targets(model.legs)))) > _LONG_S:
        expected = f"about {duration(seconds)} and {size.press_gb(count):.2g} GB, without error bars"
        report.say(f"warning: mesh.size_mm = {model.mesh.size_mm:g} takes {expected}")
    fixed = held_dofs(mesh, axes, model.held_ends)
    bare = model.inclusions is None and model.object_compliance is None
    known = like.body.condensed if like and model.finite_strain and bare else None
    condensed = known or condense(matrix, fixed, rows)
    delassus, reading_rows = contact_rows(condensed.compliance, active, candidates, count)
    mirrored, points = unfold_points(model, mesh, candidates, axes, elastic)
    problem = Problem(
        model=model,
        condensed_body=CondensedBody(
            mesh=mesh,
            report=mesh_report,
            elastic=elastic,
            stiffness=matrix,
            thickness=thickness,
            fixed_dofs=fixed,
            condensed=condensed,
        ),
        symmetry=mirrored,
        system=ContactSystem(
            surface=candidates,
            points=points,
            delassus=delassus,
            reading_rows=reading_rows,
            active_dofs=active,
            first_contact_mm=contact.first_contact_mm,
            place_mm=contact.place,
        ),
        seconds={**mesh_report.seconds, "assembly": assembly, "condensation": condensed.seconds},
    )
    return with_elastic_object(with_bars(problem, bars) if bars else problem, report, like)


def bars_of(model: Model, mesh: Mesh, axes: tuple[str, ...]) -> EmbeddedBars | None:
    """Return the bars of the model's inclusions, if there are any."""
    if model.inclusions is None:
        return None
    from finger3d.mechanics.discretise.foils import discretised_foils

    return discretised_foils(model.inclusions, model, mesh, axes)


def with_bars(problem: Problem, bars: EmbeddedBars) -> Problem:
    """Return the problem with the stiffness of its inclusions added to the condensed rows."""
    condensed, active, count = problem.body.condensed, problem.system.active_dofs, len(bars.bar_stiffness)
    readings = len(condensed.compliance) - len(active) - count
    compliance = condensed.compliance.copy()
    added = bars.in_mesh(compliance[-count:, -count:])
    first = len(compliance) - len(added.subgrid_compliance)
    compliance[first:, first:] += added.subgrid_compliance
    rows = stiffened(compliance, bars.bar_stiffness)
    delassus, reading_rows = contact_rows(rows, active, problem.system.surface, readings)
    return replace(
        problem,
        condensed_body=replace(problem.body, condensed=replace(condensed, compliance=compliance)),
        system=replace(problem.system, delassus=delassus, reading_rows=reading_rows),
        inclusions=added,
        without_inclusions=problem,
    )


def with_elastic_object(problem: Problem, report: Progress = QUIET, like: Problem | None = None) -> Problem:
    """Return the problem of a finger with the compliance of its model's object, if that is elastic.

    Its mesh is that of a problem that it is `like`, moved with the dimensions of both bodies.
    """
    model, body = problem.model, problem.without_inclusions or problem
    if model.object_compliance is None:
        return problem
    # a press imports only what its scene names
    from finger3d.mechanics.discretise.elastic_object import object_response

    response = object_response(body, model.object_compliance, model.first_contact.contact_box, report, like)
    return with_object_compliance(problem, response)


def with_object_compliance(problem: Problem, response: ObjectResponse) -> Problem:
    """Return the problem with the compliance of an elastic object added to that of the contact points."""
    body = problem.without_inclusions
    both = [under_pressure(problem.surface, one) for one in (problem.system.delassus, response.compliance)]
    share, points = object_share(*both), problem.points
    softer = points.compliance / (1.0 - share[problem.symmetry.image_of])
    return replace(
        problem,
        system=replace(
            problem.system,
            points=replace(points, compliance=softer),
            delassus=problem.system.delassus + response.compliance,
            object_factorizations=response.factorizations,
            object_compliance=response.compliance,
            object_share=share,
            object_mesh=response.mesh,
        ),
        seconds=problem.seconds | response.seconds,
        without_inclusions=with_object_compliance(body, response) if body else None,
    )


def mesh_part(
    model: Model, zone: tuple[float, float, float, float], axes: tuple[str, ...], report: Progress = QUIET
) -> tuple[Mesh, MeshReport]:
    """Mesh the part of the finger on one side of its symmetry planes.

    Parameters
    ----------
    zone : (x_min, x_max, z_min, z_max) mm where contact is predicted
    axes : normals of the symmetry planes, "x" and "z"
    """
    if model.domain == "solid":
        mesh, mesh_report = mesh_solid(model.design, model.mesh, zone, axes, report)
    else:
        mesh, mesh_report = mesh_section(model.design, model.mesh, zone, axes)
    return locally_refined(model, mesh, mesh_report, axes)


def rows_of_readings(
    model: Model, body: MeshedBody, bars: EmbeddedBars | None, report: Progress = QUIET
) -> list[sp.csr_matrix]:
    """Return the rows of the readings, and of the bars if there are any."""
    if len(model.readings) >= _MANY_READINGS:
        report.say(f"placing {len(model.readings)} gauges, markers and taxels")
    if not bars:
        return [reading.rows(body) for reading in model.readings]
    others = model.readings[: len(model.readings) - len(model.gauges)]
    return [*(reading.rows(body) for reading in others), bars.gauge_weights @ bars.rows, bars.rows]


def widened(rows: sp.csr_matrix, size: int) -> sp.csr_matrix:
    """Return rows (k, n d) on displacements as rows (k, N) on all unknowns."""
    rows = sp.csr_matrix(rows)
    return sp.csr_matrix((rows.data, rows.indices, rows.indptr), (rows.shape[0], size))


def contact_rows(rows: Float, active: NDArray[np.int64], face: BoundarySurface, readings: int) -> tuple[Float, Float]:
    """Return compliance of contact points, and readings per contact force, from the compliance of rows."""
    count, dim = face.points.shape
    reading_rows = np.zeros((readings, count * dim))
    reading_rows[:, active] = rows[len(active) : len(active) + readings, : len(active)]
    return scatter_to_points(rows, active, count, dim), reading_rows


def candidate_points(model: Model, free: BoundarySurface, first_contact_mm: float, margin: float) -> BoundarySurface:
    """Return the points of the free faces that come near the object on its path, the nearest first.

    At finite strain points that do not face the object at rest may turn towards it: those near others are included.
    So are the neighbours of all.

    Parameters
    ----------
    first_contact_mm : height of the object's lowest point at first touch, mm
    margin : rigid gap that the points reach to, in depths of the press
    """
    path = poses(model)
    reach = folding = margin * max(pose.depth_mm for pose in path)
    tracker, near = DistanceTracker(), reach + model.mesh.size_mm if math.isfinite(reach) else 0.0

    def gaps(pose: ObjectPose) -> tuple[Float, Float]:
        """Gaps of points that face the object at rest, and of those that may do so later; infinite for others."""
        placed = PlacedObject.of(model.object, first_contact_mm, pose)
        geometry = contact_geometry(lambda points: tracker.distance(placed, points, near), free)
        normal = geometry.bases[:, 0]
        allowed = may_touch(free, normal), may_touch(free, normal, model.finite_strain)
        first, second = (np.where(mask, geometry.gap, np.inf) for mask in allowed)
        return first, second

    nearest, later = np.min([gaps(pose) for pose in path], axis=0)
    reach += max(float(nearest.min()), 0.0)
    chosen, on_contact = nearest < reach, free.face == CONTACT
    turning = np.flatnonzero((later < reach) & ~chosen)
    if len(turning) and chosen.any():
        apart = cKDTree(free.points[chosen]).query(free.points[turning])[0]
        chosen[turning[apart <= folding + model.mesh.size_mm]] = True
        nearest = np.minimum(nearest, later)
    chosen |= np.asarray(free.hats @ (free.hats.T @ chosen)) > 0.0  # the edge of contact lies between two points
    if np.count_nonzero(chosen & on_contact) >= WHOLE_FACE * np.count_nonzero(on_contact):
        chosen |= on_contact
    order = np.argsort(nearest, kind="stable")  # so that points which touch come before those which do not
    return restrict(free, order[chosen[order]])


def poses(model: Model) -> list[ObjectPose]:
    """Return the poses at which rigid gaps are taken to find the candidate points."""
    return [ObjectPose(0.0), *targets(tuple(replace(leg, steps=_stations(leg)) for leg in model.legs))]


def _stations(leg: Leg) -> int:
    return int(np.clip(leg.steps, *_STATIONS)) if isinstance(leg.steps, int) else _STATIONS[1]
