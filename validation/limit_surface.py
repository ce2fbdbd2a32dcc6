"""Which tangential force and which torque about the press axis can a pressed finger transmit at the same time?

The finger of Maeno 2004, Fig. 9, as a solid under a plane, is pressed by 2 mm; the plane is then slid and turned about
the press axis at once, until every point slips in a steady state.  Each point then transmits mu times its normal force
against its velocity, which is that of a rotation about a centre at a distance c from the middle of the contact.  The
pairs of force F and torque M over all c are the limit surface (Goyal, Ruina and Papadopoulos 1991): F = mu P in a pure
slide, and M = M_max, mu P times the mean of the distance r from the axis weighted with the pressure, in a pure twist.
Robotics approximates it by the ellipse (F/mu P)^2 + (M/M_max)^2 = 1 (Howe and Cutkosky 1996).  Formulas: REFERENCES.md,
3.3.

A section has neither forces nor arms along z, so that its moment about the press axis is zero: the limit surface has no
2D counterpart.  The torque of a solid grows with its width.  Widths below 10 mm are left out: such a finger bends along
z by several millimetres before it slips, too far for small strain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import dblquad

from finger3d.contact.friction import STICK, Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Leg, Model
from finger3d.objects import Plane

from ._press import changed, converged, fig9_finger, fig9_model
from ._rows import Result, Row, exact_columns, grouped, listed

judged = listed(__file__)

RADIUS, E, NU, MU = 100.0, 1.0, 0.45, 0.25
DEPTH, WAY = 2.0, 30.0  # mm; WAY is about the mean way of the plane over the contact
ACROSS = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.2, 2.5, math.inf)  # distances of the centre over the width


@dataclass(frozen=True)
class Sliding:
    """Full sliding about a centre at a distance c from the middle, in N and mm; torques about the centre of pressure.

    Attributes
    ----------
    force, torque : (F_x, F_z) and M found
    rigid_force, rigid_torque : the same from the normal forces and the velocities of the plane
    largest : mu times the sum of normal forces times their distances from the centre of pressure
    power : what the plane spends with the forces found, over what rigid sliding dissipates
    step : turn of the last increment, rad
    """

    centre: float
    normal: float
    force: tuple[float, float]
    torque: float
    rigid_force: tuple[float, float]
    rigid_torque: float
    largest: float
    power: float
    stuck: int
    step: float

    @property
    def pair(self) -> tuple[float, float]:
        """F/mu P and M/M_max."""
        return math.hypot(*self.force) / (MU * self.normal), self.torque / self.largest


def model(width: float, size: float) -> Model:
    """The finger of Fig. 9 with another width."""
    legs = (Leg(DEPTH, steps=4), Leg(DEPTH, slide_x_mm=5.0, slide_z_mm=5.0, turn_y=1.0))
    return fig9_model(NU, size, 10.0, design=fig9_finger(width), legs=legs, friction=Coulomb(MU))


def centres(problem: Problem, width: float, across: tuple[float, ...]) -> list[float]:
    """Distances of the centre, moved to the middle between the nearest contact points: one at the centre may stick."""
    z = np.unique(np.round(problem.surface.points[:, 2], 6))
    out = []
    for share in across:
        k = int(np.searchsorted(z, share * width))
        out.append(share * width if share == 0.0 or k == len(z) else float(z[k - 1 : k + 1].mean()))
    return out


def slid(problem: Problem, centre: float, steps: int) -> Sliding:
    """Press, then turn the plane about the point x = 0, z = -`centre` by a slide and a turn about the press axis."""
    radius = 0.4 * problem.model.design.width_mm
    turn = WAY / math.hypot(centre, radius) if math.isfinite(centre) else 0.0
    path = about(centre, turn, steps) if turn else [Leg(DEPTH, WAY, steps=steps)]
    return _sliding(problem, centre, _last(problem, (Leg(DEPTH, steps=4), *path)), turn / steps)


def about(centre: float, turn: float, steps: int) -> list[Leg]:
    """Legs of a turn (rad) of the plane about the point x = 0, z = -`centre`."""
    angles = [turn * k / steps for k in range(1, steps + 1)]
    return [Leg(DEPTH, centre * math.sin(t), centre * (math.cos(t) - 1.0), turn_y=t, steps=1) for t in angles]


def _last(problem: Problem, legs: tuple[Leg, ...], plane: Plane | None = None) -> StepResult:
    return converged(changed(problem, legs=legs, object=plane or Plane()))[-1]


def _sliding(problem: Problem, centre: float, frame: StepResult, turn: float) -> Sliding:
    """Evaluate an increment in which the plane has turned by an angle about the centre, or has slid along x."""
    state, arms = frame.meshed_state.contact, problem.surface.centroids
    normal = state.force[:, 0]
    # the plane's material at a point has come along a chord
    way = np.tile([1.0, 0.0], (len(arms), 1))
    if turn:
        c, s = math.cos(turn), math.sin(turn)
        from_centre = arms[:, [0, 2]] + [0.0, centre]
        way = from_centre - from_centre @ np.array([[c, s], [-s, c]])
    length = np.linalg.norm(way, axis=1)
    moves = length > 1e-9 * length.max()  # all but a point in the centre
    pull = MU * np.where(moves, normal / np.where(moves, length, 1.0), 0.0)[:, None] * way
    total = float(normal.sum())
    middle = normal @ arms[:, [0, 2]] / total
    arm = arms[:, [0, 2]] - middle
    found = measure(problem.points, frame)
    force = found["force_x_N"], found["force_z_N"]
    return Sliding(
        centre=centre,
        normal=total,
        force=force,
        torque=found["moment_y_Nmm"] - middle[1] * force[0] + middle[0] * force[1],
        rigid_force=(float(pull[:, 0].sum()), float(pull[:, 1].sum())),
        rigid_torque=float(arm[:, 1] @ pull[:, 0] - arm[:, 0] @ pull[:, 1]),
        largest=float(MU * normal @ np.linalg.norm(arm, axis=1)),
        power=float((state.scene_force[:, [0, 2]] * way).sum() / (MU * normal @ length)),
        stuck=int((state.status == STICK).sum()),
        step=turn,
    )


def hertz_mean_distance(force: float, width: float) -> float:
    """Mean distance (mm) from the middle, weighted with Hertz's pressure of a line contact along the whole width."""
    half = math.sqrt(4.0 * force / width * RADIUS * (1.0 - NU**2) / (math.pi * E))

    def share(z: float, t: float) -> float:  # x = half sin t
        return 2.0 / math.pi * math.cos(t) ** 2 * math.hypot(half * math.sin(t), z)

    return 2.0 * 2.0 / width * float(dblquad(share, 0.0, math.pi / 2.0, 0.0, width / 2.0)[0])


