"""Whether the contact points resolve the shape of the object, and the edge length at which they would.

The gap of a contact point is an average over its hat function, so that a part of the object between the points, or
one that is lost in the average, is not represented.  The *unresolved overlap* at a place is the overlap of object and
finger at rest there, less the largest overlap at the nearest contact points.  It is evaluated at the quadrature
points of the contact face and at the landmarks of the object, its corners and tips.

Overlaps are vertical.  At a flank of an object that is wide compared with an edge of the mesh, they are taken along the
normal, and points of walls and ends count too: a flank may touch the finger from the side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.spatial import KDTree

from finger3d._types import Float
from finger3d.errors import UnresolvedError
from finger3d.fem.mesh import CONTACT
from finger3d.fem.surface import BoundarySurface, contact_face, restrict
from finger3d.geometry.design import DesignSummary
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem, rigid_gap
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import targets
from finger3d.meshing.generate import is_meshable
from finger3d.objects import ObjectPose, PlacedObject, RigidObject

_LATTICE, _POSES = 100, 4
"""Places along each side of the finger at which the object is looked for, and poses along each leg."""


def is_meshable_at(model: Model, size: float) -> bool:
    """Return whether a press with an edge length (mm) in the contact zone is estimated to fit into memory."""
    options = replace(model.mesh, size_mm=size, base_size_mm=max(size, model.mesh.base_size_mm))
    dim, zone, axes = 3 if model.domain == "solid" else 2, model.first_contact.contact_box, symmetry(model)
    extents = [2.0 * model.design.half_length_mm, model.design.width_mm][: dim - 1]
    rows = dim * _candidate_share(model) * math.prod(extent / size for extent in extents) / 2 ** len(axes)
    return is_meshable(model.design, options, zone, dim, axes, rows)


def _candidate_share(model: Model) -> float:
    """Return the share of the finger's plan that comes near the object, where contact points are candidates."""
    width, line = model.design.width_mm * (model.domain == "solid"), np.linspace(-0.5, 0.5, _LATTICE)
    x, z = np.reshape(np.meshgrid(2.0 * model.design.half_length_mm * line, width * line), (2, -1))
    y, path = model.design.top(x, z), targets(tuple(replace(leg, steps=_POSES) for leg in model.legs))
    placed = (PlacedObject.of(model.object, model.first_contact.first_contact_mm, pose) for pose in path)
    near = np.any([obj.overlap(x, y, z) > -MARGIN * model.largest_depth_mm for obj in placed], axis=0)
    return float(near.mean())


def size_advice(model: Model, size: float, effect: str, otherwise: str) -> str:
    """Return the advice of an edge length (mm), rounded down, and its effect, or of something else without memory."""
    size = rounded_down(size)
    if is_meshable_at(model, size):
        return f"mesh.size_mm = {size:g} {effect}"
    return f"no mesh.size_mm whose press fits into this machine's memory {effect}; {otherwise}"


