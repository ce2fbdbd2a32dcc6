"""Does an object that touches beside the apex, or with several flanks at once, push along the normals where it touches?

Source: Johnson 1985, Sec. 4.2, and statics.  A bar and a ball beside the apex of a dome; V-grooves and the corner of a
cube.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import trimesh

from finger3d._types import Float
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Cylinder, MeshObject, RigidObject, Sphere

from ._press import block_model, converged
from ._rows import Result, exact_columns, grouped, listed, together
from .triangulated_objects import box, of_trimesh

judged = listed(__file__)

DOME_BALL, BAR, ANGLE = 20.0, 5.0, math.radians(30.0)
BESIDE = (DOME_BALL + BAR) * math.sin(ANGLE)
E, NU, WIDTH_BALL = 1.0, 0.3, 4.0
DEPTHS = (0.05, 0.1, 0.2)


def pressed(obj: RigidObject, depth: float, size: float, domain: Any) -> tuple[Problem, dict[str, Any], float]:
    """The problem, the numbers at the end of a press, and half the contact width in the inclined direction (mm)."""
    dome = designs()["half_cylinder"](radius_mm=DOME_BALL, width_mm=WIDTH_BALL)
    mesh = MeshOptions(size, 3.0, "swept")
    problem = build(Model(dome, Isotropic(E, NU), mesh, (Leg(depth, steps=4),), object=obj, domain=domain))
    frame = converged(problem)[-1]
    found = measure(problem.points, frame)
    return problem, found, found["contact_half_length_mm"] / math.cos(ANGLE)


def _ball(quick: bool) -> Result:
    """Does a frictionless object beside the apex of a dome push along the common normal, as hard as Hertz says?

    A bar of radius 5 mm is pressed into a half cylinder of radius 20 mm, 12.5 mm beside its axis: the line between
    the centres is inclined by 30 degrees, and so is the force. In small strain its direction follows from the
    normals of the bar alone. The contact is a Hertzian line contact in the inclined direction, P = pi E' a^2 / (4
    R) per width with 1/R = 1/5 + 1/20 and E' = E / (1 - nu^2), whatever the depth (Johnson 1985, Sec. 4.2). Every
    force of a frictionless bar points at its axis, so that the moment about the axis is zero; forces act on the
    finger at rest, whose points lie off by their displacement. A ball in place of the bar pushes in the same
    direction.

    A bar at three depths on three meshes; a ball once.
    """
    sizes = (0.1, 0.05) if quick else (0.1, 0.05, 0.025)
    effective, radius = E / (1.0 - NU**2), 1.0 / (1.0 / DOME_BALL + 1.0 / BAR)
    table, rows = [], []
    for size in sizes:
        for depth in DEPTHS:
            problem, found, half = pressed(Cylinder(BESIDE, radius_mm=BAR), depth, size, "plane-strain")
            force = np.array([found["force_x_N"], found["force_y_N"]])
            total = float(np.linalg.norm(force))
            hertz = 2.0 * math.sqrt(total / WIDTH_BALL * radius / (math.pi * effective))
            centre = np.array([BESIDE, problem.system.first_contact_mm - depth + BAR])
            arm = (found["moment_z_Nmm"] - centre[0] * force[1] + centre[1] * force[0]) / total
            lean = math.degrees(math.atan2(-force[0], -force[1]))
            table.append((size, depth, total, lean, half, hertz, arm))
    for depth in DEPTHS:
        _, _, total, lean, half, hertz, arm = next(r for r in table if r[:2] == (sizes[-1], depth))
        at = f"depth {depth:g} mm, edges of {sizes[-1]:g} mm"
        shift = 0.2 * math.degrees(depth / BAR)  # the contact moves along the bar by a share of the depth
        rows += [
            judged("inclination", lean, tolerance=shift, at=at),
            judged("half-width-of-contact-over-hertz", half / hertz, tolerance=sizes[-1] / half + 0.02, at=at),
            judged("distance", arm, tolerance=depth, at=at),
        ]
    _, found, _ = pressed(Sphere(BESIDE, radius_mm=BAR), 0.2, 0.5 if quick else 0.25, "solid")
    ratio = -found["force_x_N"] / -found["force_y_N"]
    rows.append(judged("sideways-over-vertical-force-of-a", ratio, math.tan(ANGLE)))
    columns = "size_mm depth_mm force_N inclination_deg half_width_mm hertz_mm off_axis_mm"
    data = exact_columns(columns, table)
    return Result(tuple(rows), data, lambda figure: _draw_ball(figure, data))


def _draw_ball(figure: Any, data: dict[str, list[float]]) -> None:
    axes = figure.subplots()
    for size, t in grouped(data, "size_mm"):
        axes.plot(t["depth_mm"], t["half_width_mm"], "o", label=f"edges of {size:g} mm")
    axes.plot(t["depth_mm"], t["hertz_mm"], "k-", lw=0.8, label="Hertz")
    axes.set(xlabel="depth (mm)", ylabel="half width of contact (mm)", ylim=(0.0, None))


DOME_FLANKS, WIDTH_FLANKS, DEPTH = 10.0, 2.0, 0.1
EQUAL, UNEQUAL = (45.0, 45.0), (35.0, 60.0)
CORNER_DEPTH = 2.0
FACE = 1e-6
"""Difference of a unit normal from that of a flank up to which a point belongs to the flank."""


def groove(left: float, right: float, reach: float = 12.0, half_width: float = 20.0) -> Triangles:
    """A block with a V-groove along z below, its flanks inclined by so many degrees to the vertical."""
    a, b = (reach * np.array([s * math.tan(math.radians(v)), -1.0]) for s, v in ((-1.0, left), (1.0, right)))
    outline = np.array([[0.0, 0.0], a, [a[0] - 2.0, a[1]], [a[0] - 2.0, 4.0], [b[0] + 2.0, 4.0], [b[0] + 2.0, b[1]], b])
    fan = [[0, k, k + 1] for k in range(1, len(outline) - 1)]
    return of_trimesh(trimesh.creation.extrude_triangulation(outline, fan, 2.0 * half_width), (0.0, 0.0, -half_width))


def normals_of(angles: tuple[float, float]) -> Float:
    """Unit normals (2, 2) of the left and the right flank, into the finger."""
    left, right = np.radians(angles)
    return np.array([[math.cos(left), -math.sin(left)], [-math.cos(right), -math.sin(right)]])


def on_flanks(angles: tuple[float, float], size: float) -> dict[str, list[float]]:
    """Force (N), half width (mm) and distance of the force from the dome's axis (mm) of each flank; total force."""
    dome = designs()["half_cylinder"](radius_mm=DOME_FLANKS, width_mm=WIDTH_FLANKS)
    surface = groove(*angles)
    half, lean = math.radians(sum(angles)) / 2.0, math.radians(angles[1] - angles[0]) / 2.0
    apex = -DOME_FLANKS / math.sin(half) * math.sin(lean)  # both flanks touch at once: the axis lies on the bisector
    obj = MeshObject(apex + float(MeshObject(surface=surface).origin[0]), surface=surface)
    mesh = MeshOptions(size, 3.0, "swept")
    problem = build(
        Model(dome, Isotropic(E, NU), mesh, (Leg(DEPTH, steps=2),), object=obj, domain="plane-strain", symmetry=())
    )
    last = converged(problem)[-1]
    force, at = problem.world_force(last.meshed_state.contact)[:, :2], problem.points.points[:, :2]
    found: dict[str, list[float]] = {"force_N": [], "half_width_mm": [], "off_axis_mm": []}
    for normal in normals_of(angles):
        own = (last.state.force[:, 0] > 0.0) & (np.abs(last.state.bases[:, 0] - normal).max(axis=1) < FACE)
        total = force[own].sum(axis=0)
        moment = float((at[own, 0] * force[own, 1] - at[own, 1] * force[own, 0]).sum())
        arm = moment / float(np.linalg.norm(total))
        along = at[own] @ [-normal[1], normal[0]]
        found["force_N"].append(float(total @ normal))
        found["half_width_mm"].append(0.5 * float(np.ptp(along)))
        found["off_axis_mm"].append(arm)
    found["total_N"] = force.sum(axis=0).tolist()
    return found


