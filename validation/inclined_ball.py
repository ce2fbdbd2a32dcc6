"""Does a frictionless object beside the apex of a dome push along the common normal, as hard as Hertz says?

A bar of radius 5 mm is pressed into a half cylinder of radius 20 mm, 12.5 mm beside its axis: the line between the
centres is inclined by 30 degrees, and so is the force.  In small strain its direction follows from the normals of the
bar alone.  The contact is a Hertzian line contact in the inclined direction, P = pi E' a^2 / (4 R) per width with
1/R = 1/5 + 1/20 and E' = E / (1 - nu^2), whatever the depth (Johnson 1985, Sec. 4.2).  Every force of a frictionless
bar points at its axis, so that the moment about the axis is zero; forces act on the finger at rest, whose points lie
off by their displacement.  A ball in place of the bar pushes in the same direction.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, RigidObject, Sphere

from ._press import converged
from ._rows import Result, Row, exact_columns, zero

DOME, BAR, ANGLE = 20.0, 5.0, math.radians(30.0)
BESIDE = (DOME + BAR) * math.sin(ANGLE)
E, NU, WIDTH = 1.0, 0.3, 4.0
DEPTHS = (0.05, 0.1, 0.2)
HERTZ = "Johnson 1985, Sec. 4.2"


def pressed(obj: RigidObject, depth: float, size: float, domain: Any) -> tuple[Problem, dict[str, Any], float]:
    """The problem, the numbers at the end of a press, and half the contact width in the inclined direction (mm)."""
    dome = designs()["half_cylinder"](radius_mm=DOME, width_mm=WIDTH)
    mesh = MeshOptions(size, 3.0, "swept")
    problem = build(Model(dome, Isotropic(E, NU), mesh, (Leg(depth, steps=4),), object=obj, domain=domain))
    frame = converged(problem)[-1]
    found = measure(problem.points, frame)
    return problem, found, found["contact_half_length_mm"] / math.cos(ANGLE)


def run(quick: bool) -> Result:
    """A bar at three depths on three meshes; a ball once."""
    sizes = (0.1, 0.05) if quick else (0.1, 0.05, 0.025)
    effective, radius = E / (1.0 - NU**2), 1.0 / (1.0 / DOME + 1.0 / BAR)
    table, rows = [], []
    for size in sizes:
        for depth in DEPTHS:
            problem, found, half = pressed(Cylinder(BESIDE, radius_mm=BAR), depth, size, "plane-strain")
            force = np.array([found["force_x_N"], found["force_y_N"]])
            total = float(np.linalg.norm(force))
            hertz = 2.0 * math.sqrt(total / WIDTH * radius / (math.pi * effective))
            centre = np.array([BESIDE, problem.system.first_contact_mm - depth + BAR])
            arm = (found["moment_z_Nmm"] - centre[0] * force[1] + centre[1] * force[0]) / total
            lean = math.degrees(math.atan2(-force[0], -force[1]))
            table.append((size, depth, total, lean, half, hertz, arm))
    for depth in DEPTHS:
        _, _, total, lean, half, hertz, arm = next(r for r in table if r[:2] == (sizes[-1], depth))
        at = f"depth {depth:g} mm, edges of {sizes[-1]:g} mm"
        shift = 0.2 * math.degrees(depth / BAR)  # the contact moves along the bar by a share of the depth
        rows += [
            Row(f"inclination of the force, {at}, deg", "the line between the centres", 30.0, lean, shift,
                "the contact moves by a part of the depth", measure="absolute"),
            Row(f"half width of contact over Hertz's, {at}", HERTZ, 1.0, half / hertz, sizes[-1] / half + 0.02,
                "an edge length, and 2 % for the curvature over the contact"),
            zero(f"distance of the force from the bar's axis, {at}, mm", "statics", arm, depth,
                "forces act on the finger at rest, off by less than the depth"),
        ]  # fmt: skip
    _, found, _ = pressed(Sphere(BESIDE, radius_mm=BAR), 0.2, 0.5 if quick else 0.25, "solid")
    ratio = -found["force_x_N"] / -found["force_y_N"]
    rows.append(Row("sideways over vertical force of a ball, solid", "tan 30 deg", math.tan(ANGLE), ratio, 0.1,
                    "the depth over the radius, 0.2/5, both ways"))  # fmt: skip
    columns = "size_mm depth_mm force_N inclination_deg half_width_mm hertz_mm off_axis_mm"
    data = exact_columns(columns, table)
    return Result(tuple(rows), data, lambda figure: _draw(figure, data))


def _draw(figure: Any, data: dict[str, list[float]]) -> None:
    left, right = figure.subplots(1, 2)
    for size in sorted(set(data["size_mm"]), reverse=True):
        own = [k for k, s in enumerate(data["size_mm"]) if s == size]
        depth = [data["depth_mm"][k] for k in own]
        left.plot(depth, [data["inclination_deg"][k] for k in own], "o-", label=f"edges of {size:g} mm")
        right.plot(depth, [data["half_width_mm"][k] for k in own], "o", label=f"edges of {size:g} mm")
    finest = [k for k, s in enumerate(data["size_mm"]) if s == min(data["size_mm"])]
    left.axhline(30.0, color="k", lw=0.8, label="line between the centres")
    left.set(xlabel="depth (mm)", ylabel="inclination of the force (deg)", ylim=(27.0, 33.0))
    depth, hertz = ([data[name][k] for k in finest] for name in ("depth_mm", "hertz_mm"))
    right.plot(depth, hertz, "k-", lw=0.8, label="Hertz")
    right.set(xlabel="depth (mm)", ylabel="half width of contact (mm)", ylim=(0.0, None))