def rounded_down(size: float) -> float:
    """Return a length rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1.0 + 1e-12)) * unit:.2g}")


Box = tuple[float, float, float, float]


def regular_points(model: Model, box: Box, size_mm: float, middle: Float | None = None) -> BoundarySurface:
    """Return a regular grid of contact points over a box.

    Parameters
    ----------
    box : (x_min, x_max, z_min, z_max), mm
    size_mm : distance of the points
    middle : (2,) array, mm
        Place in the middle of four points; by default the origin.
    """
    design, solid = model.design, model.domain == "solid"
    half = (design.half_length_mm, 0.5 * design.width_mm)
    middle = np.zeros(2) if middle is None else middle
    lines = [_lines(box[2 * k : 2 * k + 2], half[k], size_mm, middle[k]) for k in range(2 if solid else 1)]
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
        face=np.full(len(points), CONTACT, dtype=np.int8),
        points=points,
        area=np.ones(len(points)),
        normals=np.zeros_like(points),
        trace=sp.csr_matrix((len(points), 0)),
        samples=samples,
        average=mean,
        interpolate=sp.csr_matrix((len(samples), 0)),
        hats=mean,
    )


def _lines(box: Sequence[float], half: float, size: float, middle: float) -> Float:
    """Return the coordinates of contact points along one axis, with the ends of the finger."""
    low, high = max(box[0] - size, -half), min(box[1] + size, half)
    first, last = math.ceil((low - middle) / size - 0.5), math.floor((high - middle) / size - 0.5)
    inner = middle + (np.arange(first, last + 1) + 0.5) * size
    ends = [v for v in (low, high) if abs(v) == half]
    line = np.unique(np.concatenate([inner, ends]))
    return line if len(line) > 1 else np.array([low, high])


def _hats(line: Float) -> tuple[Float, sp.csr_matrix]:
    """Return quadrature points (q,) between coordinates (n,), and the mean of samples over each hat function (n, q)."""
    x, w = np.polynomial.legendre.leggauss(4)
    weight = 0.5 * (x + 1.0)
    steps = np.diff(line)
    places = (line[:-1, None] + weight * steps[:, None]).ravel()
    mean = np.zeros((len(line), len(steps), 4))
    number = np.arange(len(steps))
    mean[number, number] = (1.0 - weight) * w * steps[:, None]
    mean[number + 1, number] = weight * w * steps[:, None]
    rows = mean.reshape(len(line), -1)
    return places, sp.csr_matrix(rows / rows.sum(axis=1, keepdims=True))


REFUSE_ABOVE, _WARN_ABOVE = 0.5, 0.1
"""Unresolved overlap, over the depth of the press, above which a press is refused, and above which it warns."""

_RESOLVED = 0.05
"""The same for a recommended edge length; it is found on regular points, and those of a mesh are less regular."""

_STATIONS = 4
"""Poses along each leg at which the overlap is evaluated."""

_NEAREST_POINTS = {2: 4, 3: 16}
"""Contact points compared with a place: with two rings of neighbours, all may lie under the foot of a step."""

_MOST_CHORD = 0.5
"""Depth, over the object's mean chord, from which contact is looked for at a smaller depth too."""

_COVERED = 0.5
"""Least share of a point's hat function that the object must cover for its overlap to be seen."""

_WIDE = 2.0
"""Thickness of an object, in edges, from which its flanks are resolved by points along their normals."""

_COLUMN = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Shares of an overlap, from below, at which the thickness of the object is looked at."""

_GRAZES = 1e-9
"""Distance, in edges, at which a place counts as inside the object."""

_AT_ONCE = 100
"""Places whose overlap along normals is found at once."""

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
    ratio : largest unresolved overlap over the depth of the press
    in_contact : whether the object reaches any contact point
    depth_mm : the unresolved overlap, mm
    target : the pose where it is largest
    place : (2,) array, where it is largest, along x and z, mm
    """

    ratio: float
    in_contact: bool
    depth_mm: float
    target: ObjectPose
    place: Float


