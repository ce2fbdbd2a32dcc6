"""How long do labels for learning take: 1e5 presses and slides of a gel pad, with fields on a grid of its face?

No source: a goal of this project, ten hours on two cores, with an error of at most 3 % in the force.  The pad is that
of a GelSight-like sensor, 20 x 16 mm and 4 mm thick, nearly incompressible, its back bonded.  Ball, cylinder and edge,
its size, place, turn, depth, mu and slide are drawn at random; all samples of an object share one body condensed to the
whole contact face.  The command is `finger3d sweep --sample random:N`, with the labels of the last increment on a grid
of 0.5 mm.  Edges are as short as each object needs.  Errors are those of the mesh, from edges half as long for some of
the same samples: forces converge with an order of 1.2 (accuracy.md), so that the error is 1 / (1 - 0.5^1.2) of the
difference.  Samples from the finished file are pressed again alone.  At large deformation fewer samples of the ball are
measured, on edges of 1.5 mm.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from finger3d._machine import cores
from finger3d._types import Float
from finger3d.analyses.sweep.run import sweep

from ._rows import Result, Row, at_most, columns

BY_NAME = True
GOAL = "goal of this project"
HOURS, SAMPLES, ERROR = 10.0, 1e5, 0.03
FINER, ORDER, FEW, ALONE = 0.5, 1.2, 16, 334
OBJECTS: dict[str, tuple[dict[str, Any], dict[str, tuple[float, float]]]] = {
    "ball": ({"shape": "sphere", "radius_mm": 4.0}, {"object.radius_mm": (3.0, 8.0)}),
    "cylinder": ({"shape": "cylinder", "radius_mm": 4.0}, {"object.radius_mm": (3.0, 8.0)}),
    "edge": ({"shape": "wedge", "angle_deg": 40.0, "tip_radius_mm": 1.0}, {"object.tip_radius_mm": (1.0, 3.0)}),
}
SIZES = {"ball": 1.0, "cylinder": 0.85, "edge": 0.6}
"""Edges at the contact, mm."""

DRAWN = {
    "friction.mu": (0.2, 1.0), "object.x_mm": (-4.0, 4.0), "object.z_mm": (-3.0, 3.0),
    "press.leg.0.depth_mm": (0.3, 0.8), "press.leg.1.depth_mm": (0.3, 0.8), "press.leg.1.slide_x_mm": (0.05, 0.6),
    "press.leg.1.slide_z_mm": (-0.3, 0.3),
}  # fmt: skip


class Measured(NamedTuple):
    """Samples of one object.

    Attributes
    ----------
    seconds : of the whole sweep, meshing and condensation included
    force, finer : normal force of some samples, N, and of the same on shorter edges
    alone : largest relative difference of the numbers of samples pressed again alone
    """

    name: str
    samples: int
    seconds: float
    body_seconds: float
    force: Float
    finer: Float
    alone: float


def scene(name: str, size: float, large: bool) -> dict[str, Any]:
    """The pad under an object."""
    return {
        "finger": {"geometry": "block", "half_length_mm": 10.0, "height_mm": 4.0, "width_mm": 16.0},
        "material": {"E_MPa": 0.1, "nu": 0.49},
        "object": {**OBJECTS[name][0], "x_mm": 0.0, "z_mm": 0.0},
        "friction": {"mu": 0.5},
        "press": {"leg": [{"depth_mm": 0.5, "steps": 4}, {"depth_mm": 0.5, "slide_x_mm": 0.1, "steps": 4}]},
        "mesh": {"mesher": "swept", "size_mm": size, "base_size_mm": 1.5 * size},
        "labels": {"grid_mm": 0.5},
        "effects": {"auto": False, **({"large_deformation": {}} if large else {})},
    }


def run(quick: bool) -> Result:
    """Quick: three samples of a ball."""
    size, count, deformed = (1.0, 3, 0) if quick else (0.7, 1200, 24)
    names = list(OBJECTS)[:1] if quick else list(OBJECTS)
    with tempfile.TemporaryDirectory() as folder:
        found = [_measured(name, size, count // len(names), False, Path(folder)) for name in names]
        large = [_measured("ball", 1.5, deformed, True, Path(folder))] if deformed else []
    rows = [_hours(found, "small strain")]
    rows += [_error(one) for one in found]
    rows.append(at_most("numbers of samples pressed again alone, largest relative difference", "the same press", 1e-9,
                        max(one.alone for one in found), "round-off"))  # fmt: skip
    if large:
        rows.append(_hours(large, "large deformation, edges of 1.5 mm"))
    lines = [
        (one.name, one.samples, one.seconds, one.body_seconds, float(np.nanmedian(_off(one)))) for one in found + large
    ]
    table = columns("object samples seconds body_seconds median_error", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, lines))


def _measured(name: str, size: float, count: int, large: bool, folder: Path) -> Measured:
    ranges = DRAWN | OBJECTS[name][1]
    out = folder / f"{name} {large}"
    began = time.perf_counter()
    result = sweep(scene(name, size, large), ranges, out, sample=f"random:{count}", seed=count)
    seconds = time.perf_counter() - began
    with h5py.File(out / "labels.h5") as file:
        numbers = {key: values[:] for key, values in file["body_1/numbers"].items()}
    few = min(count, FEW)
    points = folder / f"{name} {large}.csv"
    lines = [",".join(ranges), *(",".join(repr(float(numbers[key][k])) for key in ranges) for k in range(few))]
    points.write_text("\n".join(lines) + "\n", encoding="utf-8")
    finer = sweep(scene(name, FINER * size, large), points, folder / f"{name} {large} finer").columns
    same = sweep(scene(name, size, large), points, folder / f"{name} {large} again").columns
    keys = "normal_force_N", "tangential_force_x_N", "external_work_mJ", "contact_area_mm2"
    alone = max(float(np.abs(np.array(same[key]) / numbers[key][:few] - 1.0).max()) for key in keys)
    force = numbers["normal_force_N"][:few]
    build = float(result.columns["build_seconds"][0])
    return Measured(name, count, seconds, build, force, np.array(finer["normal_force_N"]), alone)


def _off(one: Measured) -> Float:
    """Return the relative errors of the forces."""
    return np.abs(one.force / one.finer - 1.0) / (1.0 - FINER**ORDER)


def _hours(found: list[Measured], what: str) -> Row:
    """Return the hours that 1e5 samples take on as many cores as this machine has."""
    each = sum(one.seconds - one.body_seconds for one in found) / sum(one.samples for one in found)
    name = (
        f"hours of 1e5 samples on {cores()} cores, {what}: {each:.2f} s each, {sum(o.samples for o in found)} measured"
    )
    return Row(name, GOAL, HOURS, each * SAMPLES / 3600.0, 0.0, "a goal", "statement", "at most")


def _error(one: Measured) -> Row:
    what = f"error of the normal force, {one.name}, median of {len(one.force)} samples, by edges {FINER} times as long"
    return Row(
        what,
        "order of convergence of forces",
        ERROR,
        float(np.nanmedian(_off(one))),
        0.0,
        "a goal",
        "statement",
        "at most",
    )


def _draw(figure: Any, lines: list[tuple[str, int, float, float, float]]) -> None:
    """Draw hours and errors by object; the last bar, after the three objects, is the ball at large deformation."""
    left, right = figure.subplots(1, 2)
    names = [*(name for name, *_ in lines[:3]), *(f"{name}, large\ndeformation" for name, *_ in lines[3:])]
    hours = [(seconds - body) / count * SAMPLES / 3600.0 for _, count, seconds, body, _ in lines]
    left.bar(names, hours, color="#2166ac")
    left.axhline(HOURS, color="#222222", lw=0.8, label="goal")
    left.set(ylabel="hours on two cores", title="100 000 samples with labels")
    right.bar(names, [100.0 * line[-1] for line in lines], color="#67a9cf")
    right.axhline(100.0 * ERROR, color="#222222", lw=0.8, label="goal")
    right.set(ylabel="error of the normal force, median (%)", title="edges of 0.7 mm, 1.5 mm at large deformation")
    for axes in (left, right):
        axes.legend(frameon=False)
