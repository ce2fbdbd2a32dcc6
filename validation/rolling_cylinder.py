"""Does a cylinder that rolls without creep transmit no tangential force, and one that turns or slides mu P?

A rigid cylinder of radius R is pressed into a flat block and moves on with its axis at constant height.  It turns by t
about its axis, which travels by X = -(1 + k) R t: rolling with a creep k.  At k = 0 the material of the cylinder at the
contact is at rest.  Carter 1926 (Johnson 1985, Sec. 8.3) gives the tangential force Q of steady rolling:
1 - Q/mu P = (1 - k R/(mu a))^2, and Q = mu P from k = mu a/R on.  It holds on a half-space that is incompressible
(beta = 0), where pressure and friction do not act on each other.  The block approximates it up to the order a/h, with h
its height.  For nu below 1/2 the surface is compressed in the contact, and rolling without creep drags it backwards
(Johnson 1985, Sec. 8.2): that Q vanishes is no law.

Exact on any body: forces without friction point at the axis and have no torque about it; with friction the torque is R
times the sum of tangential forces; turning without travel and sliding without a turn have Q = mu P in opposite
directions, and dissipate mu P times the way.  REFERENCES.md, 3.4.

A round cylinder has no marks: every increment is described from its present lowest point, to which depth, slide and
turn of an `ObjectPose` refer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import State
from finger3d.mechanics.march.equilibrium import frictional_dissipation
from finger3d.mechanics.model import Leg
from finger3d.objects import Cylinder, Move, ObjectPose

from ._press import block_model, changed, converged
from ._rows import Result, Row, exact_columns, grouped, listed

judged = listed(__file__)

R, DEPTH, WAY, MU, E = 10.0, 0.05, 6.0, 1.0, 1.0
BEGIN = -0.5 * WAY
CREEPS = (0.0, 0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Travel:
    """Sums over the contact after every increment, N and mm.

    Attributes
    ----------
    normal, tangential : of forces along the normals and tangents of the points
    along : force along x, to which the normal forces contribute where the pressure is not symmetric
    friction : of the magnitudes of friction
    torque : on the finger about the cylinder's axis, of forces at the displaced points
    """

    way: Float
    normal: Float
    tangential: Float
    along: Float
    friction: Float
    torque: Float
    dissipation: Float

    @property
    def ratio(self) -> Float:
        """Q/P, with the normal forces and tangential forces of the points."""
        return self.tangential / self.normal

    @property
    def steady(self) -> float:
        """Mean of Q/P over the last tenth of the way, within which a point enters the contact and another leaves it."""
        return float(self.ratio[-max(1, len(self.way) // 10) :].mean())


def block(nu: float, size: float, height: float, domain: Any = "plane-strain") -> Problem:
    """A block with the contact fine along the way."""
    width, base = (2.0, 1.5) if domain == "solid" else (1.0, 2.0)
    legs = (Leg(DEPTH, steps=10), Leg(DEPTH, slide_x_mm=WAY))
    more = {"object": Cylinder(BEGIN, radius_mm=R), "friction": Coulomb(MU), "domain": domain}
    return build(block_model((2.0 * height, height, width), Isotropic(E, nu), (size, base), legs, **more))


def pressed(problem: Problem) -> State[Any]:
    """The state after the press."""
    return converged(changed(problem, legs=problem.model.legs[:1]))[-1].meshed_state


def travel(problem: Problem, state: State[Any], way: float, turn: float, steps: int) -> Travel:
    """Move the axis by a way along x while the cylinder turns about it."""
    formulation, model = formulation_of(problem.model), problem.model
    angle = turn / steps
    start = ObjectPose(DEPTH)
    end = ObjectPose(DEPTH - R * (1.0 - math.cos(angle)), way / steps + R * math.sin(angle), turn_z=angle)
    out, lost = [], 0.0
    for k in range(steps):
        here = replace(problem, model=replace(model, object=Cylinder(BEGIN + way * k / steps, radius_mm=R)))
        found = formulation.increment(here, state, Move(start, end), None, formulation.workspace())
        assert found.outcome.ok, found.outcome
        lost += frictional_dissipation(here, state.contact, found.state.contact)
        state = found.state
        out.append((way * (k + 1) / steps, *sums(problem, state, BEGIN + way * (k + 1) / steps), lost))
    return Travel(*np.array(out).T)


def sums(problem: Problem, state: State[Any], axis: float) -> tuple[float, ...]:
    """Normal and tangential force, that along x, sum of friction and torque about the axis at x = `axis`."""
    height = problem.system.first_contact_mm - DEPTH + R
    arm = (problem.surface.centroids + state.body)[:, :2] - [axis, height]
    contact, force, total = state.contact, state.contact.scene_force, problem.symmetry.total
    torque = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    friction = np.linalg.norm(contact.force[:, 1:], axis=1)
    return total(contact.force[:, 0]), total(contact.force[:, 1]), total(force[:, 0]), total(friction), total(torque)


def carter(creep: float) -> float:
    """Q/mu P of steady rolling with a creep, over mu a/R."""
    return 1.0 - max(0.0, 1.0 - creep) ** 2


def run(quick: bool) -> Result:
    """Carter's curve, rolling for a smaller Poisson's ratio, and the exact relations in a section and in a solid."""
    height = 20.0
    size, thick, count = (0.1, 0.25, 8) if quick else (0.05, 0.15, 24)
    creeps = CREEPS[:3:2] if quick else CREEPS
    steps = round(WAY / size)
    problem = block(0.5, size, height)
    start = pressed(problem)
    force = sums(problem, start, BEGIN)[0]
    a = math.sqrt(4.0 * force * R * (1.0 - 0.5**2) / (math.pi * E))
    found = {c: travel(problem, start, WAY, -WAY / R / (1.0 + c * MU * a / R), steps) for c in creeps}
    rows = []
    for creep, one in found.items():
        words = {"creep": creep, "edges": a / size, "share": a / height}
        rows.append(judged("carter", one.steady / MU, carter(creep), 2.0 * a / height, **words))
    other = block(0.3, size, height)
    backwards = travel(other, pressed(other), WAY, -WAY / R, steps)
    rows += [
        judged("q-mu-p-without-creep-nu", backwards.steady / MU),
        judged("dissipation-of-rolling-without-creep-over", found[0.0].dissipation[-1] / (MU * force * WAY)),
        judged("the-same-nu-0-3", backwards.dissipation[-1] / float(MU * backwards.normal[-1] * WAY)),
    ]
    rows += _by_legs(other)
    rows += _exact(other, "plane strain", size, count)
    rows += _exact(block(0.3, thick, 3.0, "solid"), "solid", thick, count)
    table = [
        (creep, *(float(v) for v in line))
        for creep, one in found.items()
        for line in zip(one.way, one.way / a, one.ratio / MU, one.dissipation / (MU * force), strict=True)
    ]
    columns = "creep_R_over_mu_a way_mm way_over_a Q_over_mu_P dissipation_over_mu_P_mm"
    data = exact_columns(columns, table)
    bent, ends = (backwards.way / a, backwards.ratio / MU), [one.steady / MU for one in found.values()]
    return Result(tuple(rows), data, lambda figure: _draw(figure, data, bent, ends))


def _by_legs(problem: Problem) -> list[Row]:
    """Roll by a leg of the path, as far as its depth stays above zero, and by increments of this study."""
    way, steps = 0.4, 8
    angles = [-way * k / steps / R for k in range(1, steps + 1)]
    path = [Leg(DEPTH - R * (1.0 - math.cos(t)), R * (math.sin(t) - t), turn_z=t, steps=1) for t in angles]
    frame = converged(changed(problem, legs=(*problem.model.legs[:1], *path)))[-1]
    one = travel(problem, pressed(problem), way, -way / R, steps)
    legs = sums(problem, frame.meshed_state, BEGIN + way)
    away = max(abs(legs[0] - one.normal[-1]), abs(legs[1] - one.tangential[-1]), abs(legs[-1] - one.torque[-1]) / R)
    return [judged("difference-of-forces-over-p-between", away / legs[0])]


def _exact(problem: Problem, name: str, size: float, steps: int) -> list[Row]:
    """Torque and force of turning, sliding and rolling."""
    mu, way = 0.3, 0.6
    rough = changed(problem, friction=Coulomb(mu))
    smooth = changed(problem, friction=Coulomb(0.0))
    start = pressed(rough)
    turned, slid = travel(rough, start, 0.0, -way / R, steps), travel(rough, start, way, 0.0, steps)
    rolled = travel(rough, start, way, -way / R, steps)
    free = travel(smooth, pressed(smooth), way, -way / R, steps)
    flat = 0.5 * size**2 / R**2
    half = steps // 2  # the beginning is no steady state
    work = 0.5 * (slid.along[half + 1 :] + slid.along[half:-1]).sum() * way / steps
    spent = float(slid.dissipation[-1] - slid.dissipation[half]) / float(work)
    apart = float(np.abs((rolled.torque / R - rolled.tangential) / rolled.normal).max())
    solid = problem.dim == 3
    aside, across = (1e-4, "points also slip along z, by Poisson's effect") if solid else (1e-8, "the residual")
    rows = [
        judged("torque-over-r-p-without-friction", float(np.abs(free.torque / R / free.normal).max()), tolerance=flat),
        judged("turned-without-travel", turned.ratio[-1] / mu, tolerance=aside, why=across),
        judged("torque-mu-p-r-turned-without", float(turned.torque[-1] / (R * turned.normal[-1] * mu)), tolerance=flat),
        judged("slid-without-a-turn", slid.ratio[-1] / mu, tolerance=aside, why=across),
        judged("sum-of-friction-over-mu-p", float((slid.friction / slid.normal)[-1] / mu)),
        judged("largest-difference-of-torque-r-and", apart, tolerance=flat),
        judged("dissipation-of-sliding-over-the-work", spent, tolerance=way / steps),
        judged("dissipation-rolled-over-slid", float(rolled.dissipation[-1] / slid.dissipation[-1])),
    ]
    return [replace(row, what=f"{row.what}, {name}") for row in rows]


def _draw(figure: Any, data: dict[str, list[float]], bent: tuple[Float, Float], ends: list[float]) -> None:
    left, right = figure.subplots(1, 2)
    for creep, t in grouped(data, "creep_R_over_mu_a"):
        left.plot(t["way_over_a"], t["Q_over_mu_P"], lw=1.2, label=f"k R/(mu a) = {creep:g}")
    left.plot(*bent, "k--", lw=1.0, label="0, nu = 0.3")
    left.set(xlabel="way / a", ylabel="Q / (mu P)", ylim=(None, 1.05))
    left.legend(ncols=2, loc="upper left", bbox_to_anchor=(0.0, -0.14))
    fine = np.linspace(0.0, 1.2, 61)
    right.plot(fine, [carter(float(c)) for c in fine], "k-", lw=0.8, label="Carter")
    right.plot(sorted(set(data["creep_R_over_mu_a"])), ends, "o", label="found, last tenth of the way")
    right.set(xlabel="k R / (mu a)", ylabel="Q / (mu P), steady", ylim=(-0.05, 1.1))
    right.legend(loc="lower right")