def unresolved_overlap(
    model: Model, free: BoundarySurface, touch_mm: float, landmarks: Float | None, axes: tuple[str, ...] = ()
) -> UnresolvedOverlap:
    """Return the largest unresolved overlap over the path of a model.

    Parameters
    ----------
    free : contact points of the meshed part, on all faces
    touch_mm : height of the object's lowest point at first touch
    landmarks : (k, 3) array, mm, or None
        Points in the object's own coordinates, see `landmarks_of`; None if they are not known.
    axes : symmetry planes of the meshed part
    """
    face, beside, d = contact_face(free), restrict(free, free.face != CONTACT), free.points.shape[1]
    if not len(face.nodes):  # only walls may touch
        face = beside
    tree, count = KDTree(_horizontal(face.points)), min(_NEAREST_POINTS[d], len(face.points))
    nearest = tree.query(_horizontal(face.samples), k=count)[1].reshape(-1, count)
    path = targets(tuple(replace(leg, steps=_STATIONS) for leg in model.legs))
    deepest = max(t.depth_mm for t in path)
    unresolved = UnresolvedOverlap(0.0, deepest <= 0.0, 0.0, path[-1], np.zeros(2))
    # at a given slide the unresolved overlap is largest at the largest depth
    poses = [t for t in sorted(path, key=lambda t: t.depth_mm) if t.depth_mm > 0.0]
    deepest_at = {(t.slide_x_mm, t.slide_z_mm, *t.turns): t for t in poses}
    for slide, target in deepest_at.items():
        overlap = _mean_overlap(model, face, touch_mm, target)
        placed = PlacedObject.of(model.object, touch_mm, target)
        points = np.zeros((0, d)) if landmarks is None else _surface_points(model, _over(placed, landmarks, d), d)
        mirrored = np.where([a in axes for a in "xz"[: d - 1]], np.abs(_horizontal(points)), _horizontal(points))
        near = tree.query(mirrored, k=count)[1]
        places, around = np.vstack([face.samples, points]), np.vstack([nearest, near.reshape(-1, count)])
        vertical = vertical_overlap(model, places, touch_mm, target)
        if not unresolved.in_contact:
            under = face.average @ (vertical[: len(face.samples)] > 0.0) > 0.0  # no other can be inside
            # an object deeper than it is thick has left the finger at rest behind
            shallow = min(target.depth_mm, _MOST_CHORD * model.object.mean_chord(-placed.turned[1]))
            touched = any(
                (rigid_gap(PlacedObject.of(model.object, touch_mm, pose), part) < 0.0).any()
                for pose in (target, replace(target, depth_mm=shallow))
                for part in (restrict(face, under), beside)
            )
            unresolved = replace(unresolved, in_contact=touched)
        missed = vertical - overlap[around].max(axis=1)
        along_normals = partial(_along_normals, model, free, placed)
        worst, depth = _worst(along_normals, places, vertical, missed, _WARN_ABOVE * deepest)
        if landmarks is None and not any(slide):  # the overlap is largest at first touch, wherever that is
            depth = max(depth, target.depth_mm - float(overlap.max()))
        if depth > unresolved.depth_mm:
            place = np.append(_horizontal(places[worst]), np.zeros(3 - d))
            unresolved = UnresolvedOverlap(depth / deepest, unresolved.in_contact, depth, target, place)
    return unresolved


def _worst(
    along_normals: Callable[[Float, Float, Float], Float], places: Float, overlap: Float, missed: Float, least: float
) -> tuple[int, float]:
    """Return the number of the place with the largest unresolved overlap, and that overlap (mm).

    The vertical ones are bounds of those along normals, which are looked at from the largest down to `least`, as
    `_along_normals` returns them.
    """
    order, left, largest = np.argsort(-missed), missed.copy(), -math.inf
    for first in range(0, len(order), _AT_ONCE):
        some = order[first : first + _AT_ONCE]
        if missed[some[0]] <= max(largest, least):
            break
        left[some] = along_normals(places[some], overlap[some], missed[some])
        largest = max(largest, float(left[some].max()))
    worst = int(left.argmax())
    return worst, float(left[worst])


def _along_normals(
    model: Model, free: BoundarySurface, placed: PlacedObject, places: Float, overlap: Float, missed: Float
) -> Float:
    """Return the unresolved overlaps (k,) at places (k, d): along the normals of wide flanks where that is less.

    The column below a place, down to the object's lower surface, must nowhere lie in a thin part of the object.

    Parameters
    ----------
    overlap, missed : (k,) mm, vertical overlaps, and what of them is not resolved
    """
    wide, unresolved = np.flatnonzero(np.isfinite(overlap)), np.full(len(places), -np.inf)
    for fraction in _COLUMN:
        points = places[wide] - np.outer((1.0 - fraction) * overlap[wide], np.eye(places.shape[1])[1])
        value, gradient = placed.distance(points)
        inwards = np.maximum(np.minimum(fraction * overlap[wide], _WIDE * model.mesh.size_mm) + value, 0.0)
        touching = value < _GRAZES * model.mesh.size_mm
        thin = touching & (placed.distance(points - inwards[:, None] * gradient)[0] >= 0.0)
        inside = touching & ~thin
        if inside.any():
            unseen = -value[inside] - _seen(free, placed, points[inside])
            unresolved[wide[inside]] = np.maximum(unresolved[wide[inside]], unseen)
        wide = wide[~thin]
    flanks = wide[np.isfinite(unresolved[wide])]
    out = missed.copy()
    out[flanks] = np.minimum(missed[flanks], unresolved[flanks])
    return out