def run(quick: bool) -> Result:
    """The limit surface at two widths, and the largest torque at others."""
    size, steps = (4.0, 40) if quick else (3.0, 100)
    across = ACROSS[::3] if quick else ACROSS
    rows, table = [], []
    for width in (20.0, 40.0):
        problem = build(model(width, size))
        found = [slid(problem, c, steps) for c in centres(problem, width, across)]
        rows += _rows(found, width, size)
        for one in found:
            rigid = math.hypot(*one.rigid_force) / (MU * one.normal), one.rigid_torque / one.largest
            table.append((width, one.centre, one.normal, one.largest / MU / one.normal, *one.pair, *rigid, one.stuck))
        if width == 20.0:
            rows += _beside(problem, found[1].centre)
    for width in () if quick else (10.0, 30.0):
        one = slid(build(model(width, size)), 0.0, steps)
        table.append((width, 0.0, one.normal, one.largest / MU / one.normal, *one.pair, *one.pair, one.stuck))
    ratio = [next(r[3] for r in table if r[0] == width) for width in (20.0, 40.0)]
    rows.append(judged("m-max-mu-p-at-40", ratio[1] / ratio[0]))
    legs = (Leg(DEPTH, steps=4), Leg(DEPTH, slide_x_mm=WAY, steps=steps))
    section = build(replace(model(20.0, size), legs=legs, domain="plane-strain"))
    last = measure(section.points, _last(section, legs))
    rows += [
        judged("torque-about-the-press-axis-plane", last["moment_y_Nmm"]),
        judged("f-mu-p-plane-strain-slid", last["force_x_N"] / MU / last["normal_force_N"]),
    ]
    columns = "width_mm centre_mm normal_force_N mean_distance_mm F M rigid_F rigid_M stuck_points"
    data = exact_columns(columns, table)
    return Result(tuple(rows), data, lambda figure: _draw(figure, data))


