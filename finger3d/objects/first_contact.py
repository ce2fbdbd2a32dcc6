"""First touch of finger and object, and checks of the object's path."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finger3d._types import Float, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.objects.placed import Move, ObjectPose, PlacedObject
from finger3d.objects.rigid import RigidObject

Top = Callable[[Float, Float], Float]

_GRID = (401, 41)
_COARSE = (201, 31)  # for the extent of a contact, which the mesh rounds to its edges
_ZOOM = 11
_ZOOMS = 8
_PLACES = 8  # best places that are searched further: bumps and teeth may be equally high
_STEEP = math.tan(math.radians(80.0))  # a flank that runs into the finger faster than this is a wall
_STRIDES = 60
_TURN = math.radians(5.0)  # between poses at which a turning object is looked at
_NOTHING = 1e-9  # of the finger's extent: a contact as narrow as this has no area


@dataclass(frozen=True)
class ContactPath:
    """Rigid object and its path into the finger.

    Attributes
    ----------
    top : the finger's height over (x, z), nan beside it
    object : the rigid object
    half_length_mm, half_width_mm : half extents of the finger; a section has half width 0
    poses : of the object on its path
    landmarks : (k, 2) mm, corners of the finger that a search on a grid could miss
    by_force : those of the poses whose depth is a forecast for a force, under which the object touches
    walls_touch : whether the finger's walls and ends may touch the object too
    """

    top: Top
    object: RigidObject
    half_length_mm: float
    half_width_mm: float
    poses: tuple[ObjectPose, ...] = ()
    landmarks: Float | None = None
    by_force: tuple[ObjectPose, ...] = ()
    walls_touch: bool = True

    def __post_init__(self) -> None:
        freeze_arrays(self)


class FirstTouch(NamedTuple):
    """Height (mm) of an object's lowest point at first touch, and its place (x, z) mm."""

    height_mm: float
    place: Float


@dataclass(frozen=True)
class InitialContact:
    """First touch of an object: height (mm) of its lowest point, place, and the box that it will overlap on its path.

    Attributes
    ----------
    contact_box : (x_min, x_max, z_min, z_max) mm over which the rigid object would overlap the finger at rest on its
        way
    place : (x, z) mm of first touch
    """

    first_contact_mm: float
    contact_box: tuple[float, float, float, float]
    place: tuple[float, float]


def _grid(half_length: float, half_width: float, count: tuple[int, int] = _GRID) -> Float:
    """Return points (n, 2) over the finger; those of a section are one row."""
    across = np.linspace(-half_width, half_width, count[1] if half_width else 1)
    x, z = np.meshgrid(np.linspace(-half_length, half_length, count[0]), across, indexing="ij")
    return np.stack([x.ravel(), z.ravel()], axis=1)


def first_touch(way: ContactPath) -> FirstTouch:
    """Return the first touch of an object: the largest difference of the two surfaces; -inf without overlap in plan.

    The maximum is searched on a grid and at landmarks, then on finer grids around the best places.
    """
    top, obj, half_length, half_width = way.top, way.object, way.half_length_mm, way.half_width_mm
    marks, placed = way.landmarks, PlacedObject.of(obj, 0.0)

    def difference(xz: Float) -> Float:
        return np.nan_to_num(top(xz[:, 0], xz[:, 1]) - placed.height(xz[:, 0], xz[:, 1]), nan=-np.inf, posinf=np.inf)

    limit = np.array([half_length, half_width])
    hints = placed.to_scene(obj.landmarks())[:, ::2]
    hints = hints if marks is None else np.vstack([hints, marks])
    if half_width == 0.0:
        hints = hints * [1.0, 0.0]
    points = np.vstack([_grid(half_length, half_width), hints[np.all(np.abs(hints) <= limit, axis=1)]])
    differences = difference(points)
    best = float(differences.max())
    place = points[np.argmax(differences)]
    step = 2.0 * limit / (np.array(_GRID) - 1)
    places = _apart(points, differences, 1.5 * step)
    for _ in range(_ZOOMS):
        window = _grid(1.0, float(half_width > 0.0), (_ZOOM, _ZOOM)) * step
        points = np.clip(places[:, None] + window, -limit, limit)
        differences = difference(points.reshape(-1, 2)).reshape(len(places), -1)
        highest = differences.argmax(axis=1)
        places = points[np.arange(len(places)), highest]
        peaks = differences.max(axis=1)
        if peaks.max() > best:
            best = float(peaks.max())
            place = places[int(peaks.argmax())]
        step = step * 2.0 / (_ZOOM - 1)
    return FirstTouch(best, place)


