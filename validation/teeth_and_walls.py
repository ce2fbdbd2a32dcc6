"""Do the teeth of a gear wheel and the walls of a slot push where they touch, undercuts included?

Source: statics, mirror images and Hooke's law.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from finger3d._types import Float
from finger3d.contact.friction import OPEN, Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import FREE_FACES
from finger3d.geometry.design import designs
from finger3d.geometry.files import read_surface
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import contact_table, measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.objects import MeshObject

from ._press import block_model, converged
from ._rows import Result, listed, together
from .triangulated_objects import of_trimesh

judged = listed(__file__)

TEETH, DEPTH = 24, 1.0
PITCH = 360.0 / TEETH


def wheel(degrees: float) -> tuple[MeshObject, Float]:
    """The wheel turned about its axis, which is over the middle, and the axis from its lowest point (2,), mm."""
    surface = read_surface(str(Path(__file__).parents[1] / "geometries" / "gear.stl"), 1.0)
    turned = MeshObject(surface=surface, turn_z=math.radians(degrees))
    axis = 0.5 * (surface.low + surface.high) - turned.origin  # in the wheel's own coordinates
    rotation = turned.initial_rotation
    up = rotation @ (axis - turned.lowest_point(rotation))
    return MeshObject(-float(up[0]), surface=surface, turn_z=math.radians(degrees)), up[:2]


def pressed(degrees: float, size: float) -> dict[str, float]:
    """Force (N), torque about the wheel's axis (N mm) as reported and from the points, at the end of a press."""
    finger = designs()["clipped_cylinder"](radius_mm=20.0, half_length_mm=12.0, edge_height_mm=6.0, width_mm=14.0)
    obj, up = wheel(degrees)
    model = Model(
        finger, Isotropic(0.5, 0.45), MeshOptions(size, 2.0, "swept"), (Leg(DEPTH, steps=4),), object=obj,
        domain="plane-strain", symmetry=(),
    )  # fmt: skip
    problem = build(model)
    last = converged(problem)[-1]
    found, table = measure(problem.points, last), contact_table(problem.points, last)
    lowest = np.array([obj.x_mm, problem.system.first_contact_mm - DEPTH])
    axis = lowest + up
    force = np.array([found["force_x_N"], found["force_y_N"]])
    normal = np.stack([table["normal_x"], table["normal_y"]], axis=1)
    each = (table["pressure_MPa"] * table["area_mm2"])[:, None] * normal
    arms = problem.points.points[:, :2] - axis
    return {
        "force_x_N": force[0],
        "force_y_N": force[1],
        "torque_Nmm": found["moment_z_Nmm"] - (axis[0] * force[1] - axis[1] * force[0]),
        "of_points_Nmm": float((arms[:, 0] * each[:, 1] - arms[:, 1] * each[:, 0]).sum()),
    }


def _gear(quick: bool) -> Result:
    """Do the teeth of a gear wheel push along their flanks, whichever way the wheel is turned?

    The gear wheel of geometries/ has 24 teeth. It comes turned about its axis by several angles, with its axis over
    the middle of a finger, and is pressed without friction. A turn by one pitch, 15 degrees, is the same scene;
    opposite turns are mirror images, so that the sideways force and the torque change their sign. Between those the
    flanks are not symmetric about the middle, and push the finger sideways. Without friction every point pushes
    along a normal of the wheel: the torque about the axis is that of pressures on flanks and tips, as their places
    and normals give it.

    Angles over a pitch, a pitch further, and the other way.
    """
    size = 0.4 if quick else 0.2
    angles = (0.0, 4.0) if quick else (0.0, 2.5, 5.0, 7.5, 10.0, 12.5)
    found = [pressed(angle, size) for angle in angles]
    further, back = pressed(angles[1] + PITCH, size), pressed(-angles[1], size)
    some, scale = found[1], abs(found[1]["force_y_N"])
    away = max(abs(f["torque_Nmm"] - f["of_points_Nmm"]) / abs(f["force_y_N"]) for f in found)
    rows = [
        judged("change-of-by-a-turn-of", abs(further[name] - some[name]) / scale, name=name)
        for name in ("force_x_N", "force_y_N")
    ]
    rows += [
        judged("of-opposite-turns-their-over-the", abs(back[name] + sign * some[name]) / scale, name=name, what=what)
        for name, sign, what in (("force_x_N", 1.0, "sum"), ("force_y_N", -1.0, "difference"))
    ]
    rows += [
        judged("sideways-over-vertical-force-of-a", abs(found[0]["force_x_N"]) / abs(found[0]["force_y_N"])),
        judged("the-same-at-deg", abs(some["force_x_N"]) / scale, value=angles[1]),
        judged("torque-reported", away / size),
    ]
    table: dict[str, Any] = {"angle_deg": list(angles)} | {key: [f[key] for f in found] for key in found[0]}
    return Result(tuple(rows), table, lambda figure: _draw_gear(figure, table))


