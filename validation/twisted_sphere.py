"""Does a rigid ball that is twisted on an elastic body carry the torque of partial and of full slip?

A ball of radius 100 mm is pressed into a block so that it touches over a circle of radius a = 1 mm, and turned about
the vertical by t.  With friction that holds, the torque is that of a bonded disc, M = 16/3 G a^3 t (Johnson 1985,
Sec. 7.6).  With friction a ring c < r < a slips at once (Lubkin 1951): with Hertz's pressure of the maximum p0,

    t = mu p0/(2 G) [K(k') - E(k')],   k'^2 = 1 - c^2/a^2,   M = (16/3) G int_c^a s^3 dt(s)

a sum of bonded discs of the radii c to a that carries mu p in the ring (Jaeger 1995; REFERENCES.md, 3.5).  When every
point slips, M = 3 pi/16 mu P a.  As in the theory, friction acts from the beginning of the turn on, except in the rows
"friction while pressed", where it is radial before it turns: full slip is the same.

Contact points lie up to an edge length inside of the circle, and shear is singular there: torques converge from below.
Torsion has no 2D counterpart.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from finger3d.contact.friction import STICK, Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.objects import Move, ObjectPose, Sphere

from ._press import block_model, changed, converged
from ._rows import Result, exact_columns, grouped, listed

judged = listed(__file__)

RADIUS, E, NU = 100.0, 1.0, 0.3
SHEAR, EFFECTIVE = E / (2.0 * (1.0 + NU)), E / (1.0 - NU**2)
DEPTH = 1.0 / RADIUS  # a = 1 mm on a half-space
MU = 0.1
TURNED = math.radians(4.0)
STUCK = (0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)  # c/a


def block(size: float) -> Problem:
    """A block of 12 a by 6 a by 12 a under the ball."""
    legs = (Leg(DEPTH, steps=1), Leg(DEPTH, steps=1, turn_y=TURNED))
    ball = Sphere(radius_mm=RADIUS)
    return build(block_model((6.0, 6.0, 12.0), Isotropic(E, NU), (size, 2.0), legs, object=ball))


def twisted(problem: Problem, mu: float, angle: float, steps: int) -> list[tuple[float, float, float, float]]:
    """Angle, torque (N mm), force (N) and stuck share of the contact after every increment of the turn."""
    legs = (Leg(DEPTH, steps=3), Leg(DEPTH, steps=steps, turn_y=angle))
    out = []
    for frame in converged(changed(problem, friction=Coulomb(mu), legs=legs)):
        found = measure(problem.points, frame)
        stuck = found["stick_area_mm2"] / found["contact_area_mm2"]
        out.append((frame.target.turn_y, found["moment_y_Nmm"], found["normal_force_N"], stuck))
    return out[3:]


def radius_of(force: float) -> float:
    """Hertz's radius of contact (mm)."""
    return float((3.0 * force * RADIUS / (4.0 * EFFECTIVE)) ** (1.0 / 3.0))


def discs(share: float) -> float:
    """K - E of the modulus sqrt(1 - c^2/a^2), for c/a = `share`: what discs from c to a add to the turn."""
    return float(ellipkm1(share**2) - ellipe(1.0 - share**2))


def turn_of(share: float) -> float:
    """Turn over mu p0/G at which the circle of radius c = `share` times a sticks."""
    return 0.5 * discs(share)


def torque_of(share: float) -> float:
    """Torque over that of full slip where the circle of radius c = `share` times a sticks; by parts."""
    inner = share**3 * discs(share) if share > 0.0 else 0.0
    total = inner + 3.0 * float(quad(lambda s: s**2 * discs(s), share, 1.0, epsabs=1e-12)[0])
    return 4.0 / math.pi * total / (3.0 * math.pi / 16.0)


def partial(problem: Problem, shares: tuple[float, ...]) -> list[tuple[float, float, float, float, float]]:
    """Press without friction and turn with it, to the radii of stick `shares` of the theory, one after another.

    Returns c/a, turn over mu p0/G, torque over that of full slip, stuck radius over that of the contact, both found,
    and the turn, rad.
    """
    smooth = replace(problem.model, friction=Coulomb(0.0), legs=(Leg(DEPTH, steps=3),))
    *_, frame = march(replace(problem, model=smooth))
    state, start = frame.meshed_state, ObjectPose(DEPTH)
    force = float(state.contact.force[:, 0].sum())
    a = radius_of(force)
    unit = MU * 1.5 * force / (math.pi * a**2) / SHEAR
    rough, formulation = (changed(problem, friction=Coulomb(MU)), formulation_of(problem.model))
    place, area, out = problem.surface.centroids, problem.surface.area, []
    for share in shares:
        end = ObjectPose(DEPTH, turn_y=unit * turn_of(share))
        found = formulation.increment(rough, state, Move(start, end), None, formulation.workspace())
        assert found.outcome.ok, found.outcome
        state, start = found.state, end
        pull = state.contact.scene_force
        torque = float((place[:, 2] * pull[:, 0] - place[:, 0] * pull[:, 2]).sum())
        stuck = area[state.contact.status == STICK].sum() / area[state.contact.force[:, 0] > 0.0].sum()
        full = 3.0 * math.pi / 16.0 * MU * force * a
        out.append((share, turn_of(share), torque / full, math.sqrt(float(stuck)), end.turn_y))
    return out


