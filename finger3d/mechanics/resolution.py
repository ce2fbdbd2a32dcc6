"""Whether the contact points resolve the shape of the object.

The gap of a contact point is an average over its hat function, so that a part of the object between the points, or
one that is lost in the average, is not represented.  The *unresolved overlap* at a place is the overlap of object and
finger at rest there, less the largest overlap at the nearest contact points.  It is evaluated at the quadrature
points of the contact face and at the landmarks of the object, its corners and tips.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import KDTree

from finger3d._types import Float
from finger3d.contact.friction import OPEN
from finger3d.errors import UnresolvedError
from finger3d.fem.traces import BoundarySurface
from finger3d.geometry.design import DesignSummary
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.problem import Problem, rigid_gap
from finger3d.objects import ObjectPose, PlacedObject, RigidObject, initial_contact

Box = tuple[float, float, float, float]

REFUSE_ABOVE, _WARN_ABOVE = 0.5, 0.1
"""Unresolved overlap, over the depth of the press, above which a press is refused, and above which it is warned of."""

_RESOLVED = 0.05
"""The same for the edge length that a message recommends; a mesh is less regular than the points it is found with."""

_STATIONS = 4
"""Poses along each leg at which the overlap is evaluated."""

_NEAREST_POINTS = {2: 4, 3: 16}
"""Contact points compared with a place: with two rings of neighbours, all may lie under the foot of a step."""

_COVERED = 0.5
"""Least share of a point's hat function that the object must cover for its overlap to be seen."""

_PER_WAVE, _PER_RADIUS = 4.0, 2.0
"""Least number of edges in a wavelength, and in a radius, of the object."""

_FINER, _TRIES = 0.8, 80
"""Ratio of successive edge lengths in the search for one that resolves the object, and their number."""

_PATCH = 3
"""Half width, in edges, of the patch of contact points in that search."""

_REACH = 50
"""Half width, in edges, of the patch of contact points before there is a mesh."""


@dataclass(frozen=True)
class UnresolvedOverlap:
    """Part of the object that the contact points do not resolve.

    Attributes
    ----------
    share : largest unresolved overlap over the depth of the press
    in_contact : whether the object reaches any contact point
    depth_mm : the unresolved overlap, mm
    target : the pose where it is largest
    place : (2,) array, where it is largest, along x and z, mm
    """

    share: float
    in_contact: bool
    depth_mm: float
    target: ObjectPose
    place: Float


def unresolved_overlap(
    model: Model, face: BoundarySurface, touch_mm: float, landmarks: Float | None, axes: tuple[str, ...] = ()
) -> UnresolvedOverlap:
    """Return the largest unresolved overlap over the path of a model.

    Parameters
    ----------
    face : contact points of the meshed part
    touch_mm : height of the object's lowest point at first touch
    landmarks : (k, 3) array, mm, or None
        Points in the object's own coordinates, see `landmarks_of`; None if they are not known.
    axes : symmetry planes of the meshed part
    """
    d = face.points.shape[1]
    tree, count = KDTree(_horizontal(face.points)), min(_NEAREST_POINTS[d], len(face.points))
    nearest = tree.query(_horizontal(face.samples), k=count)[1].reshape(-1, count)
    path = targets(tuple(replace(leg, steps=_STATIONS) for leg in model.legs))
    deepest = max(t.depth_mm for t in path)
    found = UnresolvedOverlap(0.0, deepest <= 0.0, 0.0, path[-1], np.zeros(2))
    # at a given slide the unresolved overlap is largest at the largest depth
    poses = [t for t in sorted(path, key=lambda t: t.depth_mm) if t.depth_mm > 0.0]
    deepest_at = {(t.slide_x_mm, t.slide_z_mm, *t.turns): t for t in poses}
    for slide, target in deepest_at.items():
        overlap = _mean_overlap(model, face, touch_mm, target)
        found = replace(found, in_contact=found.in_contact or bool(overlap.any()))
        placed = PlacedObject.of(model.object, touch_mm, target)
        at = np.zeros((0, d)) if landmarks is None else _surface_points(model, _over(placed, landmarks, d), d)
        mirrored = np.where([a in axes for a in "xz"[: d - 1]], np.abs(_horizontal(at)), _horizontal(at))
        near = tree.query(mirrored, k=count)[1]
        places, around = np.vstack([face.samples, at]), np.vstack([nearest, near.reshape(-1, count)])
        missed = _overlap(model, places, touch_mm, target) - overlap[around].max(axis=1)
        worst = int(missed.argmax())
        depth = float(missed[worst])
        if landmarks is None and not any(slide):  # the overlap is largest at first touch, wherever that is
            depth = max(depth, target.depth_mm - float(overlap.max()))
        if depth > found.depth_mm:
            place = np.append(_horizontal(places[worst]), np.zeros(3 - d))
            found = UnresolvedOverlap(depth / deepest, found.in_contact, depth, target, place)
    return found