def _seen(free: BoundarySurface, placed: PlacedObject, places: Float) -> Float:
    """Return the largest penetration (k,) mm that the contact points nearest to some places (k, d) see."""
    count = min(_NEAREST_POINTS[places.shape[1]], len(free.points))
    points, near = np.unique(KDTree(free.points).query(places, k=count)[1], return_inverse=True)
    depth = np.maximum(-rigid_gap(placed, restrict(free, points)), 0.0)
    return np.asarray(depth[near.reshape(len(places), count)].max(axis=1))


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
    model: Model, free: BoundarySurface, touch_mm: float, place: tuple[float, float] | None, axes: tuple[str, ...] = ()
) -> None:
    """Raise an error if the object passes between the contact points.

    Raises
    ------
    UnresolvedError
        It names the edge length that resolves the object.
    """
    landmarks = landmarks_of(model, touch_mm, place)
    unresolved = unresolved_overlap(model, free, touch_mm, landmarks, axes)
    if unresolved.ratio > REFUSE_ABOVE or not unresolved.in_contact:
        size = resolving_size(model, touch_mm, unresolved, landmarks)
        raise UnresolvedError(_refusal(model, unresolved, size), size)


def warnings(problem: Problem) -> list[str]:
    """Return warnings about an object that the contact points do not resolve."""
    model, touch_mm = problem.model, problem.system.first_contact_mm
    landmarks = landmarks_of(model, touch_mm, problem.system.place_mm)
    unresolved = unresolved_overlap(model, problem.surface, touch_mm, landmarks, problem.axes)
    return _messages(model, touch_mm, landmarks, unresolved)


def warnings_before_meshing(model: Model, axes: tuple[str, ...]) -> list[str]:
    """Return the same warnings before meshing, for a regular grid of contact points around first touch."""
    contact, size = model.first_contact, model.mesh.size_mm
    reach = _REACH * size
    (x0, x1, z0, z1), (x, z) = contact.contact_box, contact.place
    box = (max(x0, x - reach), min(x1, x + reach), max(z0, z - reach), min(z1, z + reach))
    # a mesh has points on its symmetry planes
    middle = np.array([0.5 * size if axis in axes else place for axis, place in zip("xz", contact.place, strict=True)])
    touch_mm, points = contact.first_contact_mm, regular_points(model, box, size, middle)
    landmarks = landmarks_of(model, touch_mm, contact.place)
    if landmarks is not None:
        landmarks = _within(landmarks, PlacedObject.of(model.object, touch_mm), box, points.points.shape[1])
    return _messages(model, touch_mm, landmarks, unresolved_overlap(model, points, touch_mm, landmarks))


def _messages(model: Model, touch_mm: float, landmarks: Float | None, unresolved: UnresolvedOverlap) -> list[str]:
    messages = unresolved_details(model)
    if unresolved.ratio > _WARN_ABOVE or not unresolved.in_contact:
        messages.append(_refusal(model, unresolved, resolving_size(model, touch_mm, unresolved, landmarks)))
    return messages


def resolving_size(
    model: Model, touch_mm: float, unresolved: UnresolvedOverlap, landmarks: Float | None
) -> float | None:
    """Return the edge length at which a regular patch of contact points resolves the object.

    The patch is where the unresolved overlap is largest.  The length is None if there is none of use, if no such mesh
    fits into memory, or if the surface of the finger is not known.
    """
    if landmarks is None:
        return None
    place, end, size = unresolved.place, unresolved.target, model.mesh.size_mm
    # the object does not move: only its shape near the place counts
    leg = Leg(end.depth_mm, end.slide_x_mm, end.slide_z_mm, 1, None, *end.turns)
    placed = PlacedObject.of(model.object, touch_mm, end)
    for _ in range(_TRIES):
        size *= _FINER
        reach = _PATCH * size
        box = (place[0] - reach, place[0] + reach, place[1] - reach, place[1] + reach)
        points = regular_points(model, box, size, place)
        landmarks = _within(landmarks, placed, box, points.points.shape[1])
        there = replace(model, legs=(leg,), mesh=replace(model.mesh, size_mm=size))
        seen = unresolved_overlap(there, points, touch_mm, landmarks)
        if seen.in_contact and seen.ratio <= _RESOLVED:
            size = rounded_down(min(size, _resolving(model.object)))
            return size if is_meshable_at(model, size) else None
    return None


