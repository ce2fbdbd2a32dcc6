"""Do the teeth of a gear wheel push along their flanks, whichever way the wheel is turned?

The gear wheel of geometries/ has 24 teeth.  It comes turned about its axis by several angles, with its axis over the
middle of a finger, and is pressed without friction.  A turn by one pitch, 15 degrees, is the same scene; opposite turns
are mirror images, so that the sideways force and the torque change their sign.  Between those the flanks are not
symmetric about the middle, and push the finger sideways.  Without friction every point pushes along a normal of the
wheel: the torque about the axis is that of pressures on flanks and tips, as their places and normals give it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.files import read_surface
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import contact_table, measure
from finger3d.objects import MeshObject

from ._press import converged
from ._rows import Result, at_least, zero

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
    found, table = measure(problem.points, last), contact_table(problem.points, last.state)
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


def run(quick: bool) -> Result:
    """Angles over a pitch, a pitch further, and the other way."""
    size = 0.4 if quick else 0.2
    angles = (0.0, 4.0) if quick else (0.0, 2.5, 5.0, 7.5, 10.0, 12.5)
    found = [pressed(angle, size) for angle in angles]
    further, back = pressed(angles[1] + PITCH, size), pressed(-angles[1], size)
    some, scale = found[1], abs(found[1]["force_y_N"])
    rows = [
        zero(f"change of {name} by a turn of one pitch, over the force", "periodicity",
            abs(further[name] - some[name]) / scale, 1e-3,
            "the STL's corners have 32 bits, and its arcs are chords")
        for name in ("force_x_N", "force_y_N")
    ]  # fmt: skip
    rows += [
        zero(f"{name} of opposite turns, their {what} over the force", "mirror image",
            abs(back[name] + sign * some[name]) / scale, 1e-3,
            "the STL is its own mirror image to 32 bits")
        for name, sign, what in (("force_x_N", 1.0, "sum"), ("force_y_N", -1.0, "difference"))
    ]  # fmt: skip
    rows += [
        zero("sideways over vertical force of a symmetric position", "mirror image",
            abs(found[0]["force_x_N"]) / abs(found[0]["force_y_N"]), 1e-3, "as before"),
        at_least(f"the same at {angles[1]:g} deg", "flanks push sideways", 5e-3, abs(some["force_x_N"]) / scale,
            "no mirror image"),
        zero("torque reported less that of the points, over force times an edge length", "statics",
            max(abs(f["torque_Nmm"] - f["of_points_Nmm"]) / abs(f["force_y_N"]) for f in found) / size, 1.0,
            "forces act at the centroids of hats, the table gives their vertices"),
    ]  # fmt: skip
    table: dict[str, Any] = {"angle_deg": list(angles)} | {key: [f[key] for f in found] for key in found[0]}
    return Result(tuple(rows), table, lambda figure: _draw(figure, table))


def _draw(figure: Any, table: dict[str, Any]) -> None:
    left, right = figure.subplots(1, 2)
    left.plot(table["angle_deg"], [-f for f in table["force_y_N"]], "o-", label="vertical, down")
    left.plot(table["angle_deg"], table["force_x_N"], "s-", label="sideways")
    left.axhline(0.0, color="0.6", lw=0.8)
    left.set(xlabel="turn of the wheel (deg)", ylabel="force on the finger (N)")
    right.plot(table["angle_deg"], table["torque_Nmm"], "o-", label="reported")
    right.plot(table["angle_deg"], table["of_points_Nmm"], "x", label="from the points")
    right.axhline(0.0, color="0.6", lw=0.8)
    right.set(xlabel="turn of the wheel (deg)", ylabel="torque on the finger about the axis (N mm)")
