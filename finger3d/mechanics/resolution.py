"""Whether the contact points resolve the shape of the object.

A contact point knows the object through one number, the gap averaged over its hat function.  What reaches into the
finger between the points, or is lost in an average, is compared with the exact object at rest: at the surface's
quadrature points and at the object's corners and tips the *hidden* depth is the overlap of object and finger less the
largest overlap that a contact point beside the place sees.
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
from finger3d.mechanics.history import ObjectPose, StepResult
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.problem import Problem, rigid_gap
from finger3d.objects import MeshObject, RigidObject, initial_contact

Box = tuple[float, float, float, float]

REFUSED = 0.5
"""Hidden depth over the depth of the press above which it is refused: most of the object is not seen."""

_WARNED = 0.1
_AIM = 0.05  # of the edge length that is named, as meshes are not regular
_STATIONS = 4  # along each leg, as for the approach
_BESIDE = {2: 4, 3: 16}  # contact points beside a place: with two rings, some lie all under the foot of a step
_PER_WAVE, _PER_RADIUS = 4.0, 2.0  # edges that a wavelength, and a radius, must have at least
_FINER, _TRIES = 0.8, 80  # down to 2e-8 of the edge length
_PATCH = 3  # edges on either side of a place
_SLOPE_STEP = 1e-6  # of the finger's height
_FORESEEN = 50  # the same before there is a mesh, at most


@dataclass(frozen=True)
class Hidden:
    """Part of the object that the contact points do not resolve.

    Attributes
    ----------
    share : largest hidden depth over the depth of the press
    seen : whether any contact point is reached
    depth_mm, target, place : hidden depth, the target where it is largest, and where (2,) along x and z
    """

    share: float
    seen: bool
    depth_mm: float
    target: ObjectPose
    place: Float


def hidden(
    model: Model, face: BoundarySurface, touch_mm: float, tips: Float | None, axes: tuple[str, ...] = ()
) -> Hidden:
    """Largest hidden depth over a model's path.

    Parameters
    ----------
    face : contact points of the meshed part
    touch_mm : height of the object's lowest point at first touch
    tips : (k, 2) mm, places along x and z to look at, which the object carries along, see `tips_of`; None: not known
    axes : symmetry planes of the meshed part
    """
    d = face.points.shape[1]
    upright = -float(model.object.frame(d)[0, 1])
    tree, count = KDTree(_flat(face.points)), min(_BESIDE[d], len(face.points))
    beside = tree.query(_flat(face.samples), k=count)[1].reshape(-1, count)
    path = targets(tuple(replace(leg, steps=_STATIONS) for leg in model.legs))
    deepest = max(t.depth_mm for t in path)
    found = Hidden(0.0, deepest <= 0.0, 0.0, path[-1], np.zeros(2))
    # at one place nothing that was hidden comes into sight by pressing less
    deepest_at = {(t.slide_x_mm, t.slide_z_mm): t for t in sorted(path, key=lambda t: t.depth_mm) if t.depth_mm > 0.0}
    for slide, target in deepest_at.items():
        seen = np.maximum(-rigid_gap(model, face, touch_mm, target), 0.0)
        found = replace(found, seen=found.seen or bool(seen.any()))
        at = np.zeros((0, d)) if tips is None else _on_finger(model, tips + slide, d)
        near = tree.query(np.where([a in axes for a in "xz"[: d - 1]], np.abs(_flat(at)), _flat(at)), k=count)[1]
        places, around = np.vstack([face.samples, at]), np.vstack([beside, near.reshape(-1, count)])
        missed = _overlap(model, places, touch_mm, target) - seen[around].max(axis=1) / upright
        worst = int(missed.argmax())
        depth = float(missed[worst])
        if tips is None and not any(slide):  # the place of first touch, wherever it is, is the deepest
            depth = max(depth, target.depth_mm - float(seen.max()) / upright)
        if depth > found.depth_mm:
            place = np.append(_flat(places[worst]), np.zeros(3 - d))
            found = Hidden(depth / deepest, found.seen, depth, target, place)
    return found


def tips_of(model: Model, place: tuple[float, float] | None) -> Float | None:
    """Places (k, 2) mm that a search could step over: the object's corners and tips, and that of first touch.

    None where the finger's surface is not known between its samples.
    """
    if place is None or isinstance(model.design, DesignSummary):
        return None
    at = np.vstack([model.object.landmarks(), [place]])
    return at if model.domain == "solid" else at * [1.0, 0.0]


def check(
    model: Model, face: BoundarySurface, touch_mm: float, place: tuple[float, float] | None, axes: tuple[str, ...] = ()
) -> None:
    """Refuse a press whose object passes between the contact points.

    Raises
    ------
    UnresolvedError
        With the edge length that resolves the object.
    """
    tips = tips_of(model, place)
    found = hidden(model, face, touch_mm, tips, axes)
    if found.share > REFUSED or not found.seen:
        size = needed_mm(model, touch_mm, found, tips)
        raise UnresolvedError(_sentence(model, found, size), size)


def warnings(problem: Problem) -> list[str]:
    """Warnings about an object that the contact points do not resolve."""
    model, touch = problem.model, problem.system.first_contact_mm
    tips = tips_of(model, problem.system.place_mm)
    return _messages(model, touch, tips, hidden(model, problem.surface, touch, tips, problem.axes))


def foreseen(model: Model, axes: tuple[str, ...]) -> list[str]:
    """The same before there is a mesh, for regular contact points around first touch, as far apart as its edges."""
    way, size = initial_contact(model.contact_path), model.mesh.size_mm
    reach = _FORESEEN * size
    (x0, x1, z0, z1), (x, z) = way.contact_box, way.place
    box = (max(x0, x - reach), min(x1, x + reach), max(z0, z - reach), min(z1, z + reach))
    # a mesh has points on its symmetry planes
    at = np.array([0.5 * size if axis in axes else place for axis, place in zip("xz", way.place, strict=True)])
    tips = tips_of(model, way.place)
    tips = None if tips is None else _within(tips, box)
    return _messages(
        model, way.first_contact_mm, tips, hidden(model, regular(model, box, size, at), way.first_contact_mm, tips)
    )


def _messages(model: Model, touch_mm: float, tips: Float | None, found: Hidden) -> list[str]:
    messages = _details(model)
    if found.share > _WARNED or not found.seen:
        messages.append(_sentence(model, found, needed_mm(model, touch_mm, found, tips)))
    return messages


def unseen(problem: Problem, frames: Sequence[StepResult]) -> list[str]:
    """Warnings about increments in which the object overlaps the finger at rest but reaches no contact point."""
    model, face, touch, missed = problem.model, problem.surface, problem.system.first_contact_mm, list[float]()
    for frame in frames:
        end = frame.target
        if end.depth_mm <= 0.0 or not frame.outcome.ok or (frame.state.status != OPEN).any():
            continue
        slid = end.slide_x_mm or end.slide_z_mm
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
    """Largest penetration (mm) of the deformed contact face into a rigid object, and the point where it occurs.

    In small strain displacements count along the normal only, as in the gap.

    Parameters
    ----------
    u : (n, d) mm, nodal displacement of the meshed part
    """
    model, face, target, d = problem.model, problem.surface, frame.target, problem.dim
    moved = face.interpolate @ u
    if not model.formulation.finite_strain:
        normal = model.object.frame(d)[0]
        moved = np.outer(moved @ normal, normal)
    at = face.samples + moved
    over = _overlap(model, at, problem.system.first_contact_mm, target)
    at, over = at[over > 0.0], over[over > 0.0]
    if not len(at):
        return 0.0, np.zeros(d)
    if isinstance(model.object, MeshObject):  # beside a wall the vertical overlap says little
        there = np.zeros((len(at), 3))
        there[:, :d] = at
        there -= [target.slide_x_mm, problem.system.first_contact_mm - target.depth_mm, target.slide_z_mm]
        over = np.minimum(over, -model.object.signed_distance(there)[0])
    else:
        over = over * _upright(model, at, target)
    worst = int(over.argmax())
    return max(float(over[worst]), 0.0), at[worst]


def inside(problem: Problem, frame: StepResult, u: Float) -> list[str]:
    """Warnings about penetration between the contact points at the end of a press."""
    if problem.model.object_compliance is not None:  # its surface has moved as well
        return []
    depth, at = penetration(problem, frame, u)
    if depth <= _WARNED * max(leg.depth_mm for leg in problem.model.legs):
        return []
    where = ", ".join(f"{axis} = {value:.3g}" for axis, value in zip("xyz", at, strict=False))
    return [
        f"at the end the finger's surface is up to {depth:.2g} mm inside the object between the contact points "
        f"({where} mm); lower mesh.size_mm"
    ]


def _upright(model: Model, at: Float, target: ObjectPose) -> Float:
    """Cosine (n,) of the object's slope over points (n, d)."""
    x = at[:, 0] - target.slide_x_mm
    z = at[:, 2] - target.slide_z_mm if at.shape[1] == 3 else np.zeros(len(at))
    step = _SLOPE_STEP * model.design.height_mm
    slopes = [model.object.height(x + a, z + b) - model.object.height(x - a, z - b) for a, b in ((step, 0), (0, step))]
    return 1.0 / np.sqrt(1.0 + sum((slope / (2.0 * step)) ** 2 for slope in slopes[: at.shape[1] - 1]))