def _draw_gear(figure: Any, table: dict[str, Any]) -> None:
    axes = figure.subplots()
    axes.plot(table["angle_deg"], [-f for f in table["force_y_N"]], "o-", label="vertical, down")
    axes.plot(table["angle_deg"], table["force_x_N"], "s-", label="sideways")
    axes.axhline(0.0, color="0.6", lw=0.8)
    axes.set(xlabel="turn of the wheel (deg)", ylabel="force on the finger (N)", title="gear")


E, NU = 1.0, 0.3
HALF, HEIGHT, WIDTH = 4.0, 6.0, 4.0
LIP = 1.5
"""Height of the lip (mm), from the mouth of the slot up."""

WALLS = FREE_FACES.index("walls")


def slot(mouth: float, cavity: float, deep: float, lip: float = 0.0) -> Triangles:
    """A block with a slot along z below, `mouth` wide up to a height `lip`, and `cavity` wide above, `deep` in all."""
    from build123d import Align, Box, Pos

    above = (Align.CENTER, Align.MIN, Align.CENTER)
    solid = Box(cavity + 6.0, deep + 3.0, 40.0, align=above) - Box(mouth, deep, 40.0, align=above)
    if cavity > mouth:
        solid -= Pos(0.0, lip, 0.0) * Box(cavity, deep - lip, 40.0, align=above)
    points, faces = solid.tessellate(1e-3)
    return of_trimesh(trimesh.Trimesh([tuple(p) for p in points], faces))  # merges the points of neighbouring faces


def model(surface: Triangles, size: float, legs: tuple[Leg, ...], mu: float) -> Model:
    """A block in a slot, plane strain."""
    more = {"object": MeshObject(surface=surface), "friction": Coulomb(mu), "domain": "plane-strain", "symmetry": ()}
    return block_model((HALF, HEIGHT, WIDTH), Isotropic(E, NU), (size, size), legs, **more)


def confined(size: float) -> tuple[float, float, float]:
    """Strain, and mean pressures (MPa) on the contact face and in the middle of a wall."""
    depth, strip = 0.3, 0.02
    problem = build(model(slot(2.0 * HALF + 2e-5, 2.0 * HALF + 2e-5, HEIGHT - depth - strip), size,
                          (Leg(depth, steps=1),), 0.0))  # fmt: skip
    last = converged(problem)[-1]
    pressure, face = last.state.force[:, 0] / problem.points.area, problem.points.face
    middle = (face == WALLS) & (np.abs(problem.points.points[:, 1] - 0.6 * HEIGHT) < 0.2 * HEIGHT)
    return depth / HEIGHT, float(pressure[face == 0].mean()), float(pressure[middle].mean())