def _apart(points: Float, value: Float, distance: Float) -> Float:
    """Return the places (k, 2) of the largest values, at least `distance` (2,) apart."""
    order = np.argsort(-value, kind="stable")[:2000]
    kept: list[Float] = []
    for i in order:
        if np.isfinite(value[i]) and all((np.abs(points[i] - k) > distance).any() for k in kept):
            kept.append(points[i])
            if len(kept) == _PLACES:
                break
    return np.array(kept).reshape(-1, 2) if kept else points[order[:1]]


def initial_contact(way: ContactPath, touch: FirstTouch | None = None) -> InitialContact:
    """Return the first touch of a path, which may be known, and the box that the object will overlap on it.

    Raises
    ------
    Finger3dError
        If the object is nowhere above the finger, reaches the base beside it, or runs into a side that may not touch.
    """
    touch = touch or first_touch(way)
    first_contact_mm, place = touch
    if first_contact_mm == math.inf:
        raise Finger3dError(
            "object: as it is turned at the start, it extends downwards without end over the finger, which would start "
            "inside it; change its turn_x_deg, turn_y_deg, turn_z_deg"
        )
    if not math.isfinite(first_contact_mm):
        raise Finger3dError(
            f"object: no part of it is above the finger (|x| <= {way.half_length_mm:g}, |z| <= "
            f"{way.half_width_mm:g} mm), so that it never touches; change x_mm, z_mm"
        )
    _clear_of_base(way, first_contact_mm)
    if not way.object.is_flat:  # a plane has no end that could hang down
        deepest = max(pose.depth_mm for pose in way.poses)
        if first_contact_mm <= deepest:
            raise Finger3dError(
                f"object: at depth {deepest:g} mm its lowest point, beside the finger, is "
                f"{deepest - first_contact_mm:.4g} mm below the finger's base: it touches the base first; press less "
                "deep, or change x_mm, z_mm"
            )
        _stays_on_finger(way, first_contact_mm)
    zone = _box(way, touch)
    if not (way.object.is_flat or way.walls_touch):
        _not_a_wall(way, place)
        _no_side(way, first_contact_mm)
    return InitialContact(first_contact_mm, zone, (float(place[0]), float(place[1])))


def _clear_of_base(way: ContactPath, first_contact_mm: float) -> None:
    """Raise an error if a plane, or another object that is turned on its path, reaches the finger's base."""
    across = [-1.0, 1.0] if way.object.is_flat else np.linspace(-1.0, 1.0, _GRID[1])  # of a plane, corners reach most
    x, z = np.meshgrid(across, across if way.half_width_mm else [0.0], indexing="ij")
    base = np.stack([way.half_length_mm * x.ravel(), 0.0 * x.ravel(), way.half_width_mm * z.ravel()], axis=1)
    before = ObjectPose(0.0)
    for pose in way.poses:
        count = max(1, math.ceil(float(np.abs(np.subtract(pose.turns, before.turns)).max()) / _TURN))
        for fraction in np.arange(1, count + 1) / count:
            between = Move(before, pose).at(float(fraction))
            if not (way.object.is_flat or between.is_turned):
                continue
            if (PlacedObject.of(way.object, first_contact_mm, between).distance(base)[0] < 0.0).any():
                x, y, z = np.degrees(between.turns)
                turned = f"turned by {x:.4g}, {y:.4g}, {z:.4g} deg about x, y, z " if between.is_turned else ""
                raise Finger3dError(
                    f"press: {turned}at a depth of {between.depth_mm:.4g} mm, the object reaches the finger's base, "
                    f"which is held; {'turn' if turned else 'incline'} it less, or press less deep"
                )
        before = pose


def _stays_on_finger(way: ContactPath, first_contact_mm: float) -> None:
    """Raise an error if a turn takes the object off the finger."""
    points = _grid(way.half_length_mm, way.half_width_mm, _COARSE)
    for pose in way.poses:
        turned = pose.is_turned and pose.depth_mm > 0.0 and pose not in way.by_force
        if turned and not (_overlap(way.top, way.object, points, first_contact_mm, pose) > 0.0).any():
            x, y, z = np.degrees(pose.turns)
            raise Finger3dError(
                f"press: turned by {x:.4g}, {y:.4g}, {z:.4g} deg about x, y, z at a depth of {pose.depth_mm:.4g} mm, "
                "the object is nowhere inside the finger at rest and does not touch it; turn it less, or press deeper"
            )


