"""A ball on a block so deep that it is a half-space, on a quarter of a graded box; lengths in a = 1 mm, E = 1 MPa."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import OPEN, STICK
from finger3d.objects import Sphere

from ._common import Body, graded, marched, quarter_block

RADIUS = 100.0  # a/R = 0.01
_ZONE = 1.15  # half-width of the evenly spaced part, in a
_GROWTH = 2.0  # of the cells beyond it; quadratic cells, and the field decays as 1 / distance


def block(nu: float, points: int, height: float, plane: tuple[int, ...] = (0,)) -> Body:
    """Points at x >= 0, z >= 0 of a block 2 height x height x 2 height held at its base, `points` to a.

    Parameters
    ----------
    plane : components held at x = 0: 0 as in a press, 1 and 2 under loads that are odd about it, as a shear along x
    """
    far = _ZONE + graded(height - _ZONE, _GROWTH / points, _GROWTH)
    side = np.concatenate([np.linspace(0.0, _ZONE, round(_ZONE * points) + 1), far[1:]])
    return quarter_block(side, graded(height, 1.0 / points, _GROWTH), nu, 1.2, plane)


@dataclass(frozen=True)
class Ball:
    """A pressed ball: area of the contact points (c,), gap (c,) at first touch, compliance, and how many of such parts
    make the whole."""

    area: Float
    gap: Float
    compliance: Float
    parts: int

    @classmethod
    def on(cls, half_space: Body) -> Ball:
        """The part x >= 0, z >= 0, for presses."""
        ball = Sphere(radius_mm=RADIUS)
        gap = half_space.gap(lambda p: ball.profile(p[:, 0], p[:, 2]))
        return cls(half_space.surface.area, gap, half_space.compliance, 4)


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


def half(nu: float, points: int, height: float) -> Ball:
    """The part z >= 0, for shear along x: the compliance from that under even and odd loads about x = 0."""
    even, odd = block(nu, points, height), block(nu, points, height, (1, 2))
    quarter, places = Ball.on(even), even.surface.points
    plane, on_axis = places[:, 0] == 0.0, places[:, 2] == 0.0
    number = np.concatenate([np.arange(len(plane)), np.flatnonzero(~plane)])
    sign = np.where(np.arange(len(number)) < len(plane), 1.0, -1.0)
    free = np.ones((2, len(plane), 3))
    free[0, plane, 1] = 0.0  # a point on the plane moves along x under odd loads only, else under even ones only
    free[1, plane, ::2] = 0.0
    parts = (c.compliance * f[:, :, None, None] * f for c, f in zip((even, odd), free, strict=True))
    together, against = (part[number][:, :, number] for part in parts)
    turn = np.stack([np.ones_like(sign), sign, np.ones_like(sign)], axis=1)
    whole = 0.5 * (together + against * (sign[:, None] * sign)[:, None, :, None]) * turn[:, :, None, None] * turn
    locked = np.flatnonzero(on_axis[number]) * 3 + 2
    flat = whole.reshape(3 * len(number), -1)
    flat[locked, locked] = np.diagonal(flat).max()
    area = np.where(plane, 2.0 * quarter.area, quarter.area)[number]
    return Ball(area, quarter.gap[number], whole, 2)


def press(ball: Ball, mu: float, path: Sequence[tuple[float, float]]) -> list[Step]:
    """March through (depth, slide along x) mm, the start at first touch not among them."""
    steps, parts = [], ball.parts
    for (depth, slide), (found, lost) in zip(path, marched(ball.gap, ball.compliance, mu, path, 1e-3), strict=True):
        state, friction = found.state, found.state.force[:, 1:]
        # points on a plane of symmetry carry the part's share of their force
        normal, along, _ = (parts * state.force.sum(axis=0)).tolist()
        rubbed = parts * float(np.linalg.norm(friction, axis=1).sum())
        on, stuck = (parts * float(ball.area[k].sum()) for k in (state.status != OPEN, state.status == STICK))
        steps.append(Step(depth, slide, normal, along, rubbed, parts * lost, on, stuck, found.iterations))
    return steps
