"""From a model to a problem, and from a problem to frames: one condensation, then contact increment by increment."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from threading import Event
from typing import TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._machine import cores
from finger3d.contact.acceleration import one_thread
from finger3d.contact.friction import SLIP
from finger3d.contact.rules import STEP_DEPENDENT_RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.assembly import Elasticity, stiffness
from finger3d.fem.condense import condense, stiffened
from finger3d.fem.simplex import Mesh, unfold
from finger3d.fem.traces import BoundarySurface, displacement_row, local_rows, restrict, strain_row, surface
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import ContactPoints, ObjectPose, StepResult
from finger3d.mechanics.model import EmbeddedBars, Gauge, Leg, Model
from finger3d.mechanics.problem import (
    AUTO_START,
    Problem,
    between,
    reflect_into_part,
    rigid_gap,
    scatter_to_points,
    targets,
    values_of,
)
from finger3d.mechanics.resolution import check
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.limits import check_rows
from finger3d.meshing.swept import mesh_section
from finger3d.objects import initial_contact

Float = NDArray[np.float64]
Variant = TypeVar("Variant")
Result = TypeVar("Result")

__all__ = [
    "AUTO_START",
    "Problem",
    "build",
    "contact_box",
    "contact_within_candidates",
    "step_within_candidates",
    "map_parallel",
    "gauge_row",
    "march",
    "symmetry",
    "targets",
    "candidates_cover_face",
]

MARGIN = 0.3  # candidate points reach to a rigid gap of this share of the depth; checked after the solution
_CUTS = 6
_MANY = 100  # gauges: each takes some milliseconds
_WORTH = 1000  # contact rows from which presses at once are quicker than in turn
_LOOKS = 20  # and where rigid gaps are, for the candidate points
_NEARLY = 0.95  # of the face: so many candidates, and all are: a few more rows cost less than to check every press


def symmetry(model: Model) -> tuple[str, ...]:
    """Planes about which body, object and path are mirror images."""
    if model.symmetry is not None:
        return model.symmetry
    slides = {"x": [leg.slide_x_mm for leg in model.legs], "z": [leg.slide_z_mm for leg in model.legs]}
    axes = ("x", "z") if model.domain == "solid" else ("x",)
    body = model.design.mirrors()
    inner = model.inclusions.mirrors(model) if model.inclusions else axes
    return tuple(a for a in axes if a in body and a in inner and a in model.object.mirrors() and not any(slides[a]))


def contact_box(model: Model) -> tuple[float, float, float, float]:
    """Box (x_min, x_max, z_min, z_max) mm over which the rigid object would overlap the finger at rest."""
    return initial_contact(*model.approach).contact_box


def build(model: Model, say: Callable[[str], None] = lambda text: None, margin: float = MARGIN) -> Problem:
    """Mesh, assemble and condense a model.

    Raises
    ------
    UnresolvedError
        If the object passes between the contact points.
    """
    design = model.design
    way = initial_contact(*model.approach)
    touch, zone, axes = way.first_contact_mm, way.contact_box, symmetry(model)
    if model.domain == "solid":
        mesh, report = mesh_solid(design, model.mesh, zone, axes, say)
    else:
        mesh, report = mesh_section(design, model.mesh, zone, axes)
    thickness = 1.0 if mesh.dim == 3 else design.width_mm
    everywhere = surface(mesh, "contact", thickness)
    check(model, everywhere, touch, way.place, axes)
    say("assembling")
    start = time.perf_counter()
    elastic = Elasticity.of(model.material.E_MPa, model.material.nu, model.domain == "plane-stress")
    matrix = stiffness(mesh, elastic, thickness)
    face = _candidates(model, everywhere, touch, margin)
    kept = _kept_rows(face, axes)
    check_rows(len(kept), len(model.gauges))
    if len(model.gauges) >= _MANY:
        say(f"placing {len(model.gauges)} gauges")
    rows = local_rows(face, model.object.frame(mesh.dim))[kept]
    inlay = model.inclusions.discretise(model, mesh, axes) if model.inclusions else None
    read = [inlay.gauge_weights @ inlay.rows, inlay.rows] if inlay else [gauge_row(mesh, g, axes) for g in model.gauges]
    assembly = time.perf_counter() - start
    say(f"condensing {matrix.upper.shape[0]} unknowns to {len(face.nodes)} contact points")
    held = _held(model, mesh, axes)
    condensed = condense(matrix, held, sp.vstack([rows, *read], format="csr"))
    compliance, gauge_rows = _read(condensed.compliance, kept, len(face.nodes), mesh.dim, len(model.gauges))
    parent, sign, share, points = _unfolded(model, mesh, face, axes)
    bare = Problem(
        model, mesh, report, elastic, matrix, face, condensed, compliance,
        gauge_rows, kept, held, thickness, touch, axes, points, parent, sign, share,
        {**report.seconds, "assembly": assembly, "condensation": condensed.seconds}, place_mm=way.place,
    )  # fmt: skip
    yields: Float | float = 0.0
    if model.object_compliance:
        response = model.object_compliance.respond(bare, zone, say)
        yields = response.compliance
        bare = replace(
            bare,
            delassus=bare.delassus + yields,
            object_factorizations=response.factorizations,
            seconds=bare.seconds | response.seconds,
        )
    return replace(_laid(bare, inlay, yields), without_inclusions=bare) if inlay else bare


def _laid(bare: Problem, inlay: EmbeddedBars, yields: Float | float) -> Problem:
    """The problem with its inclusions in place; the object's own compliance `yields` is none of theirs."""
    rows, kept, count = bare.condensed.compliance.copy(), bare.active_dofs, len(inlay.bar_stiffness)
    beyond = inlay.subgrid_compliance(rows[-count:, -count:])
    rows[len(kept) :, len(kept) :] += beyond
    held_by = stiffened(rows, inlay.bar_stiffness)
    compliance, gauge_rows = _read(held_by, kept, len(bare.surface.nodes), bare.dim, len(inlay.gauge_weights))
    return replace(
        bare, condensed=replace(bare.condensed, compliance=rows), delassus=compliance + yields,
        gauge_rows=gauge_rows, bar_stiffness=inlay.bar_stiffness, subgrid_compliance=beyond,
    )  # fmt: skip


