"""A cylinder on a block so deep that it is a half-plane: the problem, and contact edges finer than the point spacing.

Lengths are in units of the contact half-width a = 1 mm that the last increment aims at; E = 1 MPa.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, STICK, FrictionLaw
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Leg, Model
from finger3d.objects import Cylinder, RigidObject

from . import _press
from ._press import changed

RADIUS = 1e3  # a/R = 1e-3: the theory neglects the slope of the surface, which turns pressure into friction
DEPTH_OF_BLOCK = 200.0  # a/h = 0.005: the base's strain is 1 % of the contact's own at worst, see press_with_friction
CANDIDATES = -0.2  # share of the depth; keeps the points within 2.2 a, which `a` needs beyond the edge


def compliance(nu: float) -> float:
    """A = 2 (1 - nu^2) / E, 1/MPa."""
    return 2.0 * (1.0 - nu**2)


def depth(a: Float, height: float, radius: float = RADIUS) -> Float:
    """Depth (mm) for about the half-width a: a^2/2R ln(2h/a), validation/REFERENCES.md, 1.7."""
    return a**2 / (2.0 * radius) * np.log(2.0 * height / a)


def loading(steps: int, height: float = DEPTH_OF_BLOCK, radius: float = RADIUS) -> tuple[Leg, ...]:
    """Legs of one increment each with equal steps of a^2, that is of the force, up to a = 1 mm."""
    return tuple(Leg(float(depth(np.sqrt(k / steps), height, radius)), steps=1) for k in range(1, steps + 1))


def on_block(
    rigid: RigidObject, material: Isotropic, points: float, legs: tuple[Leg, ...], height: float, base: float = 0.25,
    **fields: Any,
) -> Model:  # fmt: skip
    """An object on a block 1 mm wide and twice as long as high, in plane strain unless `fields` say otherwise.

    Parameters
    ----------
    points : contact points to a millimetre
    base : longest edge, over the height
    """
    edges, more = (1.0 / points, base * height), {"domain": "plane-strain", "object": rigid, **fields}
    return _press.block_model((height, height, 1.0), material, edges, legs, **more)


def line(nu: float, points: float, legs: tuple[Leg, ...], height: float = DEPTH_OF_BLOCK) -> Problem:
    """Plane strain, `points` to the half-width; symmetric where the legs are."""
    model = on_block(Cylinder(radius_mm=RADIUS), Isotropic(1.0, nu), points, legs, height, 0.125)
    return build(model, margin=CANDIDATES)


def under(problem: Problem, friction: FrictionLaw | float, legs: tuple[Leg, ...] | None = None) -> list[Profile]:
    """March the problem under another friction, and other legs if given; the condensation is shared."""
    steps = _press.under(changed(problem, legs=legs or problem.model.legs), friction)
    return [Profile.of(problem, step) for step in steps]


@dataclass(frozen=True)
class Profile:
    """One frame along x: tractions (MPa), with friction positive towards +x on the finger.

    Attributes
    ----------
    x, area, p, q, gap, status : (m,) ascending in x
    frame : what they come from
    """

    x: Float
    area: Float
    p: Float
    q: Float
    gap: Float
    status: NDArray[np.int8]
    frame: StepResult

    @classmethod
    def of(cls, problem: Problem, frame: StepResult) -> Profile:
        """From a frame of a 2D problem."""
        x = problem.points.points[:, 0]
        order = np.argsort(x)
        state, area = frame.state, problem.points.area[order]
        force = state.force[order]
        return cls(x[order], area, force[:, 0] / area, force[:, 1] / area, state.gap[order], state.status[order], frame)

    @property
    def force(self) -> float:
        """Normal force P, N."""
        return float(self.p @ self.area)

    @property
    def outward(self) -> float:
        """Integral of q over x > 0, N; positive where friction pulls the surface outward."""
        return float((self.q * self.area)[self.x > 0.0].sum())

    @property
    def touching(self) -> int:
        """Points in contact at x >= 0."""
        return int(((self.status != OPEN) & (self.x >= 0.0)).sum())

    @property
    def a(self) -> float:
        """Half-width: the gap beyond the edge grows as (x - a)^1.5, so gap^(2/3) is extrapolated to 0."""
        open_right = np.flatnonzero((self.status == OPEN) & (self.x > 0.0))[1:9]
        if len(open_right) < 8:
            raise AssertionError("the contact reaches the last candidate points")
        # the first open point is left out: its weighted gap reaches into the contact
        return float(np.polyfit(self.gap[open_right] ** (2.0 / 3.0), self.x[open_right], 2)[-1])

    @property
    def reach(self) -> float:
        """Half-width as half the area of the points in contact: coarser than `a`, but free of what the gap does.

        At full stick gap and pressure oscillate towards the edge, and `a` is biased by it.
        """
        return float(self.area[self.status != OPEN].sum()) / 2.0

    @property
    def c(self) -> float:
        """Half-width of the stick zone: half way between the last point that sticks and the next, which slips."""
        stick = self.x[(self.status == STICK) & (self.x >= 0.0)]
        slip = self.x[(self.status == SLIP) & (self.x > stick.max(initial=0.0))]
        if not len(stick):
            return 0.0
        return float(0.5 * (stick.max() + slip.min())) if len(slip) else self.a


def numbers(profiles: Sequence[Profile], compliance: float, radius: float = RADIUS, by_reach: bool = False) -> Float:
    """P/P_Hertz(a), int_0^a q/P and c/a of a self-similar loading, means over its second half, and its D/(A P^2).

    Parameters
    ----------
    compliance : A of both bodies, 1/MPa
    by_reach : whether a is the half-width by the points in contact
    """
    half = [p for p in profiles[len(profiles) // 2 :] if p.touching >= 6] or profiles[-1:]
    force, last = sum(p.force for p in half), profiles[-1]
    # Johnson 1985, sec. 4.2, on a width of 1 mm
    hertz = sum(np.pi * (p.reach if by_reach else p.a) ** 2 / (2.0 * radius * compliance) for p in half)
    lost = last.frame.dissipation_mJ / (compliance * last.force**2)
    return np.array([force / hertz, sum(p.outward for p in half) / force, np.mean([p.c / p.a for p in half]), lost])