def cube_corner(size: float) -> Float:
    """Components (3,) N of the force on a cube's corner along the normals of its faces: what each face carries."""
    turned = MeshObject(surface=box(5.0, 5.0, 5.0), turn_x=math.pi / 4.0, turn_z=math.atan(1.0 / math.sqrt(2.0)))
    legs = (Leg(CORNER_DEPTH, steps=3),)
    problem = build(block_model((4.0, 4.0, 8.0), Isotropic(E, NU), (size, 1.5), legs, object=turned))
    last = converged(problem)[-1]
    axes = problem.placed(last.target).turned.T
    down = -axes * np.sign(axes[:, 1])[:, None]  # the normals of the three faces that look down
    return np.asarray(down @ problem.world_force(last.meshed_state.contact).sum(axis=0))


def _flanks(quick: bool) -> Result:
    """Does an object that touches with several flanks at once push along the normal of each?

    A V-groove with flanks of 35 and 60 degrees to the vertical is pressed on the dome of a half cylinder, without
    friction. Each flank is a plane on a cylinder: the half width of its contact is that of Hertz's line contact
    under the flank's own force, P = pi E' a^2 / (4 R) per width (Johnson 1985, Sec. 4.2), and its resultant passes
    through the axis of the dome, but for what the contact moves. In a groove with equal flanks each carries F / (2
    sin angle) by statics. A cube whose corner points down is pressed into a block: its three faces touch, with
    normals at right angles to each other, and forces that are equal but for the shape of the block.

    Two grooves on three meshes, a cube's corner on one.
    """
    sizes = (0.2, 0.1) if quick else (0.2, 0.1, 0.05)
    effective = E / (1.0 - NU**2)
    lines, rows = [], []
    for size in sizes:
        found = on_flanks(UNEQUAL, size)
        for angle, force, half in zip(UNEQUAL, found["force_N"], found["half_width_mm"], strict=True):
            hertz = math.sqrt(4.0 * force / WIDTH_FLANKS * DOME_FLANKS / (math.pi * effective))
            lines.append((size, angle, force, half, hertz))
    for (_, angle, _, half, hertz), arm in zip(lines[-2:], found["off_axis_mm"], strict=True):
        at = f"flank of {angle:g} deg, edges of {sizes[-1]:g} mm"
        rows += [
            judged("half-width-of-flank", half / hertz, tolerance=sizes[-1] / hertz + 0.02, at=at),
            judged("distance-from-dome-axis", arm, tolerance=DEPTH, at=at),
        ]
    total = np.array(found["total_N"])
    parts = np.array(found["force_N"]) @ normals_of(UNEQUAL)
    rows.append(judged("total-force", float(np.linalg.norm(total - parts) / np.linalg.norm(total))))
    equal = on_flanks(EQUAL, sizes[-1])
    each = -equal["total_N"][1] / (2.0 * math.sin(math.radians(EQUAL[0])))
    for side, force in zip(("left", "right"), equal["force_N"], strict=True):
        rows.append(judged("force-of-equal-flank", force / each, side=side))
    corner_sizes = (1.0, 0.7) if quick else (0.7, 0.45, 0.3)
    corners = [cube_corner(size) for size in corner_sizes]
    forces = corners[-1]
    at = f"edges of {corner_sizes[-1]:g} mm"
    rows += [
        judged("force-of-third-face", float(forces[2] / forces[1]), at=at),
        judged("force-of-first-face", float(forces[0] / forces[1]), at=at),
    ]
    if not quick:
        change = [float(np.linalg.norm(b - a)) for a, b in zip(corners, corners[1:], strict=False)]
        rows.append(judged("change", change[-1] / change[-2]))
    table, faces = exact_columns("size_mm flank_deg force_N half_width_mm hertz_mm", lines), np.array(corners)
    return Result(tuple(rows), table, lambda figure: _draw_flanks(figure, table, corner_sizes, faces))


def _draw_flanks(figure: Any, table: dict[str, list[Any]], sizes: tuple[float, ...], faces: Float) -> None:
    left, right = figure.subplots(1, 2)
    for k, (angle, t) in enumerate(grouped(table, "flank_deg")):
        left.plot(t["size_mm"], t["half_width_mm"], "o-", color=f"C{k}", label=f"{angle:g} deg")
        left.plot(t["size_mm"], t["hertz_mm"], "--", color=f"C{k}", label=f"{angle:g} deg, Hertz")
    left.set(xlabel="edge length (mm)", ylabel="half width of contact (mm)", ylim=(0.0, None), xlim=(0.0, None))
    for k in range(3):
        right.plot(sizes, faces[:, k], "osv"[k] + "-", mfc="none", label=f"face {k + 1}")
    right.set(xlabel="edge length (mm)", ylabel="normal force on a face of the cube's corner (N)")
    right.set(xlim=(0.0, None), ylim=(0.0, 1.1 * faces.max()))


def run(quick: bool) -> Result:
    """A bar and a ball beside the apex, then grooves and a corner."""
    return together((10.0, 9.0), ball=_ball(quick), flanks=_flanks(quick))