def _box(way: ContactPath, touch: FirstTouch) -> tuple[float, float, float, float]:
    """Return the box over which the object overlaps the finger at rest on its path."""
    place, limit = touch.place, np.array([way.half_length_mm, way.half_width_mm])
    window = _grid(1.0, float(way.half_width_mm > 0.0), (_ZOOM, _ZOOM)) * 2.0 * limit / (np.array(_COARSE) - 1)
    grids = [_grid(way.half_length_mm, way.half_width_mm, _COARSE)]
    for k in range(_ZOOMS):  # a tip may lie between the points of the grid
        near = window * 10.0**-k
        slides = {(pose.slide_x_mm, pose.slide_z_mm) for pose in way.poses}
        grids += [np.clip(place + [sx, sz] + near, -limit, limit) for sx, sz in slides]
    points = np.vstack(grids)
    inside = np.zeros(len(points), dtype=bool)
    deepest: dict[tuple[float, ...], ObjectPose] = {}
    for pose in way.poses:  # deeper at the same place covers what was touched before
        key = (pose.slide_x_mm, pose.slide_z_mm, *pose.turns)
        if key not in deepest or pose.depth_mm > deepest[key].depth_mm:
            deepest[key] = pose
    for pose in deepest.values():
        inside |= _overlap(way.top, way.object, points, touch.height_mm, pose) > 0.0
    (x0, z0), (x1, z1) = (f(points[inside], axis=0) if inside.any() else place for f in (np.min, np.max))
    if x1 - x0 <= _NOTHING * way.half_length_mm or z1 - z0 < _NOTHING * way.half_width_mm:
        raise Finger3dError(
            f"object: it touches the finger only at x = {place[0]:.4g}, z = {place[1]:.4g} mm, over no area: an edge "
            "or a wall touches first; change x_mm, z_mm, or press deeper"
        )
    return float(x0), float(x1), float(z0), float(z1)


def _overlap(top: Top, obj: RigidObject, at: Float, touch: float, pose: ObjectPose) -> Float:
    """Return the overlap (n,), mm, of the object with the finger at rest; -inf outside either of them."""
    return PlacedObject.of(obj, touch, pose).overlap(at[:, 0], top(*at.T), at[:, 1])


def _not_a_wall(way: ContactPath, place: Float) -> None:
    """Raise an error if the object first touches the rim of the finger with a flank that extends below it."""
    reach = 1e-3 * way.half_length_mm
    for axis, limit in ((0, way.half_length_mm), (1, way.half_width_mm)):
        if limit == 0.0 or abs(place[axis]) < limit * (1.0 - 1e-9):
            continue
        step = np.zeros(2)
        step[axis] = math.copysign(reach, place[axis])
        points = np.stack([place, place + step, place - step], axis=1)
        here, beside, before = PlacedObject.of(way.object, 0.0).height(*points)
        if here - beside > _STEEP * reach or before - here > _STEEP * reach:
            raise Finger3dError(
                f"object: it touches the finger's rim at x = {place[0]:.4g}, z = {place[1]:.4g} mm with a flank that "
                "hangs down beside it: a wall touches first; change x_mm, z_mm"
            )


def _no_side(way: ContactPath, first_contact_mm: float) -> None:
    """Raise an error if a wall of the object runs into the side of the finger as it slides or turns."""
    t = np.linspace(-1.0, 1.0, _GRID[1])
    sides = np.vstack([np.stack([t, s + 0.0 * t], axis=1) for s in (-1.0, 1.0)])
    rim = np.vstack([sides, sides[:, ::-1]] if way.half_width_mm else [[[-1.0, 0.0], [1.0, 0.0]]])
    rim = rim * [way.half_length_mm, way.half_width_mm]
    reach = math.hypot(way.half_length_mm, way.half_width_mm)
    before = ObjectPose(0.0)
    for pose in way.poses:
        change = pose.coordinates - before.coordinates
        stride = math.hypot(change[1], change[2]) + reach * float(np.abs(change[4:7]).sum())
        count = max(1, math.ceil(_STRIDES * stride / way.half_length_mm))
        over = None
        for fraction in np.linspace(0.0, 1.0, count + 1) if stride else ():
            between = Move(before, pose).at(float(fraction))
            now = np.maximum(_overlap(way.top, way.object, rim, first_contact_mm, between), 0.0)
            if over is not None and (jump := now - over - _STEEP * stride / count).max() > 0.02 * first_contact_mm:
                x, z = rim[np.argmax(jump)]
                raise Finger3dError(
                    f"object: near slide ({between.slide_x_mm:.4g}, {between.slide_z_mm:.4g}) mm a wall of it runs "
                    f"into the finger's side at x = {x:.4g}, z = {z:.4g} mm; move it less, or change x_mm, z_mm"
                )
            over = now
        before = pose
