"""Fingers and gauges whose molds are tested."""

from __future__ import annotations

import itertools
import math

import numpy as np

from finger3d.geometry.design import designs
from finger3d.mechanics.model import Gauge
from finger3d.mold.body import shell
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import HALVES, Mold, mold
from finger3d.mold.solids import common
from finger3d.scene import parse

BODIES = {
    "clipped_cylinder": {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0},
    "half_cylinder": {"radius_mm": 5.0, "width_mm": 10.0},
    "block": {"half_length_mm": 20.0, "height_mm": 20.0, "width_mm": 20.0},
    "hemisphere": {"radius_mm": 8.0},
    "fingertip": {
        "radius_mm": 20.0, "half_length_mm": 15.0, "edge_height_mm": 12.0, "width_mm": 16.0,
        "skin_mm": 1.5, "core_half_length_mm": 5.0, "core_height_mm": 8.0,
    },
}  # fmt: skip


GAUGES = (
    Gauge("g36", 36.0, 40.0, angle=math.radians(30.0)),
    Gauge("low", -20.0, 10.0, z_mm=3.0, angle=math.radians(90.0), length_mm=4.0),
    Gauge("low, other side", -20.0, 10.0, z_mm=-3.0, angle=math.radians(90.0), length_mm=4.0),
)


def scene_of(name: str, **more):
    return parse(
        {
            "finger": {"geometry": name, **BODIES[name]},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
            **more,
        }
    )


FEW: dict[str, tuple[str, dict, tuple[str, ...]]] = {
    "plain, sla": ("hemisphere", {"printer": "sla", "screw": "none"}, ()),
    "pours": ("fingertip", {"parts": True}, ()),
    "insert": ("fingertip", {"parts": True}, ("core",)),
    "triangles": ("clipped_cylinder as STL", {}, ()),
}
"""A design, options and rigid parts for each feature."""


def made(name: str, options: dict, rigid: tuple[str, ...] = ()) -> Mold:
    """The mold of a design, of its solids, or of its triangles."""
    name, _, kind = name.partition(" as ")
    design = designs()[name](**BODIES[name])
    shape = shell(design.solid(), 0.1, name).surface if kind else design.solid()
    return mold(shape, (), MoldOptions(**options), design.solids(), rigid)


def overlaps(mold: Mold) -> dict[str, float]:
    """Return the common volume (mm3) of each pair of parts in the assembled position, the cast bodies included.

    Parts of different pours are never in the mold together.
    """
    boxes = {}
    for name, solid in mold.parts.items():
        box = solid.bounding_box()
        boxes[name] = np.array([*box.min]), np.array([*box.max])
    shared: dict[str, float] = {}
    for pour in mold.pours:
        names = [*HALVES, *pour.others]
        for a, b in itertools.combinations(names, 2):
            apart = (boxes[a][0] > boxes[b][1]).any() or (boxes[b][0] > boxes[a][1]).any()
            if f"{a}, {b}" not in shared:
                shared[f"{a}, {b}"] = 0.0 if apart else common(mold.parts[a], mold.parts[b])
        for name in names:
            if pour.cast[0].cad is None and name in HALVES:
                continue  # cut from each other by a boolean of triangles
            volume = sum(body.shared(mold.parts[name]) for body in pour.cast)
            shared[f"{name}, sensor"] = max(volume, shared.get(f"{name}, sensor", 0.0))
    return shared