def landmarks_of(model: Model, touch_mm: float, place: tuple[float, float] | None) -> Float | None:
    """Return the corners and tips of the object and the point of first touch (k, 3), mm, which sampling could miss.

    They are given in the object's own coordinates, and are None if the surface of the finger is not known between its
    samples.
    """
    if place is None or isinstance(model.design, DesignSummary):
        return None
    placed = PlacedObject.of(model.object, touch_mm)
    x, z = np.array([place]).T
    return np.vstack([model.object.landmarks(), placed.to_own(np.stack([x, placed.height(x, z), z], axis=1))])


def _over(placed: PlacedObject, landmarks: Float, dim: int) -> Float:
    """Return the places (k, 2) along x and z of points (k, 3) of an object in a pose; z = 0 in a section."""
    places = placed.to_scene(landmarks)[:, ::2]
    return places if dim == 3 else places * [1.0, 0.0]


def check(
    model: Model, face: BoundarySurface, touch_mm: float, place: tuple[float, float] | None, axes: tuple[str, ...] = ()
) -> None:
    """Raise an error if the object passes between the contact points.

    Raises
    ------
    UnresolvedError
        It names the edge length that resolves the object.
    """
    landmarks = landmarks_of(model, touch_mm, place)
    found = unresolved_overlap(model, face, touch_mm, landmarks, axes)
    if found.share > REFUSE_ABOVE or not found.in_contact:
        size = resolving_size(model, touch_mm, found, landmarks)
        raise UnresolvedError(_refusal(model, found, size), size)


def warnings(problem: Problem) -> list[str]:
    """Return warnings about an object that the contact points do not resolve."""
    model, touch = problem.model, problem.system.first_contact_mm
    landmarks = landmarks_of(model, touch, problem.system.place_mm)
    found = unresolved_overlap(model, problem.surface, touch, landmarks, problem.axes)
    return _messages(model, touch, landmarks, found)


def warnings_before_meshing(model: Model, axes: tuple[str, ...]) -> list[str]:
    """Return the same warnings before meshing, for a regular grid of contact points around first touch."""
    contact, size = initial_contact(model.contact_path), model.mesh.size_mm
    reach = _REACH * size
    (x0, x1, z0, z1), (x, z) = contact.contact_box, contact.place
    box = (max(x0, x - reach), min(x1, x + reach), max(z0, z - reach), min(z1, z + reach))
    # a mesh has points on its symmetry planes
    at = np.array([0.5 * size if axis in axes else place for axis, place in zip("xz", contact.place, strict=True)])
    touch, points = contact.first_contact_mm, regular_points(model, box, size, at)
    landmarks = landmarks_of(model, touch, contact.place)
    if landmarks is not None:
        landmarks = _within(landmarks, PlacedObject.of(model.object, touch), box, points.points.shape[1])
    return _messages(model, touch, landmarks, unresolved_overlap(model, points, touch, landmarks))


def _messages(model: Model, touch_mm: float, landmarks: Float | None, found: UnresolvedOverlap) -> list[str]:
    messages = _details(model)
    if found.share > _WARN_ABOVE or not found.in_contact:
        messages.append(_refusal(model, found, resolving_size(model, touch_mm, found, landmarks)))
    return messages


def increments_without_contact(problem: Problem, frames: Sequence[StepResult]) -> list[str]:
    """Return warnings about increments in which the object overlaps the finger at rest but reaches no contact point."""
    model, face, touch, missed = problem.model, problem.surface, problem.system.first_contact_mm, list[float]()
    for frame in frames:
        end = frame.target
        if end.depth_mm <= 0.0 or not frame.outcome.ok or (frame.state.status != OPEN).any():
            continue
        slid = end.slide_x_mm or end.slide_z_mm or end.is_turned
        if (rigid_gap(model, face, touch, end) < 0.0).any():  # the finger has not followed yet
            continue
        if not slid or (_overlap(model, face.samples, touch, end) > 0.0).any():
            missed.append(end.depth_mm)
    if not missed:
        return []
    return [
        f"{len(missed)} of {len(frames)} increments reach no contact point and have no force, at depths up to "
        f"{max(missed):.3g} mm; lower mesh.size_mm"
    ]


