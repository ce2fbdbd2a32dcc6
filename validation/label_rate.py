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
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from finger3d._machine import cores
from finger3d._types import Float
from finger3d.analyses.sweep.run import sweep
from finger3d.io import write_csv

from ._press import block_tables
from ._rows import Result, Row, columns, given, listed

BY_NAME = True
judged = listed(__file__)

HOURS, SAMPLES, ERROR = 10.0, 1e5, 0.03
FINER, ORDER, FEW = 0.5, 1.2, 16
SAMPLES_EACH, ALONE = 667, 334
LARGE_SIZE, LARGE_SAMPLES = 1.5, 200
NUMBERS = "normal_force_N", "tangential_force_x_N", "external_work_mJ", "contact_area_mm2"
GIVEN = given(__file__)
OBJECTS = GIVEN["object"]
"""Tables of the objects, ranges of the keys that are theirs, and edges at the contact, mm."""


class Swept(NamedTuple):
    """Samples of one object.

    Attributes
    ----------
    ranges : of the keys that were drawn
    size_mm, large : edges at the contact, and whether at large deformation
    seconds, body_seconds : of the whole sweep, and of meshing and condensation, which are part of it
    numbers : of all samples by name, from the finished file
    """

    name: str
    ranges: dict[str, tuple[float, float]]
    size_mm: float
    large: bool
    seconds: float
    body_seconds: float
    numbers: dict[str, Float]

    @property
    def samples(self) -> int:
        return len(self.numbers["normal_force_N"])

    def pressed(self, count: int, finer: float, folder: Path) -> Mapping[str, Sequence[Any]]:
        """Return the table of the first samples, pressed again on edges that are longer by a factor."""
        points, count = folder / "points.csv", min(count, self.samples)
        write_csv(points, {key: self.numbers[key][:count] for key in self.ranges})
        out = folder / f"{self.name} {self.large} {finer}"
        return sweep(scene(self.name, finer * self.size_mm, self.large), points, out).columns

    def errors(self, folder: Path) -> Float:
        """Return the relative errors of the normal force of some samples."""
        finer = np.array(self.pressed(FEW, FINER, folder)["normal_force_N"])
        return np.abs(self.numbers["normal_force_N"][: len(finer)] / finer - 1.0) / (1.0 - FINER**ORDER)

    def difference(self, count: int, folder: Path) -> float:
        """Return the largest relative difference of numbers of samples that are pressed again alone."""
        again = self.pressed(count, 1.0, folder)
        pairs = [(np.array(again[key]), self.numbers[key]) for key in NUMBERS]
        return max(float(np.abs(one / other[: len(one)] - 1.0).max()) for one, other in pairs)


def scene(name: str, size: float, large: bool) -> dict[str, Any]:
    """The pad under an object."""
    legs = [{"depth_mm": 0.5, "steps": 4}, {"depth_mm": 0.5, "slide_x_mm": 0.1, "steps": 4}]
    return block_tables(
        (10.0, 4.0, 16.0), 0.1, 0.49, (size, 1.5 * size), object=OBJECTS[name]["table"],
        friction={"mu": 0.5}, press={"leg": legs}, labels={"grid_mm": 0.5},
        effects={"auto": False, **({"large_deformation": {}} if large else {})},
    )  # fmt: skip


def run(quick: bool) -> Result:
    """Quick: three samples of a ball, on edges twice as long."""
    names, count, alone, longer = (["ball"], 3, 3, 2.0) if quick else (list(OBJECTS), SAMPLES_EACH, ALONE, 1.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small = [_swept(name, longer * OBJECTS[name]["size_mm"], count, False, folder) for name in names]
        large = [] if quick else [_swept("ball", LARGE_SIZE, LARGE_SAMPLES, True, folder)]
        errors = [one.errors(folder) for one in small + large]
        apart = max(one.difference(alone, folder) for one in small)
    rows = [_hours(small, "small strain")]
    rows += [_error(one, error) for one, error in zip(small, errors, strict=False)]
    rows.append(judged("samples-pressed-again-alone", apart, count=alone * len(small)))
    if large:
        rows.append(_hours(large, f"large deformation, edges of {LARGE_SIZE} mm"))
    lines = [
        (one.name, one.samples, one.size_mm, one.seconds, one.body_seconds, float(np.nanmedian(error)))
        for one, error in zip(small + large, errors, strict=True)
    ]
    table = columns("object samples size_mm seconds body_seconds median_error", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, lines))


def _swept(name: str, size: float, count: int, large: bool, folder: Path) -> Swept:
    ranges = {key: tuple(ends) for key, ends in (GIVEN["ranges"] | OBJECTS[name]["ranges"]).items()}
    out = folder / f"{name} {large}"
    began = time.perf_counter()
    result = sweep(scene(name, size, large), ranges, out, sample=f"random:{count}", seed=count)
    seconds = time.perf_counter() - began
    with h5py.File(out / "labels.h5") as file:
        numbers = {key: values[:] for key, values in file["body_1/numbers"].items()}
    return Swept(name, ranges, size, large, seconds, float(result.columns["build_seconds"][0]), numbers)


def _hours(found: list[Swept], what: str) -> Row:
    """Return the hours that 1e5 samples take on as many cores as this machine has."""
    count = sum(one.samples for one in found)
    each = sum(one.seconds - one.body_seconds for one in found) / count
    return judged("hours", each * SAMPLES / 3600.0, HOURS, cores=cores(), what=what, each=each, count=count)


def _error(swept: Swept, errors: Float) -> Row:
    """Return the median error of the normal force."""
    return judged("error", np.nanmedian(errors), ERROR, name=swept.name, count=len(errors), size=swept.size_mm)


def _draw(figure: Any, lines: list[tuple[str, int, float, float, float, float]]) -> None:
    """Draw hours and errors by object; the last bar, after the three objects, is the ball at large deformation."""
    left, right = figure.subplots(1, 2)
    names = [f"{name},\n{size} mm" for name, _, size, *_ in lines[:3]]
    names += [f"{name},\n{size} mm,\nlarge\ndeformation" for name, _, size, *_ in lines[3:]]
    hours = [(seconds - body) / count * SAMPLES / 3600.0 for _, count, _, seconds, body, _ in lines]
    left.bar(names, hours, color="#2166ac")
    left.axhline(HOURS, color="#222222", lw=0.8, label="goal")
    left.set(ylabel="hours on two cores", title="100 000 samples with labels")
    right.bar(names, [100.0 * line[-1] for line in lines], color="#67a9cf")
    right.axhline(100.0 * ERROR, color="#222222", lw=0.8, label="goal")
    right.set(ylabel="error of the normal force, median (%)", title="by edges half as long")
    for axes in (left, right):
        axes.legend(frameon=False)
