"""Whether contact points are close enough together for the object that is pressed on them.

A contact point knows the object through one number, the gap averaged over its hat function.  What reaches into the
finger between the points, or is lost in an average, is compared with the exact object at rest: at the surface's
quadrature points and at the object's corners and tips the *hidden* depth is the overlap of object and finger less the
largest overlap that a contact point beside the place sees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import KDTree

from finger3d.errors import UnresolvedError
from finger3d.fem.surface import Surface
from finger3d.history import Target
from finger3d.model import Model
from finger3d.objects import Cylinder, Sphere, Wave, Wedge, approach
from finger3d.problem import rigid_gap, targets

Float = NDArray[np.float64]
Box = tuple[float, float, float, float]

REFUSED = 0.5
"""Hidden depth over the depth of the press above which it is refused: most of the object is not seen."""

_WARNED = 0.1
_AIM = 0.05  # of the edge length that is named, as meshes are not regular
_STATIONS = 4  # along each leg, as for the approach
_BESIDE = {2: 2, 3: 4}  # contact points that are beside a place
_PER_WAVE, _PER_RADIUS = 4.0, 2.0  # edges that a wavelength, and a radius, must have at least
_FINER, _TRIES = 0.8, 80  # down to 2e-8 of the edge length
_PATCH = 3  # edges on either side of a place
_FORESEEN = 50  # the same before there is a mesh, at most


@dataclass(frozen=True)
class Hidden:
    """What contact points do not see of the object.

    Attributes
    ----------
    share : largest hidden depth over the depth of the press
    seen : whether any contact point is reached
    depth_mm, target : hidden depth, and the target where it is largest
    """

    share: float
    seen: bool
    depth_mm: float
    target: Target


def hidden(model: Model, face: Surface, touch_mm: float, axes: tuple[str, ...] = (), box: Box | None = None) -> Hidden:
    """Largest hidden depth over a model's path.

    Parameters
    ----------
    face : contact points of the meshed part
    touch_mm : height of the object's lowest point at first touch
    axes : symmetry planes of the meshed part
    box : corners and tips of the object that count; None: all
    """
    d = face.points.shape[1]
    upright = -float(model.object.frame(d)[0, 1])
    beside = KDTree(_flat(face.points)).query(_flat(face.samples), k=min(_BESIDE[d], len(face.points)))[1]
    path = targets(tuple(replace(leg, steps=_STATIONS) for leg in model.legs))
    deepest = max(t.depth_mm for t in path)
    found = Hidden(0.0, deepest <= 0.0, 0.0, path[-1])
    # at one place nothing that was hidden comes into sight by pressing less
    deepest_at = {(t.slide_x_mm, t.slide_z_mm): t for t in sorted(path, key=lambda t: t.depth_mm) if t.depth_mm > 0.0}
    for target in deepest_at.values():
        seen = np.maximum(-rigid_gap(model, face, touch_mm, target), 0.0)
        best = seen[beside].reshape(len(face.samples), -1).max(axis=1)
        missed = [0.0, float((_overlap(model, face.samples, touch_mm, target) * upright - best).max())]
        if not target.slide_x_mm and not target.slide_z_mm:  # the place of first touch is the deepest
            missed.append(target.depth_mm * upright - float(seen.max()))
        missed.append(_at_tips(model, face, (touch_mm, upright), axes, target, seen, box))
        reached = found.seen or bool(seen.any())
        found = replace(found, seen=reached)
        if max(missed) > found.depth_mm * upright:
            depth = max(missed) / upright
            found = Hidden(depth / deepest, reached, depth, target)
    return found


def check(model: Model, face: Surface, touch_mm: float, axes: tuple[str, ...] = ()) -> None:
    """Refuse a press whose object passes between the contact points.

    Raises
    ------
    UnresolvedError
        With the edge length that resolves the object.
    """
    found = hidden(model, face, touch_mm, axes)
    if found.share > REFUSED or not found.seen:
        size = needed_mm(model, touch_mm, found.target)
        raise UnresolvedError(_sentence(model, found, size), size)


def warnings(model: Model, found: Hidden, touch_mm: float) -> list[str]:
    """What to tell of a press whose contact points see less than all of the object."""
    told = _details(model)
    if found.share > _WARNED or not found.seen:
        told.append(_sentence(model, found, needed_mm(model, touch_mm, found.target)))
    return told


def foreseen(model: Model, axes: tuple[str, ...]) -> list[str]:
    """The same before there is a mesh, for regular contact points around first touch, as far apart as its edges."""
    way, size = approach(*model.approach), model.mesh.size_mm
    reach = _FORESEEN * size
    box = [f(way.zone[2 * k + i], way.place[k] + s * reach) for k in (0, 1) for i, f, s in ((0, max, -1), (1, min, 1))]
    # a mesh has points on its symmetry planes
    at = np.array([0.5 * size if axis in axes else place for axis, place in zip("xz", way.place, strict=True)])
    around: Box = (box[0], box[1], box[2], box[3])
    found = hidden(model, regular(model, around, size, at), way.touch_mm, box=around)
    return warnings(model, found, way.touch_mm)


def unseen(model: Model, face: Surface, touch_mm: float, path: list[Target]) -> list[Target]:
    """Targets at which the object reaches into the finger at rest, and no contact point sees it."""
    found = []
    for target in path:
        if target.depth_mm <= 0.0 or (rigid_gap(model, face, touch_mm, target) < 0.0).any():
            continue
        slid = target.slide_x_mm or target.slide_z_mm
        if not slid or (_overlap(model, face.samples, touch_mm, target) > 0.0).any():
            found.append(target)
    return found


def needed_mm(model: Model, touch_mm: float, target: Target) -> float | None:
    """Edge length at which regular contact points around the deepest place of a target see enough of the object.

    None where no length of use does, or the design's surface is not known.
    """
    if not hasattr(model.design, "top"):
        return None
    at = _deepest_place(model, touch_mm, target)
    pressed = replace(model, legs=_single(target))
    size = model.mesh.size_mm
    for _ in range(_TRIES):
        size *= _FINER
        reach = _PATCH * size
        box = (at[0] - reach, at[0] + reach, at[1] - reach, at[1] + reach)
        if hidden(pressed, regular(model, box, size, at), touch_mm, box=box).share <= _AIM:
            return _rounded(min(size, _detail(model.object)[1]))
    return None


def regular(model: Model, box: Box, size_mm: float, at: Float | None = None) -> Surface:
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
    return Surface(np.arange(len(points)), points, np.ones(len(points)), none[0], samples, mean, none[1])


def _lines(box: Any, half: float, size: float, at: float) -> Float:
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
    """Places (n, 1 | 2) along x and z."""
    return points[:, ::2] if points.shape[1] == 3 else points[:, :1]


def _overlap(model: Model, at: Float, touch: float, target: Target) -> Float:
    """How deep (n,) mm the object would be below places (n, d) of the finger at rest; -inf beside it."""
    z = at[:, 2] if at.shape[1] == 3 else np.zeros(len(at))
    height = model.object.height(at[:, 0] - target.slide_x_mm, z - target.slide_z_mm)
    return np.nan_to_num(at[:, 1] - (height + touch - target.depth_mm), nan=-np.inf)


def _tips(model: Model, target: Target, solid: bool) -> Float:
    """Corners and tips (n, d) of object and finger, mm, on the finger's surface."""
    design = model.design
    at = model.object.landmarks() + [target.slide_x_mm, target.slide_z_mm]
    half = np.array([design.half_length_mm, 0.5 * design.width_mm if solid else 0.0])
    at = at if solid else at * [1.0, 0.0]
    at = at[np.all(np.abs(at) <= half, axis=1)]
    y = design.top(at[:, 0], at[:, 1])
    return np.stack([at[:, 0], y, at[:, 1]], axis=1)[np.isfinite(y)][:, : 3 if solid else 2]