def _read(rows: Float, kept: NDArray[np.int64], count: int, dim: int, gauges: int) -> tuple[Float, Float]:
    """Compliance of contact points, and strain of the gauges per force on them, from that of condensed rows."""
    strain = np.zeros((gauges, count * dim))
    strain[:, kept] = rows[len(kept) : len(kept) + gauges, : len(kept)]
    return scatter_to_points(rows, kept, count, dim), strain


def step_within_candidates(problem: Problem, frame: StepResult) -> bool:
    """Whether no point of the contact face outside the candidates went through the object."""
    return contact_within_candidates(problem, [frame])[0]


def contact_within_candidates(problem: Problem, frames: Sequence[StepResult]) -> list[bool]:
    """The same for each of several frames; in small strain at the price of one back-substitution."""
    if candidates_cover_face(problem):
        return [True] * len(frames)
    face = surface(problem.mesh, "contact", problem.thickness)
    others = ~np.isin(face.nodes, problem.surface.nodes)
    parts, ends = [f.part for f in frames], [f.target for f in frames]
    gaps = problem.model.formulation.gaps(problem, parts, ends, restrict(face, others))
    return [bool(gap.min() > -1e-9 * end.depth_mm) for gap, end in zip(gaps, ends, strict=True)]


def candidates_cover_face(problem: Problem) -> bool:
    """Whether all of the contact face are candidates, so that nothing is beyond them."""
    corners = problem.mesh.facets["contact"][:, : problem.dim]
    return len(np.unique(corners)) == len(problem.surface.nodes)