def _within(landmarks: Float, placed: PlacedObject, box: Box, dim: int) -> Float:
    """Return those of an object's points (k, 3) that lie over a box in a pose."""
    low, high, places = np.array([box[0], box[2]]), np.array([box[1], box[3]]), _over(placed, landmarks, dim)
    return landmarks[np.all((places >= low) & (places <= high), axis=1)]


def _horizontal(points: Float) -> Float:
    """Return the coordinates (..., d - 1) of points (..., d) along x and z."""
    return points[..., ::2] if points.shape[-1] == 3 else points[..., :1]


def vertical_overlap(model: Model, points: Float, touch_mm: float, target: ObjectPose) -> Float:
    """Return the vertical overlap (n,), mm, of the object with points (n, d) of the finger; -inf outside the object."""
    z = points[:, 2] if points.shape[1] == 3 else np.zeros(len(points))
    return PlacedObject.of(model.object, touch_mm, target).overlap(points[:, 0], points[:, 1], z)


def _mean_overlap(model: Model, face: BoundarySurface, touch_mm: float, target: ObjectPose) -> Float:
    """Return the vertical overlap (c,), mm, that contact points see at rest: the mean over what the object covers.

    It is 0 for a point of whose hat function the object covers less than half.
    """
    overlap = vertical_overlap(model, face.samples, touch_mm, target)
    covered = np.isfinite(overlap)
    fraction = np.asarray(face.average @ covered)
    mean = np.asarray(face.average @ np.where(covered, overlap, 0.0)) / np.maximum(fraction, _COVERED)
    return np.where(fraction < _COVERED, 0.0, np.maximum(mean, 0.0))


def _surface_points(model: Model, places: Float, dim: int) -> Float:
    """Return the points (n, d), mm, of the surface of the finger at places (k, 2), without those outside it."""
    half = np.array([model.design.half_length_mm, 0.5 * model.design.width_mm])
    inside = places[np.all(np.abs(places) <= half, axis=1)]
    y = model.design.top(inside[:, 0], inside[:, 1])
    return np.stack([inside[:, 0], y, inside[:, 1]], axis=1)[np.isfinite(y)][:, :dim]


def _refusal(model: Model, unresolved: UnresolvedOverlap, size: float | None) -> str:
    depth, now = unresolved.target.depth_mm, f"mesh.size_mm = {model.mesh.size_mm:g}"
    if unresolved.in_contact:
        deeper = f"{unresolved.depth_mm:.2g} mm deeper between the contact points than they see"
        what = f"at a depth of {depth:.4g} mm the object is up to {deeper}"
    else:
        what = f"at a depth of {depth:.4g} mm the object is between the contact points and reaches none of them"
    if size is not None:
        return f"{now}: {what}; mesh.size_mm = {size:g} resolves it"
    if isinstance(model.design, DesignSummary):
        return f"{now}: {what}; condense the scene with a smaller mesh.size_mm"
    cure = "press deeper, or with a thicker or blunter object"
    return f"{now}: {what}; no mesh.size_mm whose press fits into this machine's memory resolves it; {cure}"


def unresolved_details(model: Model) -> list[str]:
    """Return messages about lengths of the object that are short compared with the edges of the mesh."""
    detail, size, largest = model.object.detail, model.mesh.size_mm, _resolving(model.object)
    if detail is None or size <= largest * (1.0 + 1e-9):
        return []
    blunter = f"choose a larger object.{detail.key}"
    return [
        f"object.{detail.key} = {detail.length_mm:g}: contact points {size:g} mm apart (mesh.size_mm) see only "
        f"averages of it; {size_advice(model, largest, 'resolves it', blunter)}"
    ]


def _resolving(obj: RigidObject) -> float:
    """Return the largest edge length (mm) that resolves the object's shortest length."""
    if obj.detail is None:
        return math.inf
    return obj.detail.length_mm / (_PER_WAVE if obj.detail.kind == "wavelength" else _PER_RADIUS)
