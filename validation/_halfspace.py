"""A ball on a block so deep that it is a half-space, on a quarter of a graded box; lengths in a = 1 mm, E = 1 MPa."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import OPEN, STICK
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.objects import Sphere

from ._common import Body, body, box, graded, held_at, marched

RADIUS = 100.0  # a/R = 0.01
_ZONE = 1.15  # half-width of the evenly spaced part, in a
_GROWTH = 2.0  # of the cells beyond it; quadratic cells, and the field decays as 1 / distance


def graded_block(points: int, height: float) -> Mesh:
    """Quarter of a block 2 height x height x 2 height, its top at y = 0, with `points` to a."""
    far = _ZONE + graded(height - _ZONE, _GROWTH / points, _GROWTH)
    side = np.concatenate([np.linspace(0.0, _ZONE, round(_ZONE * points) + 1), far[1:]])
    return quadratic(box([side, -graded(height, 1.0 / points, _GROWTH)[::-1], side]))


def block(nu: float, points: int, height: float, mirrored: bool = True) -> Body:
    """Points at x >= 0, z >= 0 of a block 2 height x height x 2 height held at its base, `points` to a.

    `mirrored`: fields are even about x = 0 as in a press; else odd, as under a shear along x.
    """
    mesh = graded_block(points, height)
    held = held_at(mesh, {"x-": (0,) if mirrored else (1, 2), "y-": (0, 1, 2), "z-": (2,)})
    return body(mesh, Elasticity.of(1.0, nu), held, "y+", lambda p: np.hypot(p[:, 0], p[:, 2]) < 1.2)


@dataclass(frozen=True)
class Ball:
    """A pressed ball: contact points (c, 3), their area (c,), gap (c,) at first touch, compliance, and how many of such
    parts make the whole."""

    points: Float
    area: Float
    gap: Float
    compliance: Float
    parts: int


@dataclass(frozen=True)
class Step:
    """One increment: depth and slide (mm), forces P, Q, T (N), dissipation (mJ), and areas (mm2)."""

    depth: float
    slide: float
    P: float
    Q: float
    T: float
    D: float
    area: float
    stick_area: float
    iterations: int


def quarter(nu: float, points: int, height: float) -> Ball:
    """The part x >= 0, z >= 0, for presses."""
    half_space = block(nu, points, height)
    surface = half_space.surface
    return Ball(surface.points, surface.area, _gap(half_space), half_space.compliance, 4)


def half(nu: float, points: int, height: float) -> Ball:
    """The part z >= 0, for shear along x: the compliance from that under even and odd loads about x = 0."""
    even, odd = block(nu, points, height), block(nu, points, height, mirrored=False)
    surface, gap = even.surface, _gap(even)
    c = len(gap)
    plane = surface.points[:, 0] == 0.0
    number = np.concatenate([np.arange(c), np.flatnonzero(~plane)])
    sign = np.where(np.arange(len(number)) < c, 1.0, -1.0)
    turn = np.ones((len(number), 3))
    turn[:, 1] = sign
    free_even, free_odd = np.ones((c, 3)), np.ones((c, 3))
    free_even[plane, 1] = 0.0  # a point on the plane moves along x under odd loads only, else under even ones only
    free_odd[plane, 0] = free_odd[plane, 2] = 0.0
    together = _part(even.compliance, free_even)[number][:, :, number]
    against = _part(odd.compliance, free_odd)[number][:, :, number]
    whole = 0.5 * (together + against * (sign[:, None] * sign)[:, None, :, None])
    whole *= turn[:, :, None, None] * turn
    on_axis = surface.points[:, 2] == 0.0
    locked = np.flatnonzero(on_axis[number]) * 3 + 2
    flat = whole.reshape(3 * len(number), -1)
    flat[locked, locked] = np.diagonal(flat).max()
    at = surface.points[number].copy()
    at[:, 0] *= sign
    area = np.where(plane, 2.0 * surface.area, surface.area)[number]
    return Ball(at, area, gap[number], whole, 2)


def _part(compliance: Float, free: Float) -> Float:
    return compliance * free[:, :, None, None] * free


def _gap(half_space: Body) -> Float:
    ball = Sphere(radius_mm=RADIUS)
    return half_space.gap(lambda p: ball.profile(p[:, 0], p[:, 2]))


def press(ball: Ball, mu: float, path: Sequence[tuple[float, float]]) -> list[Step]:
    """March through (depth, slide along x) mm, the start at first touch not among them."""
    steps = []
    for (depth, slide), (found, lost) in zip(path, marched(ball.gap, ball.compliance, mu, path, 1e-3), strict=True):
        state, friction = found.state, found.state.force[:, 1:]
        # points on a plane of symmetry carry the part's share of their force
        normal, along, _ = (ball.parts * state.force.sum(axis=0)).tolist()
        rubbed = ball.parts * float(np.linalg.norm(friction, axis=1).sum())
        on, stuck = (ball.parts * float(ball.area[k].sum()) for k in (state.status != OPEN, state.status == STICK))
        steps.append(Step(depth, slide, normal, along, rubbed, ball.parts * lost, on, stuck, found.iterations))
    return steps