def needed_mm(model: Model, touch_mm: float, found: Hidden, tips: Float | None) -> float | None:
    """Edge length at which regular contact points, around the place where most was hidden, see enough of the object.

    None where no length of use does, or the finger's surface is not known.
    """
    if tips is None:
        return None
    at, end, size = found.place, found.target, model.mesh.size_mm
    # the object stays where it is, so that what counts is beside it
    there = replace(model, legs=(Leg(end.depth_mm, end.slide_x_mm, end.slide_z_mm, steps=1),))
    for _ in range(_TRIES):
        size *= _FINER
        reach = _PATCH * size
        box = (at[0] - reach, at[0] + reach, at[1] - reach, at[1] + reach)
        tips = _within(tips + [end.slide_x_mm, end.slide_z_mm], box) - [end.slide_x_mm, end.slide_z_mm]
        if hidden(there, regular(model, box, size, at), touch_mm, tips).share <= _AIM:
            return _rounded(min(size, _resolving(model.object)))
    return None


def _within(places: Float, box: Box) -> Float:
    low, high = np.array([box[0], box[2]]), np.array([box[1], box[3]])
    return places[np.all((places >= low) & (places <= high), axis=1)]


def regular(model: Model, box: Box, size_mm: float, at: Float | None = None) -> BoundarySurface:
    """Contact points a distance apart over a box (x_min, x_max, z_min, z_max) mm, `at` (2,) in the middle of four."""
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
    none = sp.csr_matrix((len(points), 0)), sp.csr_matrix((len(samples), 0))
    return BoundarySurface(np.arange(len(points)), points, np.ones(len(points)), none[0], samples, mean, none[1])