def slid(size: float) -> dict[str, Any]:
    """The block under a slot with an undercut that slides by 0.8 mm; clearances 0.3 mm at the lip, 1.5 mm above it."""
    depth = 0.5
    legs = (Leg(depth, steps=1), Leg(depth, slide_x_mm=0.8, steps=4))
    problem = build(model(slot(2.0 * HALF + 0.6, 2.0 * HALF + 3.0, 4.0, LIP), size, legs, 0.2))
    steps = converged(problem)
    last = steps[-1]
    force, at = problem.world_force(last.meshed_state.contact), problem.points.points
    before, walls = problem.world_force(steps[0].meshed_state.contact), problem.points.face == WALLS
    touching = (last.state.status != OPEN) & walls
    mouth = problem.system.first_contact_mm - depth
    return {
        "wall_N": float(force[walls, 0].sum()),
        "face_N": float(force[problem.points.face == 0, 0].sum()),
        "lowest": float(at[touching, 1].min() - mouth),
        "highest": float(at[touching, 1].max() - mouth),
        "penetration_mm": check_surface(problem, [last])[0].penetration_mm,
        "wall_before_N": float(np.abs(before[walls]).sum()),
        "pressure": (at[walls], last.state.force[walls, 0] / problem.points.area[walls]),
        "mouth": mouth,
    }


def _slot(quick: bool) -> Result:
    """Does a finger in a slot press on its walls, and does an undercut touch where it is?

    A block fills a slot but for 1e-5 mm and is pressed without friction: the strain is uniaxial, the pressure on
    the contact face M eps with M = E (1 - nu) / ((1 + nu)(1 - 2 nu)), that on the walls nu / (1 - nu) times it
    (Hooke's law). Then a slot whose mouth is narrower than its cavity slides against the pressed block: the lip at
    the mouth touches the wall, and nothing touches in the cavity above it. The wall enters the sharp edges of the
    lip, between the contact points, by less on a finer mesh.

    A confined block, and an undercut on three meshes.
    """
    sizes = (0.5, 0.25) if quick else (0.5, 0.25, 0.125)
    strain, top, side = confined(0.5)
    stiff = E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU))
    found = [slid(size) for size in sizes]
    end = found[-1]
    at = f"edges of {sizes[-1]:g} mm"
    rows = [
        judged("pressure-on-the-contact-face-over", top / (stiff * strain)),
        judged("pressure-on-a-wall-over-that", side / top, NU / (1.0 - NU)),
        judged("force-on-the-walls-before-the", end["wall_before_N"]),
        judged("lowest-touching-point-above-the-slot", end["lowest"], tolerance=2.0 * sizes[-1], at=at),
        judged("highest-touching-point-above-the-slot", end["highest"], LIP, tolerance=2.0 * sizes[-1], at=at),
        judged("force", end["wall_N"], at=at),
        judged("penetration-on-the-finest-mesh-over", end["penetration_mm"] / found[0]["penetration_mm"]),
    ]
    keys = ("wall_N", "face_N", "lowest", "highest", "penetration_mm")
    table: dict[str, Any] = {"size_mm": list(sizes)} | {key: [f[key] for f in found] for key in keys}
    return Result(tuple(rows), table, lambda figure: _draw_slot(figure, sizes, found))


def _draw_slot(figure: Any, sizes: tuple[float, ...], found: list[dict[str, Any]]) -> None:
    left, right = figure.subplots(1, 2)
    for size, case in zip(sizes, found, strict=True):
        at, pressure = case["pressure"]
        own = at[:, 0] < 0.0
        order = np.argsort(at[own, 1])
        left.plot(pressure[own][order], at[own][order, 1], "o-", ms=3, lw=1.0, label=f"edges of {size:g} mm")
    left.axhspan(found[0]["mouth"], found[0]["mouth"] + LIP, color="0.9", label="lip of the slot")
    left.set(xlabel="pressure on the wall (MPa)", ylabel="height on the wall (mm)", title="slot with a lip")
    right.plot(sizes, [f["penetration_mm"] for f in found], "o-")
    right.set(xlabel="edge length (mm)", ylabel="largest penetration (mm)", xlim=(0.0, None), ylim=(0.0, None))


def run(quick: bool) -> Result:
    """A gear wheel, then slots."""
    return together((10.0, 9.0), gear=_gear(quick), slot=_slot(quick))