def penetration(problem: Problem, frame: StepResult, u: Float) -> tuple[float, Float]:
    """Return the largest penetration (mm) of the deformed contact face into a rigid object, and where it occurs (d,).

    Parameters
    ----------
    u : (n, d) array, mm
        Nodal displacement of the meshed part.
    """
    face, placed = problem.surface, problem.placed(frame.target)
    at = face.samples + face.interpolate @ u
    value, _ = placed.distance(at)
    worst = int(value.argmin())
    return max(-float(value[worst]), 0.0), at[worst]


def penetration_warnings(problem: Problem, frame: StepResult, u: Float) -> list[str]:
    """Return warnings about penetration between the contact points at the end of a press."""
    if problem.model.object_compliance is not None:  # its surface is deformed as well
        return []
    depth, at = penetration(problem, frame, u)
    if depth <= _WARN_ABOVE * max(leg.depth_mm for leg in problem.model.legs):
        return []
    where = ", ".join(f"{axis} = {value:.3g}" for axis, value in zip("xyz", at, strict=False))
    return [
        f"at the end the finger's surface is up to {depth:.2g} mm inside the object between the contact points "
        f"({where} mm); lower mesh.size_mm"
    ]


def resolving_size(model: Model, touch_mm: float, found: UnresolvedOverlap, landmarks: Float | None) -> float | None:
    """Return the edge length at which a regular patch of contact points resolves the object.

    The patch is where the unresolved overlap is largest.  The length is None if there is none of use, or if the surface
    of the finger is not known.
    """
    if landmarks is None:
        return None
    at, end, size = found.place, found.target, model.mesh.size_mm
    # the object does not move: only its shape near the place counts
    leg = Leg(end.depth_mm, end.slide_x_mm, end.slide_z_mm, 1, None, *end.turns)
    there, placed = replace(model, legs=(leg,)), PlacedObject.of(model.object, touch_mm, end)
    for _ in range(_TRIES):
        size *= _FINER
        reach = _PATCH * size
        box = (at[0] - reach, at[0] + reach, at[1] - reach, at[1] + reach)
        points = regular_points(model, box, size, at)
        landmarks = _within(landmarks, placed, box, points.points.shape[1])
        if unresolved_overlap(there, points, touch_mm, landmarks).share <= _RESOLVED:
            return _rounded(min(size, _resolving(model.object)))
    return None


def _within(landmarks: Float, placed: PlacedObject, box: Box, dim: int) -> Float:
    """Return those of an object's points (k, 3) that lie over a box in a pose."""
    low, high, places = np.array([box[0], box[2]]), np.array([box[1], box[3]]), _over(placed, landmarks, dim)
    return landmarks[np.all((places >= low) & (places <= high), axis=1)]


def regular_points(model: Model, box: Box, size_mm: float, at: Float | None = None) -> BoundarySurface:
    """Return a regular grid of contact points over a box.

    Parameters
    ----------
    box : (x_min, x_max, z_min, z_max), mm
    size_mm : distance of the points
    at : (2,) array, mm
        Place in the middle of four points; by default the origin.
    """
    design, solid = model.design, model.domain == "solid"
    half = (design.half_length_mm, 0.5 * design.width_mm)
    at = np.zeros(2) if at is None else at
    lines = [_lines(box[2 * k : 2 * k + 2], half[k], size_mm, at[k]) for k in range(2 if solid else 1)]
    hats = [_hats(line) for line in lines]
    places, means = [h[0] for h in hats], [h[1] for h in hats]
    samples = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(lines))
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    mean = means[0] if len(means) == 1 else sp.kron(*means, format="csr")
    height, y = (design.top(p[:, 0], p[:, 1] if solid else 0.0 * p[:, 0]) for p in (samples, points))
    used = np.isfinite(height)
    mean = sp.csr_matrix(mean)[:, used]
    weight = np.asarray(mean.sum(axis=1)).ravel()
    kept = (weight > 0.0) & np.isfinite(y)
    mean = sp.csr_matrix(sp.diags_array(1.0 / weight[kept]) @ mean[kept])
    samples, points = (np.insert(p, 1, v, axis=1) for p, v in ((samples[used], height[used]), (points[kept], y[kept])))
    return BoundarySurface(
        nodes=np.arange(len(points)),
        points=points,
        area=np.ones(len(points)),
        normals=np.zeros_like(points),
        trace=sp.csr_matrix((len(points), 0)),
        samples=samples,
        average=mean,
        interpolate=sp.csr_matrix((len(samples), 0)),
        hats=mean,
    )