def _lines(box: Sequence[float], half: float, size: float, at: float) -> Float:
    """Places of contact points along one axis, the finger's ends among them."""
    low, high = max(box[0] - size, -half), min(box[1] + size, half)
    first, last = math.ceil((low - at) / size - 0.5), math.floor((high - at) / size - 0.5)
    inner = at + (np.arange(first, last + 1) + 0.5) * size
    ends = [v for v in (low, high) if abs(v) == half]
    line = np.unique(np.concatenate([inner, ends]))
    return line if len(line) > 1 else np.array([low, high])


def _hats(line: Float) -> tuple[Float, sp.csr_matrix]:
    """Quadrature points (q,) between places (n,), and the mean of samples there over each place's hat (n, q)."""
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


def _flat(points: Float) -> Float:
    """Places (..., d - 1) along x and z."""
    return points[..., ::2] if points.shape[-1] == 3 else points[..., :1]


def _overlap(model: Model, at: Float, touch: float, target: ObjectPose) -> Float:
    """Vertical overlap (n,) mm of the object with points (n, d) of the finger at rest; -inf outside the object."""
    z = at[:, 2] if at.shape[1] == 3 else np.zeros(len(at))
    height = model.object.height(at[:, 0] - target.slide_x_mm, z - target.slide_z_mm)
    return np.nan_to_num(at[:, 1] - (height + touch - target.depth_mm), nan=-np.inf)


def _on_finger(model: Model, places: Float, dim: int) -> Float:
    """Points (n, d) mm of the finger's surface at places (k, 2) along x and z, less those beside it."""
    half = np.array([model.design.half_length_mm, 0.5 * model.design.width_mm])
    at = places[np.all(np.abs(places) <= half, axis=1)]
    y = model.design.top(at[:, 0], at[:, 1])
    return np.stack([at[:, 0], y, at[:, 1]], axis=1)[np.isfinite(y)][:, :dim]


def _sentence(model: Model, found: Hidden, size: float | None) -> str:
    depth, now = found.target.depth_mm, f"mesh.size_mm = {model.mesh.size_mm:g}"
    if found.seen:
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