def run(quick: bool) -> Result:
    """Full stick, partial slip and full slip on meshes of 2, 3 and 4 edges to a."""
    edges = (3,) if quick else (2, 3, 4)
    rows, table, held = [], [], []
    for count in edges:
        problem = block(1.0 / count)
        _, torque, force, share = twisted(problem, 1e3, 1e-3, 1)[0]
        held.append(torque / (16.0 / 3.0 * SHEAR * radius_of(force) ** 3 * 1e-3))
        slips = twisted(problem, MU, TURNED, 12)
        full = 3.0 * math.pi / 16.0 * MU * slips[-1][2] * radius_of(slips[-1][2])
        steps = partial(problem, (*STUCK, 0.001))
        once = partial(problem, STUCK[5:6])[0][2]
        table += [(count, c, t, m, torque_of(c), stuck, math.degrees(angle)) for c, t, m, stuck, angle in steps]
    at = f"{edges[-1]} edges to a"
    stick = torque_of(0.999) * 3.0 * math.pi / 16.0 * 2.0 * math.pi / 3.0 / (16.0 / 3.0 * turn_of(0.999))
    rows = [
        judged("torque-that-sticks-over-16-3", held[-1], tolerance=1.2 / edges[-1], at=at),
        judged("stuck-share", share, at=at),
        judged("torque-of-full-slip-over-3", slips[-1][1] / full, tolerance=0.25 / edges[-1], at=at),
        judged("stuck-share-in-full-slip-friction", slips[-1][3], tolerance=1.0 / edges[-1] ** 2, at=at),
        judged("closed-form-of-full-slip", torque_of(0.0)),
        judged("closed-form-of-full-stick", stick),
        judged("torque-at-c-0-5-a", once / steps[5][2], at=at),
    ]
    for c, _, torque, stuck, angle in steps[1:8:2]:
        what, share = f"at {math.degrees(angle):.3f} deg, c = {c:g} a, {at}", torque / steps[-1][2]
        rows += [
            judged("torque-over-that-of-full-slip", torque, torque_of(c), tolerance=0.25 / edges[-1], what=what),
            judged("the-same-over-the-torque-found", share, torque_of(c), tolerance=0.15 / edges[-1], what=what),
            judged("stuck-radius-over-that", stuck, c, tolerance=1.0 / edges[-1], what=what),
        ]
    if not quick:
        limit = held[-1] + (held[-1] - held[-3]) * edges[-3] / (edges[-1] - edges[-3])
        rows.append(judged("torque-that-sticks-extrapolated-to-points", limit))
    columns = "edges_per_a c_over_a turn_G_over_mu_p0 torque_over_full theory stuck_radius turn_deg"
    data = exact_columns(columns, table)
    return Result(tuple(rows), data, lambda figure: _draw(figure, data))


def _draw(figure: Any, data: dict[str, list[float]]) -> None:
    left, right = figure.subplots(1, 2)
    shares = [1.0 - 0.005 * k for k in range(1, 199)] + [0.005, 0.002, 0.001]
    turns = [0.0, *(turn_of(c) for c in shares)]
    left.plot(turns, [0.0, *(torque_of(c) for c in shares)], "k-", lw=0.8, label="Lubkin 1951")
    right.plot(turns, [1.0, *shares], "k-", lw=0.8, label="Lubkin 1951")
    for count, t in grouped(data, "edges_per_a"):
        for axes, name in ((left, "torque_over_full"), (right, "stuck_radius")):
            axes.plot(t["turn_G_over_mu_p0"], t[name], "o", mfc="none", ms=5, label=f"{count:g} edges to a")
    left.set(ylabel="torque over that of full slip", ylim=(0.0, 1.05))
    right.set(ylabel="stuck radius over that of the contact", ylim=(0.0, 1.05))
    for axes in (left, right):
        axes.set(xlabel="turn G / (mu p0)", xlim=(0.0, 2.0))