def _rows(found: list[Sliding], width: float, size: float) -> list[Row]:
    at = f"width {width:g} mm, edges of {size:g} mm"
    force = max(math.dist(s.force, s.rigid_force) / (MU * s.normal) for s in found)
    torque = max(abs(s.torque - s.rigid_torque) / s.largest for s in found)
    twist, slide = found[0], found[-1]
    deviation = [math.hypot(*s.pair) - 1.0 for s in found]
    hertz = hertz_mean_distance(twist.normal, width)
    return [
        judged("f-mu-p-of-a-pure", slide.pair[0], at=at),
        judged("m-m-max-of-a-pure", twist.pair[1], math.cos(twist.step / 2.0), at=at),
        judged("largest-error-of-f-over-mu", force, count=len(found), at=at),
        judged("largest-error-of-m-over-m", torque, count=len(found), at=at),
        judged("largest-power-over-that-of-rigid", max(s.power for s in found), at=at),
        judged("least-power-over-that-of-rigid", min(s.power for s in found), at=at),
        judged("points-that-stick-of-all-centres", float(sum(s.stuck for s in found)), count=len(found), at=at),
        judged("m-max-mu-p-mm", twist.largest / MU / twist.normal, hertz, at=at),
        judged("deviation-from-the-ellipse-where-it", max(deviation, key=abs), at=at),
    ]


def _beside(problem: Problem, centre: float) -> list[Row]:
    """Turn a plane whose axis of turning is the centre, and a plane that slides and turns about the press axis."""
    steps, turn = 10, 0.5
    press = Leg(DEPTH, steps=4)
    one = measure(problem.points, _last(problem, (press, *about(centre, turn, steps))))
    other = measure(problem.points, _last(problem, (press, Leg(DEPTH, turn_y=turn, steps=steps)), Plane(z_mm=-centre)))
    names = ("force_x_N", "force_y_N", "force_z_N", "moment_x_Nmm", "moment_y_Nmm", "moment_z_Nmm")
    away = max(abs(one[name] - other[name]) / max(abs(one[name]), one["normal_force_N"]) for name in names)
    return [judged("largest-difference-of-forces-and-moments", away)]


def _draw(figure: Any, data: dict[str, list[float]]) -> None:
    left, right = figure.subplots(1, 2)
    angle = np.linspace(0.0, math.pi / 2.0, 91)
    left.plot(np.cos(angle), np.sin(angle), "k--", lw=0.8, label="ellipse")
    for (width, t), colour in zip(grouped(data, "width_mm"), ("C0", "C1"), strict=False):
        left.plot(t["rigid_F"], t["rigid_M"], colour, lw=1.0, label=f"{width:g} mm wide, rigid sliding")
        left.plot(t["F"], t["M"], colour + "o", mfc="none", label=f"{width:g} mm wide, found")
    left.set(xlabel="F / (mu P)", ylabel="M / M_max", xlim=(0.0, 1.05), ylim=(0.0, 1.05), aspect="equal")
    ((_, t),) = grouped(data, "centre_mm", centre_mm=0.0)
    order = np.argsort(t["width_mm"])
    width, distance, force = (t[name][order] for name in ("width_mm", "mean_distance_mm", "normal_force_N"))
    right.plot(width, list(map(hertz_mean_distance, force, width)), "k-", lw=0.8, label="Hertz's line contact")
    right.plot(width, distance, "C2o", label="found")
    right.set(xlabel="width (mm)", ylabel="M_max / (mu P) (mm)", xlim=(0.0, None), ylim=(0.0, None))
