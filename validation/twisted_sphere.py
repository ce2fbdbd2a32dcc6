"""Does a rigid ball that is twisted on an elastic body carry the torque of partial and of full slip?

A ball of radius 100 mm is pressed into a block so that it touches over a circle of radius a = 1 mm, and turned about
the vertical.  With friction that holds, the torque is that of a bonded disc, M = 16/3 G a^3 theta (Lubkin 1951, small
angles; Johnson 1985, Sec. 7.6).  When every point slips, it is M = 3 pi/16 mu P a, the moment of mu times Hertz's
pressure (Johnson 1985, Sec. 3.9).  Contact points lie up to an edge length inside of the circle, and shear is singular
there: both torques converge from below.  Torsion has no 2D counterpart.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from finger3d.analyses.study_rows import Result, Row
from finger3d.contact.friction import Coulomb
from finger3d.fem.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march
from finger3d.objects import Sphere

RADIUS, E, NU = 100.0, 1.0, 0.3
SHEAR, EFFECTIVE = E / (2.0 * (1.0 + NU)), E / (1.0 - NU**2)
DEPTH = 1.0 / RADIUS  # a = 1 mm on a half-space
MU = 0.1
TURNED = math.radians(4.0)


def block(size: float) -> Problem:
    """A block of 12 a by 6 a by 12 a under the ball."""
    design = designs()["block"](half_length_mm=6.0, height_mm=6.0, width_mm=12.0)
    legs = (Leg(DEPTH, steps=1), Leg(DEPTH, steps=1, turn_y=TURNED))
    mesh = MeshOptions(size, 2.0, "swept")
    return build(Model(design, Isotropic(E, NU), mesh, legs, object=Sphere(radius_mm=RADIUS)))


def twisted(problem: Problem, mu: float, angle: float, steps: int) -> list[tuple[float, float, float, float]]:
    """Angle, torque (N mm), force (N) and stuck share of the contact after every increment of the turn."""
    legs = (Leg(DEPTH, steps=3), Leg(DEPTH, steps=steps, turn_y=angle))
    model = replace(problem.model, friction=Coulomb(mu), legs=legs)
    out = []
    for frame in march(replace(problem, model=model)):
        assert frame.outcome.ok, frame.outcome
        found = measure(problem.points, frame)
        stuck = found["stick_area_mm2"] / found["contact_area_mm2"]
        out.append((frame.target.turn_y, found["moment_y_Nmm"], found["normal_force_N"], stuck))
    return out[3:]


def radius_of(force: float) -> float:
    """Hertz's radius of contact (mm)."""
    return float((3.0 * force * RADIUS / (4.0 * EFFECTIVE)) ** (1.0 / 3.0))


def run(quick: bool) -> Result:
    """Full stick and partial slip on meshes of 3, 4 and 5 edges to a."""
    edges = (3,) if quick else (2, 3, 4)
    rows, table, held = [], [], []
    for count in edges:
        problem = block(1.0 / count)
        (_, torque, force, share), *_ = twisted(problem, 1e3, 1e-3, 1)
        held.append(torque / (16.0 / 3.0 * SHEAR * radius_of(force) ** 3 * 1e-3))
        slips = twisted(problem, MU, TURNED, 12)
        full = 3.0 * math.pi / 16.0 * MU * slips[-1][2] * radius_of(slips[-1][2])
        table += [(count, math.degrees(t), m / full, s, m, f) for t, m, f, s in slips]
    at = f"{edges[-1]} edges to a"
    rows = [
        Row(f"torque that sticks over 16/3 G a^3 theta, {at}", "Lubkin 1951", 1.0, held[-1], 1.2 / edges[-1],
            "the circle is an edge length smaller, its torque 3/n, less at the mean"),
        Row(f"stuck share of the contact, {at}", "it holds", 1.0, share, 1e-12, "every point"),
        Row(f"torque of full slip over 3 pi/16 mu P a, {at}", "Johnson 1985, Sec. 3.9", 1.0, slips[-1][1] / full,
            0.25 / edges[-1], "the pressure vanishes where the points end"),
        Row(f"stuck share in full slip, {at}", "none but the middle", 0.0, slips[-1][3], 1.0 / edges[-1] ** 2,
            "the middle point cannot slip", measure="absolute"),
    ]  # fmt: skip
    if not quick:
        rows.append(
            Row("torque that sticks, extrapolated to points without number", "Lubkin 1951", 1.0,
                held[-1] + (held[-1] - held[-3]) * edges[-3] / (edges[-1] - edges[-3]), 0.1, "of first order in 1/n")
        )  # fmt: skip
    columns = "edges_per_a turn_deg torque_over_full stuck_share moment_Nmm force_N".split()
    data = dict(zip(columns, map(list, zip(*table, strict=True)), strict=True))
    return Result(tuple(rows), data, lambda figure: _draw(figure, data))


def _draw(figure: Any, data: dict[str, list[float]]) -> None:
    left, right = figure.subplots(1, 2)
    for count in sorted(set(data["edges_per_a"])):
        own = [k for k, c in enumerate(data["edges_per_a"]) if c == count]
        turn = [data["turn_deg"][k] for k in own]
        left.plot(turn, [data["torque_over_full"][k] for k in own], "o-", ms=3, label=f"{count:g} edges to a")
        right.plot(turn, [data["stuck_share"][k] for k in own], "o-", ms=3, label=f"{count:g} edges to a")
    left.axhline(1.0, color="k", lw=0.8, label="full slip, 3 pi/16 mu P a")
    left.set(xlabel="turn (deg)", ylabel="torque over that of full slip", ylim=(0.0, 1.15))
    right.set(xlabel="turn (deg)", ylabel="stuck share of the contact", ylim=(0.0, 1.0))
    for axes in (left, right):
        axes.legend(fontsize=8)