def _candidates(model: Model, face: BoundarySurface, touch: float, margin: float) -> BoundarySurface:
    path = targets(tuple(replace(leg, steps=_stations(leg)) for leg in model.legs))
    nearest = np.min([rigid_gap(model, face, touch, t) for t in path], axis=0)
    reach = margin * max(t.depth_mm for t in path) + max(float(nearest.min()), 0.0)
    order = np.argsort(nearest, kind="stable")  # so that points which touch come before those which do not
    near = order[nearest[order] < reach]
    return restrict(face, order if len(near) >= _NEARLY * len(order) else near)


def _stations(leg: Leg) -> int:
    return min(leg.steps, _LOOKS) if isinstance(leg.steps, int) else _LOOKS


def _kept_rows(face: BoundarySurface, axes: tuple[str, ...]) -> NDArray[np.int64]:
    """Numbers point * d + direction of the contact rows, less the tangent across a symmetry plane for points on it."""
    keep = np.ones(face.points.shape, dtype=bool)
    for axis in axes:
        keep[:, {"x": 1, "z": 2}[axis]] &= face.points[:, "xyz".index(axis)] != 0.0
    return np.flatnonzero(keep.ravel())


def gauge_row(mesh: Mesh, gauge: Gauge, axes: tuple[str, ...]) -> sp.csr_matrix:
    """Row of one gauge, read from the mirrored part where the gauge lies in an image."""
    along = gauge.direction
    if gauge.length_mm == 0.0:
        return strain_row(mesh, *reflect_into_part(gauge.middle, along, axes, mesh.dim))
    start, end = (displacement_row(mesh, *reflect_into_part(x, along, axes, mesh.dim)) for x in gauge.ends)
    return sp.csr_matrix((end - start) / gauge.length_mm)


def _held(model: Model, mesh: Mesh, axes: tuple[str, ...]) -> NDArray[np.int64]:
    """Unknowns that are zero: the base, across each symmetry plane, and the end faces where they are held."""
    d = mesh.dim
    base = np.unique(mesh.facets["base"])
    held = [(base[:, None] * d + np.arange(d)).ravel()]
    held += [np.unique(mesh.facets["symmetry_" + a]) * d + "xyz".index(a) for a in axes]
    if model.held_ends and d == 3:
        held.append(np.unique(mesh.facets["ends"]) * d + 2)
    return np.unique(np.concatenate(held))


def _unfolded(
    model: Model, mesh: Mesh, face: BoundarySurface, axes: tuple[str, ...]
) -> tuple[NDArray[np.int64], Float, Float, ContactPoints]:
    d = mesh.dim
    numbers = tuple("xyz".index(a) for a in axes)
    facets = {"contact": mesh.facets["contact"]}
    shape, parent_all, sign_all = unfold(Mesh(mesh.points, mesh.cells[:0], facets), numbers)
    number = np.full(len(mesh.points), -1)
    number[face.nodes] = np.arange(len(face.nodes))
    nodes = np.flatnonzero(number[parent_all] >= 0)
    parent, world_sign = number[parent_all[nodes]], sign_all[nodes]
    on_planes = (
        sum((face.points[parent][:, i] == 0.0).astype(int) for i in numbers) if numbers else np.zeros(len(nodes))
    )
    share = 2.0 ** np.asarray(on_planes)
    at = np.zeros((len(nodes), 3))
    at[:, :d] = face.points[parent] * world_sign
    points = ContactPoints(
        nodes, at, face.area[parent] * share, model.object.frame(d), model.design.width_mm / 2.0,
        0.75 * model.mesh.size_mm, _edges(shape.facets["contact"][:, :d], nodes),
    )  # fmt: skip
    return parent, world_sign[:, [1, 0, 2][:d]], share, points


