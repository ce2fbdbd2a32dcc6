"""Penetration of the finger's free surface into the object, and of the surface of a cavity into itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN
from finger3d.fem.mesh import CONTACT, FREE_FACES, TRIANGLES, Mesh
from finger3d.fem.recovery import displacement
from finger3d.fem.surface import BoundarySurface, contact_face, restrict
from finger3d.mechanics.discretise.contact_points import may_touch
from finger3d.mechanics.discretise.problem import Problem, free_surface, rigid_gap
from finger3d.mechanics.discretise.resolution import rounded_down, size_advice, vertical_overlap
from finger3d.mechanics.formulation import length_scale
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Model
from finger3d.objects import DistanceTracker, Move, ObjectPose

_TOUCHES = {True: 1e-9, False: 1e-3}
"""Penetration of points outside the candidates, over the depth, from which they count as in contact: on the contact
face (True), and on other faces (False), where points at a crease penetrate by as much as the mesh does not resolve."""


_ADVISE_ABOVE, _WARN_ABOVE = 0.01, 0.1
"""Penetration, over the depth of the press, above which a finer mesh is advised, and above which a warning is given."""

_ORDER, _ORDER_AT_CREASE = 1.5, 0.7
"""Power of the edge length with which penetration falls: at the edge of contact, beyond which the gap opens with the
distance to the power 1.5 (Johnson 1985, sec. 4.2), and at a sharp edge of the finger, where .5 to 1 were measured
(tests/test_mechanics_results.py)."""

_MARGIN = 0.9
"""Edge length that is advised, over the one that follows: penetration depends on where contact ends between points."""


@dataclass(frozen=True)
class SurfaceCheck:
    """The finger's free surface after an increment.

    Attributes
    ----------
    within_candidates : whether no point outside the candidates went through the object
    penetration_mm : largest penetration of the surface; under an elastic object that of the contact points only, where
        its deformed surface is known
    place : (d,) mm, that place
    face : number in `FREE_FACES` of its face
    at_crease : whether its facet, or one beside it, ends at a sharp edge of the finger; a surface that folds over there
        lifts the next facet
    depth_mm : largest depth of the press, to which the penetration is compared
    """

    within_candidates: bool
    penetration_mm: float
    place: Float
    face: int
    at_crease: bool
    depth_mm: float


def check_surface(
    problem: Problem, steps: Sequence[StepResult], free: BoundarySurface | None = None, moved: Iterable[Float] = ()
) -> list[SurfaceCheck]:
    """Check the free surface after each step; in small strain by one back-substitution for all of them.

    Parameters
    ----------
    free : the free surface, if it is known
    moved : nodal displacements (n, d) mm after each step, if they are known
    """
    tracker, rigid = DistanceTracker(), problem.model.object_compliance is None
    free = free or free_surface(problem.model, problem.body.mesh, problem.body.thickness)
    others = _others(problem, steps, free)
    hats, at_edge = free.hats.tocsc(), np.bincount(free.nodes)[free.nodes] > 1
    creased = hats @ (hats.T @ at_edge.astype(float)) > 0.0
    out, largest = [], reached_depth(problem.model, steps)
    for u, step in zip(moved or displacements(problem, steps), steps, strict=True):
        within = _stays_out(problem, u, step.target, others)
        samples = free.samples + free.interpolate @ u
        value, _ = tracker.distance(problem.placed(step.target), samples, 0.0)
        worst = int(value.argmin())
        depth = max(-float(value[worst]), 0.0) if rigid else step.penetration_mm
        corners = hats[:, [worst]].indices
        face, at_crease = int(free.face[corners[0]]), bool(creased[corners].any())
        out.append(SurfaceCheck(within, depth, samples[worst], face, at_crease, largest))
    return out


def penetration_warnings(problem: Problem, checks: Sequence[SurfaceCheck]) -> list[str]:
    """Return warnings about penetration between the contact points during a press."""
    return _penetration(problem, checks, _WARN_ABOVE, np.inf)


def penetration_advice(problem: Problem, checks: Sequence[SurfaceCheck]) -> list[str]:
    """Return advice about penetration of more than a hundredth of the depth that gives no warning."""
    return _penetration(problem, checks, _ADVISE_ABOVE, _WARN_ABOVE)


def reached_depth(model: Model, steps: Sequence[StepResult]) -> float:
    """Return the largest depth (mm) of the steps of a press, which may end early; that of its legs without steps."""
    return max((step.target.depth_mm for step in steps), default=0.0) or model.largest_depth_mm


def resolving_edge(check: SurfaceCheck) -> float:
    """Return the edge length, over the present one, at which penetration is a hundredth of the depth."""
    ratio = check.penetration_mm / check.depth_mm
    order = _ORDER_AT_CREASE if check.at_crease else _ORDER
    return float(min(1.0, _MARGIN * (_ADVISE_ABOVE / ratio) ** (1.0 / order))) if ratio > _ADVISE_ABOVE else 1.0


def _penetration(problem: Problem, checks: Sequence[SurfaceCheck], above: float, most: float) -> list[str]:
    """Return a line about the deepest place if its penetration over the depth is between two bounds."""
    deepest = max(checks, key=lambda check: check.penetration_mm, default=None)
    if deepest is None or not above * deepest.depth_mm < deepest.penetration_mm <= most * deepest.depth_mm:
        return []
    mesh, depth = problem.model.mesh, deepest.depth_mm
    where = ", ".join(f"{axis} = {value:.3g}" for axis, value in zip("xyz", deepest.place, strict=False))
    on_wall = deepest.face != CONTACT and not deepest.at_crease
    ratio, effect = resolving_edge(deepest), f"leaves about {_ADVISE_ABOVE:.0%}"
    if on_wall:
        cure = f"mesh.base_size_mm = {rounded_down(ratio * mesh.base_size_mm):g} {effect}"
    else:
        cure = size_advice(problem.model, ratio * mesh.size_mm, effect, "a finer one leaves less")
    if deepest.at_crease:
        cure += "; a fillet at that sharp edge of the finger leaves less"
    return [
        f"the finger's surface is up to {deepest.penetration_mm:.2g} mm, {deepest.penetration_mm / depth:.2g} of the "
        f"depth, inside the object between the contact points ({where} mm); {cure}"
    ]


def displacements(problem: Problem, steps: Sequence[StepResult]) -> Iterator[Float]:
    """Yield the nodal displacement (n, d) mm after each step."""
    for unknowns in formulation_of(problem.model).unknowns(problem, [step.meshed_state for step in steps]):
        yield displacement(problem.mesh, unknowns)


def beyond_candidates(problem: Problem, free: BoundarySurface | None = None) -> BoundarySurface:
    """Return the points of the free surface that are no candidates."""
    free = free or free_surface(problem.model, problem.body.mesh, problem.body.thickness)
    return restrict(free, np.flatnonzero(~np.isin(_key(free), _key(problem.system.surface))))


def _others(problem: Problem, steps: Sequence[StepResult], free: BoundarySurface) -> BoundarySurface:
    """Return the points of the free surface that are no candidates and could touch after some step."""
    others = beyond_candidates(problem, free)
    if problem.model.object.is_flat and steps:  # its normal is known everywhere
        normals = [problem.placed(step.target).distance(others.points)[1] for step in steps]
        finite = problem.model.finite_strain
        others = restrict(others, np.any([may_touch(others, normal, finite) for normal in normals], axis=0))
    return others


def _key(points: BoundarySurface) -> NDArray[np.int64]:
    """Return a number for every point, different for the faces that a vertex belongs to."""
    return np.asarray(points.nodes * len(FREE_FACES) + points.face)


def _stays_out(problem: Problem, u: Float, target: ObjectPose, others: BoundarySurface) -> bool:
    """Return whether no point of `others` went through the object."""
    if not len(others.nodes):
        return True
    gap, normal = formulation_of(problem.model).gap(problem, u, target, others)
    facing = may_touch(others, normal, problem.model.finite_strain)
    for on_contact, tolerance in _TOUCHES.items():
        points = facing & ((others.face == CONTACT) == on_contact)
        if gap[points].min(initial=np.inf) <= -tolerance * length_scale(problem, Move(target, target)):
            return False
    return True


def increments_without_contact(problem: Problem, steps: Sequence[StepResult]) -> list[str]:
    """Return warnings about increments in which the object overlaps the finger at rest but reaches no contact point."""
    model, face, touch_mm = problem.model, contact_face(problem.surface), problem.system.first_contact_mm
    missed: list[float] = []
    for step in steps:
        end = step.target
        if end.depth_mm <= 0.0 or not step.outcome.ok or (step.state.status != OPEN).any():
            continue
        slid = end.slide_x_mm or end.slide_z_mm or end.is_turned
        if (rigid_gap(problem.placed(end), problem.surface) < 0.0).any():  # the finger has not followed yet
            continue
        if not slid or (vertical_overlap(model, face.samples, touch_mm, end) > 0.0).any():
            missed.append(end.depth_mm)
    if not missed:
        return []
    return [
        f"{len(missed)} of {len(steps)} increments reach no contact point and have no force, at depths up to "
        f"{max(missed):.3g} mm; lower mesh.size_mm"
    ]


CAVITY = "cavity"
"""Label of the facets of inner surfaces."""


def cavity_warnings(mesh: Mesh, displacement: Float) -> list[str]:
    """Return a warning if the inner surface of a solid crosses itself: nothing keeps its faces apart.

    Parameters
    ----------
    mesh : the whole finger at rest, mm
    displacement : (n, 3) mm
    """
    facets = mesh.facets.get(CAVITY)
    if facets is None or not len(facets):
        return []
    from finger3d.geometry.surface import Triangles
    from finger3d.geometry.surface_checks import crossings

    triangles = facets[:, TRIANGLES].reshape(-1, 3) if facets.shape[1] == 6 else facets
    nodes, faces = np.unique(triangles, return_inverse=True)
    pairs = crossings(Triangles((mesh.points + displacement)[nodes], faces.reshape(-1, 3)))
    if not len(pairs):
        return []
    where = (mesh.points[nodes[faces.reshape(-1, 3)[pairs[0]]]]).mean(axis=0)
    return [
        "the inner surface of the finger crosses itself near x, y, z = "
        + ", ".join(f"{value:.3g}" for value in where)
        + " mm at rest: its faces do not touch in this model; press less deep, or make the wall thicker"
    ]
