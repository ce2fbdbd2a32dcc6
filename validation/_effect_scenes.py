"""Random scenes that leave open which effects they need: sections and swept solids under every object."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Tree
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.scene import Scene, parse

FINGERS: tuple[Tree, ...] = (
    {"geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6},
    {"geometry": "half_cylinder", "radius_mm": 5.0},
    {"geometry": "block", "half_length_mm": 8.0, "height_mm": 8.0},
)
HEIGHTS, HALVES, WIDTHS = (50.0, 5.0, 8.0), (50.0, 5.0, 8.0), (20.0, 3.0, 8.0)
SOLID_EDGES = (5.0, 0.6, 1.1)
COIN = Path(__file__).resolve().parent.parent / "geometries" / "coin.stl"

_TRIES = 20
"""Draws of a scene until one is not refused: a gauge may be outside the finger, a mesh may not resolve the object."""


def scenes(sections: int, solids: int, seed: int, longer: float = 1.5) -> Iterator[tuple[str, Scene]]:
    """Names and scenes: the shapes of finger and object in turn, all else at random.

    Depths are 0.5 to 30 % of the height, in solids to 8 %, moduli of the object 1 to 1e5 times those of the finger, of
    foils 1 to 1e4 MPa, ratios of kinetic to static friction 0.3 to 1; 2 to 50 % of the modulus relax in 0.5 s, and the
    object takes 0.01 to 50 s for its way.  One path in four slides after the press.

    Parameters
    ----------
    longer : edge length at the contact of a section over the one that a press chooses
    """
    for domain, count, places in (("section", sections, 6), ("solid", solids, 7)):
        for number in range(count):
            random = np.random.default_rng([seed, number, domain == "solid"])
            finger, shape = number % len(FINGERS), (number // len(FINGERS)) % places
            for _ in range(_TRIES):
                try:
                    scene = parse(_drawn(random, finger, shape, domain == "solid", longer))
                    if domain == "solid":  # its edges are given, and may be too long for the object
                        build(scene.with_effects(()).model())
                    break
                except Finger3dError:
                    continue
            else:
                continue
            yield f"{domain} {number}: {scene.tables.object['shape']} on {scene.design.name}", scene


def _drawn(random: np.random.Generator, finger: int, shape: int, solid: bool, longer: float) -> Tree:
    """Return the tables of one scene; edges far from contact are four times as long as by default, or longer."""
    high, half, wide = HEIGHTS[finger], HALVES[finger], WIDTHS[finger]
    depth = high * log_uniform(random, 0.005, 0.08 if solid else 0.3)
    legs: list[Tree] = [{"depth_mm": depth, "duration_s": log_uniform(random, 0.01, 50.0), "steps": 4}]
    if random.random() < 0.25:
        slide = depth * random.uniform(0.05, 0.5)
        legs.append({"depth_mm": depth, "slide_x_mm": slide, "duration_s": log_uniform(random, 0.01, 50.0), "steps": 2})
    angle = random.uniform(0.0, 90.0)
    gauges = [
        {"name": name, "x_mm": x * half, "y_mm": y * high, "angle_deg": angle, "length_mm": 0.1 * high}
        for name, x, y in (("a", random.uniform(0.0, 0.5), random.uniform(0.3, 0.75)), ("b", 0.0, 0.6))
    ]
    if solid:  # a gauge that keeps the symmetry, and with it half of the mesh
        gauges = [{**gauges[1], "angle_deg": 0.0}]
    domain: Any = "solid" if solid else ("plane-strain", "plane-stress")[int(random.integers(2))]
    elastic = {"E_MPa": log_uniform(random, 1.0, 1e5), "nu": random.uniform(0.2, 0.45)}
    tables: Tree = {
        "finger": {**FINGERS[finger], "width_mm": wide},
        "material": {"E_MPa": 1.0, "nu": (random.uniform(0.3, 0.47), 0.49)[int(random.integers(2))]},
        "object": objects(random, high, depth)[shape],
        "friction": {"mu": log_uniform(random, 0.05, 1.2)},
        "press": {"leg": legs},
        "model": {"domain": domain},
        "gauge": gauges,
        "marker": [{"name": "m", "x_mm": 0.3 * half, "y_mm": 0.7 * high}],
        "effects": {
            "auto": True,
            "kinetic_friction": {"ratio": 1.0 - 0.7 * random.random() ** 2},
            "viscosity": {"prony": [[log_uniform(random, 0.02, 0.5), 0.5]]},
            "elastic_object": elastic,
            "embedded_gauge": {
                "E_MPa": log_uniform(random, 1.0, 1e4), "thickness_mm": 4e-4 * high, "width_mm": 0.06 * high,
            },
        },
    }  # fmt: skip
    if solid and shape in (3, 6):  # their bodies would be meshed by fTetWild
        del tables["effects"]["elastic_object"]
    if solid:
        edge = SOLID_EDGES[finger]
        return tables | {"mesh": {"size_mm": edge, "base_size_mm": 3.0 * edge, "mesher": "swept"}}
    own = parse(tables).mesh
    return tables | {"mesh": {"size_mm": longer * own.size_mm, "base_size_mm": 4.0 * own.base_size_mm}}


def objects(random: np.random.Generator, high: float, depth: float) -> tuple[Tree, ...]:
    """Return tables of objects about as large as a finger; a cylinder or ball is pressed in up to its middle."""
    round_mm = max(high * log_uniform(random, 0.5, 4.0), 1.2 * depth)
    return (
        {"shape": "plane"},
        {"shape": "cylinder", "radius_mm": round_mm},
        {"shape": "plane", "tilt_deg": random.uniform(1.0, 10.0)},
        {"shape": "sphere", "radius_mm": round_mm},
        {"shape": "wedge", "angle_deg": random.uniform(10.0, 40.0), "tip_radius_mm": 0.1 * high},
        {"shape": "wave", "wavelength_mm": high * random.uniform(0.3, 1.0), "amplitude_mm": 0.02 * high},
        {"shape": "mesh", "path": str(COIN), "scale": high / 12.0},
    )


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """Return a number between both, its logarithm evenly distributed."""
    return float(low * (high / low) ** random.random())