def _at_tips(
    model: Model, face: Surface, heights: tuple[float, float], axes: tuple[str, ...], target: Target, seen: Float,
    box: Box | None,
) -> float:  # fmt: skip
    """Largest hidden depth at the object's corners and tips, mm along the normal."""
    touch, upright = heights
    d = face.points.shape[1]
    at = _tips(model, target, d == 3) if hasattr(model.design, "top") else np.zeros((0, d))
    if box is not None:
        flat = _flat(at)
        at = at[np.all((flat >= box[0 : 2 * d - 2 : 2]) & (flat <= box[1 : 2 * d - 2 : 2]), axis=1)]
    deep = _overlap(model, at, touch, target)
    at, deep = at[deep > 0.0], deep[deep > 0.0]
    if not len(at):
        return 0.0
    flat = np.where([a in axes for a in "xz"[: d - 1]], np.abs(_flat(at)), _flat(at))
    near = KDTree(_flat(face.points)).query(flat, k=min(_BESIDE[d], len(face.points)))[1].reshape(len(at), -1)
    return float((deep * upright - seen[near].max(axis=1)).max())


def _deepest_place(model: Model, touch: float, target: Target) -> Float:
    """Where (2,) along x and z the object reaches deepest into the finger at rest."""
    solid = model.domain == "solid"
    if not target.slide_x_mm and not target.slide_z_mm:
        return np.array(approach(*model.approach).place)
    way = approach(*model.approach)
    at = np.vstack([_tips(model, target, solid), regular(model, way.zone, model.mesh.size_mm).samples])
    best = at[int(np.argmax(_overlap(model, at, touch, target)))]
    return np.array([best[0], best[2] if solid else 0.0])


