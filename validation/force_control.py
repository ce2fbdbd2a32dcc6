"""Is a press by force the press by the depths that it reports, on the way up and down, and does a held force creep?

The finger of Maeno 2004, Fig. 9, in plane strain under a plane, and a block under a ball, both with friction, are
pressed by equal increments of the force.  The depths found, prescribed as increments of a second press, give the same
contact: forces and depth are found at once in the same increment.  Only the parts in which contact begins differ: they
are shares of a depth that is known to a thousandth.

The force is then taken back.  With friction the depth at the same force differs from that on the way up (Spence 1975,
Turner 1979); without, it is the same, since the elastic contact is unique.

The finger, viscoelastic, is then held by a force.  While contact grows, the elastic force at the depth d(t) is the
convolution of the force with the creep function (Lee and Radok 1960): J(t) = 2 - exp(-t/2) for the relaxation function
1/2 + exp(-t)/2 and constant nu.  It ends at the depth of the elastic press with the relaxed modulus, E_inf = E/2; where
only the shear modulus relaxes, with E_inf and nu_inf of K and G/2.  REFERENCES.md, 4.3 and 7.3.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float, Tree
from finger3d.contact.friction import Coulomb
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.readings import Gauge
from finger3d.objects import Sphere

from ._press import block_model, changed, fig9_finger, measured
from ._rows import Result, Row, listed

judged = listed(__file__)

E, PRONY = 1.0, ((0.5, 1.0),)
RAMP, HELD = 1.0, 40.0  # s


def finger(size: float, material: Isotropic, mu: float) -> Model:
    """The section of Fig. 9; the depth of the leg meshes the contact."""
    gauges = (Gauge("g36", 36.0, 40.0, 0.0, math.radians(30.0)),)
    mesh = MeshOptions(size, 8.0, "swept")
    return Model(fig9_finger(), material, mesh, (Leg(6.0),), friction=Coulomb(mu), gauges=gauges, domain="plane-strain")


def block(size: float, material: Isotropic, mu: float) -> Model:
    """A block under a ball."""
    more = {"object": Sphere(radius_mm=4.0), "friction": Coulomb(mu)}
    return block_model((4.0, 3.0, 8.0), material, (size, 1.2), (Leg(0.4),), **more)


def history(problem: Problem, legs: tuple[Leg, ...]) -> list[Tree]:
    """What is measured after every increment."""
    return measured(changed(problem, legs=legs))


def by_depths(problem: Problem, steps: list[Tree]) -> list[Tree]:
    """Press again by the depths of a history."""
    return history(problem, tuple(Leg(step["depth_mm"], steps=1) for step in steps))


def difference(one: Tree, other: Tree, height: float) -> float:
    """Largest relative difference of all quantities of a step, over force, height and work where these are larger.

    The area of sticking is left out: a point at the limit of friction that does not slip may be of either status.
    """
    force, work = one["normal_force_N"], one["external_work_mJ"]
    floors = {"_N": force, "_Nmm": force * height, "_mJ": work, "_mm": 1e-3 * height}
    out = [abs(other["gauges"][name] - value) / abs(value) for name, value in one["gauges"].items()]
    for name, value in one.items():
        if isinstance(value, float) and name != "residual" and not name.startswith("stick"):
            floor = floors.get("_" + name.split("_")[-1], 0.0)
            out.append(abs(other[name] - value) / (max(abs(value), floor) or 1.0))
    return float(max(out))


def column(steps: list[Tree], name: str) -> Float:
    """One quantity after every increment."""
    return np.array([step[name] for step in steps], dtype=float)


def run(quick: bool) -> Result:
    """Two bodies under a cycle of force, and a viscous one under a held force."""
    count = 4 if quick else 10
    rows, cycles = [], {}
    for name, model, depth in (
        ("finger, plane strain", finger(2.0 if quick else 1.0, Isotropic(E, 0.45), 0.25), 5.0),
        ("ball on a block", block(0.4 if quick else 0.25, Isotropic(E, 0.3), 0.05), 0.3),
    ):
        problem = build(model)
        force = history(problem, (Leg(depth, steps=4),))[-1]["normal_force_N"]
        cycles[name] = _cycle(problem, depth, force, count)
        rows += _cycle_rows(name, problem, cycles[name], count, force)
        smooth = changed(problem, friction=Coulomb(0.0))
        free = _cycle(smooth, depth, force, count)
        rows.append(judged("depth-without-friction", float(_loop(free, count).max()), name=name))
    found, curve = _creep(quick)
    rows += found
    steps = cycles["finger, plane strain"]
    names = {"force_N": "normal_force_N", "depth_mm": "depth_mm", "friction_sum_N": "friction_sum_N"}
    table = {title: column(steps, name).tolist() for title, name in names.items()}
    return Result(tuple(rows), table, lambda figure: _draw(figure, cycles, count, curve))


def _cycle(problem: Problem, depth: float, force: float, count: int) -> list[Tree]:
    """Press by a force in equal increments, and take all of it back but one of them."""
    up, down = Leg(depth, steps=count, force_N=force), Leg(depth, steps=count - 1, force_N=force / count)
    return history(problem, (up, down))


def _loop(steps: list[Tree], count: int) -> Float:
    """Relative difference of the depths at equal forces below the largest."""
    depth = column(steps, "depth_mm")
    up, down = depth[: count - 1], depth[count:][::-1]
    return np.asarray(np.abs(down - up) / up)


def _cycle_rows(name: str, problem: Problem, steps: list[Tree], count: int, force: float) -> list[Row]:
    again, height = by_depths(problem, steps), problem.model.design.height_mm
    wanted = force * np.array([*range(1, count + 1), *range(count - 1, 0, -1)]) / count
    found = column(steps, "normal_force_N")
    top, end = (difference(steps[k], again[k], height) for k in (count - 1, -1))
    return [
        judged("largest-error", float((np.abs(found - wanted) / wanted).max()), name=name),
        judged("largest-difference-of-any-quantity-from", top, name=name),
        judged("the-same-after-the-way-down", end, name=name),
        judged("depth-with-friction", float(_loop(steps, count).max()), name=name),
    ]


def creep(t: float) -> float:
    """Elastic force over the largest force, for a force that grows during `RAMP` and is held."""

    def integral(u: float) -> float:  # of J from 0 to u
        return 2.0 * u - 2.0 * (1.0 - math.exp(-0.5 * u)) if u > 0.0 else 0.0

    return (integral(t) - integral(t - RAMP)) / RAMP


def _creep(quick: bool) -> tuple[list[Row], dict[str, Any]]:
    size, per_second = (4.0, 4) if quick else (1.5, 16)
    rows, curve = [], {}
    nu = 0.45
    shear, bulk = E / (2.0 * (1.0 + nu)), E / (3.0 * (1.0 - 2.0 * nu))
    long = 9.0 * bulk * 0.5 * shear / (3.0 * bulk + 0.5 * shear), (3.0 * bulk - shear) / (6.0 * bulk + shear)
    force = history(build(finger(size, Isotropic(E, nu), 0.0)), (Leg(2.0, steps=4),))[-1]["normal_force_N"]
    ramp = Leg(2.0, steps=per_second, force_N=force, duration_s=RAMP)
    early = Leg(4.0, steps=4 * per_second, force_N=force, duration_s=4.0)
    late = Leg(4.0, steps=2 * per_second, force_N=force, duration_s=HELD - RAMP - 4.0)
    for constant, relaxed in ((True, Isotropic(0.5 * E, nu)), (False, Isotropic(*long))):
        for mu in (0.0,) if quick else (0.0, 0.25):
            elastic = finger(size, Isotropic(E, nu), mu)
            viscous = Viscosity(PRONY, bulk=constant).apply(replace(elastic, legs=(Leg(6.0, duration_s=1.0),)))
            steps = history(build(viscous), (ramp, early, late))
            end = history(build(replace(elastic, material=relaxed)), (Leg(4.0, steps=per_second, force_N=force),))
            what = f"{'constant nu' if constant else 'constant K'}, mu = {mu:g}"
            ratio = steps[-1]["depth_mm"] / end[-1]["depth_mm"]
            row = judged("depth-after-40-s-over-that", ratio, what=what)
            if mu:
                why = "the path differs: friction follows a force that grows, or a contact that grows while it is held"
                row = replace(row, reference="elastic press", tolerance=1e-2, reason=why, kind="statement")
            rows.append(row)
            if constant and not mu:
                rows += _creep_rows(elastic, steps, per_second, force)
                curve = {"time": column(steps, "time_s"), "depth": column(steps, "depth_mm")}
                curve["end"] = end[-1]["depth_mm"]
    return rows, curve


def _creep_rows(model: Model, steps: list[Tree], per_second: int, force: float) -> list[Row]:
    time, depth = column(steps, "time_s"), column(steps, "depth_mm")
    elastic = column(by_depths(build(model), steps), "normal_force_N") / force
    away = np.abs(elastic - [creep(t) for t in time]) / elastic
    early = int(np.argmin(np.abs(time - RAMP - 4.0)))
    held = column(steps, "normal_force_N")[per_second:]
    return [
        judged("elastic-force-at-the-depth-over", float(away[: early + 1].max()), tolerance=0.25 / per_second**2),
        judged("error-of-held-force", float(np.abs(held / force - 1.0).max())),
        judged("least-increase", float(np.diff(depth[per_second - 1 :]).min())),
    ]


def _draw(figure: Any, cycles: dict[str, list[Tree]], count: int, curve: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    for k, (name, steps) in enumerate(cycles.items()):
        force, depth = (column(steps, key) / column(steps, key).max() for key in ("normal_force_N", "depth_mm"))
        left.plot(depth[:count], force[:count], f"C{k}o-", ms=4, label=f"{name}, up")
        left.plot(depth[count - 1 :], force[count - 1 :], f"C{k}x--", ms=5, label="down")
    left.set(xlabel="depth / largest", ylabel="force / largest")
    right.plot(curve["time"], curve["depth"], "o-", ms=2, label="held by force")
    right.axhline(curve["end"], color="k", lw=0.8, label="elastic, relaxed modulus")
    right.set(xlabel="time (s)", ylabel="depth (mm), finger without friction", ylim=(0.0, 1.1 * curve["end"]))
