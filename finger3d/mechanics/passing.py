"""Whether an increment could take the object through the finger's surface, or the finger through a thin object.

The nearest surface of an object is the one that a point came from only while the point has not passed the middle of the
object.  Beyond it a solution with the point on the far side satisfies all contact conditions.  Increments in which this
may happen, or did, are not converged, so that they are halved.
"""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.problem import Problem
from finger3d.objects import Move

_MOST_CHORD = 0.5
"""Largest motion of the object in an increment, over its mean chord in the direction of the motion."""

_MOST_TURN = np.pi / 6.0
"""Largest turn (rad) of an object in an increment."""

_LEAVES = 0.5
"""Least cosine between the normal and the path of a point that leaves the object."""

_OPPOSED = -0.1
"""Largest cosine between the normals of two opposite faces; a point may slide around an edge between other faces."""

_TRACED = 40
"""Largest number of steps along the path of a point; a point that needs more grazes the surface."""

_TOUCHES = 1e-6
"""Distance at which a point touches the object, over the length of its path."""


def moves_too_far(problem: Problem, move: Move, gap: Float, carried: Float) -> bool:
    """Return whether the object moves too far for its near side to be the nearest.

    Parameters
    ----------
    gap : (c,) mm, of the contact points at the start
    carried : (c, d) mm
        Motion of the object's material at the contact points, see `carried_by_object`.
    """
    thing = problem.model.object
    if thing.is_flat:
        return False
    if float(np.abs(np.subtract(move.end.turns, move.start.turns)).max()) > _MOST_TURN:
        return True
    length = np.linalg.norm(carried, axis=1)
    length[gap >= length] = 0.0  # out of reach
    farthest = int(length.argmax())
    if not length[farthest]:
        return False
    motion = _in_space(carried[farthest][None]) @ problem.placed(move.start).turned
    return bool(length[farthest] > _MOST_CHORD * thing.mean_chord(motion[0] / length[farthest]) * (1.0 + 1e-9))


def passes_through(problem: Problem, move: Move, before: Float, after: Float, gap: Float) -> bool:
    """Return whether a contact point enters the object and leaves it at an opposite face, or ends there.

    A point leaves the object roughly along the surface's normal.  One that slides over a round object moves along the
    chord of an arc, nearly perpendicular to the normal, and does not count.

    Parameters
    ----------
    before, after : (c, d) mm, displacements of the contact points at the start and at the end
    gap : (c,) mm, of the contact points at the start
    """
    thing = problem.model.object
    if thing.is_flat:
        return False
    points = problem.surface.points
    start = problem.placed(move.start).to_own(_in_space(points + before))
    path = problem.placed(move.end).to_own(_in_space(points + after)) - start
    length = np.linalg.norm(path, axis=1)
    near = np.flatnonzero((np.maximum(gap, 0.0) < length) & (length > 0.0))
    value, normal = thing.distance(start[near])
    enters = np.einsum("ni,ni->n", normal, path[near]) < 0.0
    near, value, entered = near[enters], value[enters], normal[enters]
    outside, normal = thing.distance(start[near] + path[near])
    leaves = np.einsum("ni,ni->n", normal, path[near]) > _LEAVES * length[near]
    leaves &= np.einsum("ni,ni->n", normal, entered) < _OPPOSED
    near, value, outside = near[leaves], value[leaves], outside[leaves]
    if not len(near):
        return False
    touches = _TOUCHES * length[near]
    if ((value <= touches) | (outside <= touches)).any():
        return True
    start, length, touches = start[near], length[near], touches
    along, distance = path[near] / length[:, None], np.zeros(len(near))
    for _ in range(_TRACED):  # no surface is nearer than the distance, so that no step passes one
        distance += value
        moving = distance < length
        if not moving.any():
            return False
        start, length, touches, along, distance = (v[moving] for v in (start, length, touches, along, distance))
        value = thing.distance(start + distance[:, None] * along)[0]
        if (value <= touches).any():
            return True
    return True


def pulls(problem: Problem, before: ContactState, after: ContactState, move: Move) -> bool:
    """Return whether a convex object that only moves deeper begins to pull the finger, which it cannot."""
    thing = problem.model.object
    moved = move.end.displacement - move.start.displacement
    if (
        thing.is_flat
        or problem.system.second is not None
        or not thing.is_convex
        or move.start.turns != move.end.turns
        or moved[0]
        or moved[2]
        or moved[1] >= 0.0
    ):
        return False
    normal = [float(problem.world_force(state)[:, 1].sum()) for state in (before, after)]
    return normal[0] <= 0.0 < normal[1] - _TOUCHES * float(np.abs(after.force).max(initial=0.0))


def _in_space(vectors: Float) -> Float:
    """Return vectors (n, d) as (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