def _single(target: Target) -> Any:
    from finger3d.model import Leg

    return (Leg(target.depth_mm, target.slide_x_mm, target.slide_z_mm, steps=1),)


def _sentence(model: Model, found: Hidden, size: float | None) -> str:
    depth, now = found.target.depth_mm, f"mesh.size_mm = {model.mesh.size_mm:g}"
    if found.seen:
        what = f"at a depth of {depth:.4g} mm the object is up to {found.depth_mm:.2g} mm deeper between the contact "
        what += "points than they see"
    else:
        what = f"at a depth of {depth:.4g} mm the object is between the contact points and reaches none of them"
    if size is not None:
        return f"{now}: {what}; mesh.size_mm = {size:g} resolves it"
    if not hasattr(model.design, "top"):
        return f"{now}: {what}; condense the scene with a smaller mesh.size_mm"
    return f"{now}: {what}; no edge length above {_FINER**_TRIES * model.mesh.size_mm:.1g} mm resolves it"


def _details(model: Model) -> list[str]:
    """Lengths of the object that are short beside the edges."""
    name, largest = _detail(model.object)
    size = model.mesh.size_mm
    if size <= largest * (1.0 + 1e-9):
        return []
    return [
        f"object.{name} = {getattr(model.object, name):g}: contact points {size:g} mm apart (mesh.size_mm) see only "
        f"averages of it; mesh.size_mm = {_rounded(largest):g} resolves it"
    ]


def _rounded(size: float) -> float:
    """Down to two significant digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1.0 + 1e-12)) * unit:.2g}")


def _detail(thing: Any) -> tuple[str, float]:
    """The object's shortest length by name, and the largest edge length (mm) that resolves it."""
    if isinstance(thing, Wave):
        return "wavelength_mm", thing.wavelength_mm / _PER_WAVE
    if isinstance(thing, Sphere | Cylinder):
        return "radius_mm", thing.radius_mm / _PER_RADIUS
    if isinstance(thing, Wedge) and thing.tip_radius_mm > 0.0:
        return "tip_radius_mm", thing.tip_radius_mm / _PER_RADIUS
    return "", math.inf