def _lines(box: Sequence[float], half: float, size: float, at: float) -> Float:
    """Return the coordinates of contact points along one axis, with the ends of the finger."""
    low, high = max(box[0] - size, -half), min(box[1] + size, half)
    first, last = math.ceil((low - at) / size - 0.5), math.floor((high - at) / size - 0.5)
    inner = at + (np.arange(first, last + 1) + 0.5) * size
    ends = [v for v in (low, high) if abs(v) == half]
    line = np.unique(np.concatenate([inner, ends]))
    return line if len(line) > 1 else np.array([low, high])


def _hats(line: Float) -> tuple[Float, sp.csr_matrix]:
    """Return quadrature points (q,) between coordinates (n,), and the mean of samples over each hat function (n, q)."""
    x, w = np.polynomial.legendre.leggauss(4)
    share = 0.5 * (x + 1.0)
    steps = np.diff(line)
    places = (line[:-1, None] + share * steps[:, None]).ravel()
    mean = np.zeros((len(line), len(steps), 4))
    number = np.arange(len(steps))
    mean[number, number] = (1.0 - share) * w * steps[:, None]
    mean[number + 1, number] = share * w * steps[:, None]
    rows = mean.reshape(len(line), -1)
    return places, sp.csr_matrix(rows / rows.sum(axis=1, keepdims=True))


def _horizontal(points: Float) -> Float:
    """Return the coordinates (..., d - 1) of points (..., d) along x and z."""
    return points[..., ::2] if points.shape[-1] == 3 else points[..., :1]


def _overlap(model: Model, at: Float, touch: float, target: ObjectPose) -> Float:
    """Return the vertical overlap (n,), mm, of the object with points (n, d) of the finger; -inf outside the object."""
    z = at[:, 2] if at.shape[1] == 3 else np.zeros(len(at))
    height = PlacedObject.of(model.object, touch, target).height(at[:, 0], z)
    return np.nan_to_num(at[:, 1] - height, nan=-np.inf)


def _mean_overlap(model: Model, face: BoundarySurface, touch: float, target: ObjectPose) -> Float:
    """Return the vertical overlap (c,), mm, that contact points see at rest: the mean over what the object covers.

    It is 0 for a point of whose hat function the object covers less than half.
    """
    overlap = _overlap(model, face.samples, touch, target)
    covered = np.isfinite(overlap)
    share = np.asarray(face.average @ covered)
    mean = np.asarray(face.average @ np.where(covered, overlap, 0.0)) / np.maximum(share, _COVERED)
    return np.where(share < _COVERED, 0.0, np.maximum(mean, 0.0))


def _surface_points(model: Model, places: Float, dim: int) -> Float:
    """Return the points (n, d), mm, of the surface of the finger at places (k, 2), without those outside it."""
    half = np.array([model.design.half_length_mm, 0.5 * model.design.width_mm])
    at = places[np.all(np.abs(places) <= half, axis=1)]
    y = model.design.top(at[:, 0], at[:, 1])
    return np.stack([at[:, 0], y, at[:, 1]], axis=1)[np.isfinite(y)][:, :dim]


def _refusal(model: Model, found: UnresolvedOverlap, size: float | None) -> str:
    depth, now = found.target.depth_mm, f"mesh.size_mm = {model.mesh.size_mm:g}"
    if found.in_contact:
        what = f"at a depth of {depth:.4g} mm the object is up to {found.depth_mm:.2g} mm deeper between the contact "
        what += "points than they see"
    else:
        what = f"at a depth of {depth:.4g} mm the object is between the contact points and reaches none of them"
    if size is not None:
        return f"{now}: {what}; mesh.size_mm = {size:g} resolves it"
    if isinstance(model.design, DesignSummary):
        return f"{now}: {what}; condense the scene with a smaller mesh.size_mm"
    return f"{now}: {what}; no edge length above {_FINER**_TRIES * model.mesh.size_mm:.1g} mm resolves it"


def _details(model: Model) -> list[str]:
    """Messages about lengths of the object that are short compared with the edges of the mesh."""
    detail, size, largest = model.object.detail, model.mesh.size_mm, _resolving(model.object)
    if detail is None or size <= largest * (1.0 + 1e-9):
        return []
    return [
        f"object.{detail.key} = {detail.length_mm:g}: contact points {size:g} mm apart (mesh.size_mm) see only "
        f"averages of it; mesh.size_mm = {_rounded(largest):g} resolves it"
    ]


def _rounded(size: float) -> float:
    """Round down to two significant digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1.0 + 1e-12)) * unit:.2g}")


def _resolving(obj: RigidObject) -> float:
    """Return the largest edge length (mm) that resolves the object's shortest length."""
    if obj.detail is None:
        return math.inf
    return obj.detail.length_mm / (_PER_WAVE if obj.detail.kind == "wavelength" else _PER_RADIUS)