def _edges(corners: NDArray[np.int64], nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges (e, 2) of facets with vertices (f, d), as positions in the ascending `nodes` (m,) that hold both ends."""
    pairs = np.vstack([corners[:, [i, j]] for i in range(corners.shape[1]) for j in range(i)])
    ends = np.minimum(np.searchsorted(nodes, pairs), len(nodes) - 1)
    ends = np.sort(ends[(nodes[ends] == pairs).all(axis=1)], axis=1)
    return np.unique(ends, axis=0)


def march(
    problem: Problem,
    near: Sequence[Float] = (),
    workspace: Workspace | None = None,
    cancel: Event | None = None,
) -> Iterator[StepResult]:
    """Frames of all legs in turn; stops after the first increment that did not settle.

    Under the paper's rule an increment that cycled is handed on as it is, and never cut: that is what the rule does.

    Parameters
    ----------
    problem : the condensed body, its path and its law of friction
    near : forces (c, d) N at the ends of the increments of a press much like this one, where these may start; they
        save iterations and decide nothing
    workspace : what an earlier press of the same body left; empty unless given
    cancel : once it is set, the press ends before its next increment

    Raises
    ------
    CancelledError
        If `cancel` is set.
    """
    most_cuts = 0 if problem.model.rule in STEP_DEPENDENT_RULES else _CUTS
    at = problem.origin
    kinematics = problem.model.formulation
    workspace = workspace or kinematics.workspace()
    state = kinematics.start(problem)
    pace: tuple[ObjectPose, Float] | None = None
    work = dissipation = 0.0
    # what the gauges would read if nothing were embedded: the same path in the same body without
    bare = problem.without_inclusions
    beside = march(replace(bare, model=problem.model), workspace=workspace) if bare else None
    for number, target in enumerate(targets(problem.model.legs)):
        if cancel is not None and cancel.is_set():
            raise CancelledError
        guess = near[number] if number < len(near) else _guess(state, at, target, pace)
        found, done = _increment(problem, workspace, state, at, target, most_cuts, guess)
        for before, after, a, b in done:
            work += _work(problem, before, after, a, b)
            dissipation += _dissipated(problem, before, after)
        pace = at, state.force
        state, at = found.state, target
        yield StepResult(
            target, problem.unfold(state), state, problem.model.object.lowest(target.slide_x_mm, target.slide_z_mm),
            kinematics.gauges(problem, state) | _free(problem, beside), work, dissipation,
            found.outcome, found.residual, found.iterations, found.method,
        )  # fmt: skip
        if not (found.outcome.ok or found.outcome.is_cycle):
            return


def map_parallel(
    problem: Problem,
    press: Callable[[Variant, Sequence[Result], Workspace, Event], Result],
    variants: Sequence[Variant],
    most: int | None = None,
) -> Generator[Result, None, None]:
    """Press one body as several variants, and yield the results in the order of the variants.

    Presses run at once, each on one thread, if the body has enough contact points for that to pay and the formulation
    factors nothing on the way; otherwise one after another.  Closing the generator cancels those that run.

    Parameters
    ----------
    problem : Problem
        The condensed body.
    press : function of a variant, the last two results known, a workspace, and the event that cancels it
        The results may serve as initial guess; workspace and event are for `march`.
    variants : sequence
    most : int, optional
        Largest number of presses at once; the number of cores unless given.
    """
    formulation = problem.model.formulation
    known: tuple[Result, ...] = ()
    at_once = min(len(variants), cores() if most is None else most)
    cancel = Event()
    if len(problem.active_dofs) < _WORTH or at_once < 2 or formulation.refactorises:
        workspace = formulation.workspace()
        for variant in variants:
            known = (*known, press(variant, known, workspace, cancel))[-2:]
            yield known[-1]
        return
    waiting = iter(variants)
    # The limit on threads is set once around the pool: a limit set by a press would undo that of another.
    with one_thread(), ThreadPoolExecutor(at_once) as pool:

        def submitted(count: int) -> list[Future[Result]]:
            return [
                pool.submit(press, variant, known, formulation.workspace(), cancel)
                for variant in islice(waiting, count)
            ]

        running = deque(submitted(at_once))
        try:
            while running:
                known = (*known, running.popleft().result())[-2:]
                running.extend(submitted(1))
                yield known[-1]
        finally:
            cancel.set()
            pool.shutdown(cancel_futures=True)


def _free(problem: Problem, beside: Iterator[StepResult] | None) -> dict[str, float]:
    """Free strain of every gauge by name, ``_free`` added; NaN once the path beside has failed, none without one."""
    if beside is None:
        return {}
    frame = next(beside, None)
    known = frame is not None and (frame.outcome.ok or frame.outcome.is_cycle)
    return {f"{g.name}_free": frame.gauges[g.name] if frame and known else np.nan for g in problem.model.gauges}


def _guess(state: ContactState, a: ObjectPose, b: ObjectPose, pace: tuple[ObjectPose, Float] | None) -> Float | None:
    """Forces continued at their pace, where the path goes straight on from the increment before."""
    if pace is None:
        return None
    before, now = np.subtract(values_of(a), values_of(pace[0])), np.subtract(values_of(b), values_of(a))
    ratio = float(now @ before) / float(before @ before)
    if ratio <= 0.0 or not np.allclose(now, ratio * before):
        return None
    return state.force + ratio * (state.force - pace[1])


_Done = list[tuple[ContactState, ContactState, ObjectPose, ObjectPose]]


def _increment(
    problem: Problem,
    workspace: Workspace,
    state: ContactState,
    a: ObjectPose,
    b: ObjectPose,
    cuts: int,
    guess: Float | None = None,
) -> tuple[ContactSolution, _Done]:
    """Advance from a to b; an increment that does not settle is cut in two, from the state restored."""
    found = problem.model.formulation.increment(problem, state, a, b, guess, workspace)
    if found.outcome.ok or cuts == 0:
        return found, [(state, found.state, a, b)]
    middle = between(a, b, 0.5)
    first, done = _increment(problem, workspace, state, a, middle, cuts - 1)
    if not first.outcome.ok:
        return replace(first, state=state, iterations=first.iterations + found.iterations), done
    second, more = _increment(problem, workspace, first.state, middle, b, cuts - 1)
    return replace(
        second,
        residual=max(first.residual, second.residual),
        iterations=found.iterations + first.iterations + second.iterations,
        method="cut back",
    ), done + more


def _work(problem: Problem, before: ContactState, after: ContactState, a: ObjectPose, b: ObjectPose) -> float:
    """Work (mJ) of the object on the finger in an increment: mean contact force times the displacement it acts through.

    A point that comes into contact, or leaves it, has its force for a part of the increment only; the change of its
    gap is no path of the force.  In small strain the sum is exactly the change of stored energy plus the trapezoidal
    sum of friction times slip.
    """
    moved = np.array([b.slide_x_mm - a.slide_x_mm, a.depth_mm - b.depth_mm, b.slide_z_mm - a.slide_z_mm])
    mean = 0.5 * (problem.world_force(before) + problem.world_force(after))
    normal = 0.5 * (before.force[:, 0] + after.force[:, 0])
    if not problem.model.formulation.finite_strain:
        closed = after.gap - before.gap
        if moved[0] or moved[2]:
            # the object's profile moves under a point: its force does work where the finger follows the profile
            n = problem.model.object.frame(problem.dim)[0]
            closed -= problem.gap(b) - problem.gap(a) + n @ moved[: problem.dim]
    else:
        # beside the object a gap is arbitrary; none is closed by more than the object moves
        reach = float(np.linalg.norm(moved))
        closed = np.minimum(after.gap, reach) - np.minimum(before.gap, reach)
    return float(mean.sum(axis=0) @ moved) + _summed(problem, normal * closed)


def _dissipated(problem: Problem, before: ContactState, after: ContactState) -> float:
    """Frictional dissipation (mJ) in an increment: slip times the friction under the mean normal force; never negative.

    The direction of friction, and the coefficient, are those at the end of the increment.
    """
    slips = after.status == SLIP
    lost = -np.sum(after.force[:, 1:] * (after.accumulated_slip - before.accumulated_slip), axis=1) * slips
    end = after.force[:, 0]
    share = np.divide(0.5 * (before.force[:, 0] + end), end, out=np.ones_like(end), where=end > 0.0)
    return _summed(problem, lost * share)


def _summed(problem: Problem, values: Float) -> float:
    """Sum over the points of the whole finger of values (c,) of the meshed part."""
    return float((values[problem.image_of] * problem.multiplicity).sum())
