"""What does an error cost in time: force, gauge strain and stick area of a section, beside CalculiX?

The Fig. 9 finger in plane strain, nu = 0.45, mu = 0.25, pressed 10 mm: the section of beside_calculix.py, on its
quadratic meshes and on finer and coarser ones, of equal grading.  The path of a section under a plane is exact, so that
errors are those of the mesh.  The truth is extrapolated from the two finest meshes by the rate of each number on the
three finest; where these do not converge evenly, it is that of the finest mesh, uncertain by the last difference.
Errors below the uncertainty are not drawn.  Times are the least of three, from the meshing to the last increment.
Those of CalculiX are from the table of beside_calculix; its error includes that of its penalty contact.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from finger3d.accuracy.estimate import press_numbers
from finger3d.analyses.pressed_body import PressedBody
from finger3d.mechanics.march.step_halving import march_automatic

from ._cost import SECTION, Case, model_of
from ._paper import columns
from ._rows import Result, Row

BY_NAME = True
NU = 0.45
SIZES = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
NUMBERS = {"normal_force_N": "normal force", "gauge_g": "gauge strain", "stick_area_mm2": "stick area"}
PEER = Path(__file__).with_name("results") / "beside_calculix_table.csv"
COLUMNS = "program size_mm dofs seconds number value error"
Line = tuple[str, float, int, float, str, float, float]


def run(quick: bool) -> Result:
    """Quick: without the two finest meshes, and each mesh once."""
    sizes = SIZES[:-2] if quick else SIZES
    found = {size: _pressed(size, 1 if quick else 3) for size in sizes}
    limits = {name: _limit([found[size][2][name] for size in sizes[-3:]]) for name in NUMBERS}
    truths = {name: value for name, (value, _) in limits.items()}
    floors = {name: uncertainty / abs(value) for name, (value, uncertainty) in limits.items()}
    lines: list[Line] = [
        ("finger3d", size, dofs, seconds, name, numbers[name], abs(numbers[name] / truths[name] - 1.0))
        for size, (dofs, seconds, numbers) in found.items()
        for name in NUMBERS
    ]
    force = truths["normal_force_N"]
    lines += [
        ("CalculiX", float(line["size_mm"]), int(line["dofs"]), float(line["wall_s"]), "normal_force_N",
         float(line["force_N"]), abs(float(line["force_N"]) / force - 1.0))
        for line in _peer()
    ]  # fmt: skip
    return Result(tuple(_rows(lines, floors)), columns(COLUMNS, lines), lambda figure: _draw(figure, lines, floors))


def _pressed(size: float, repeats: int) -> tuple[int, float, Mapping[str, float]]:
    """Return the unknowns, the least seconds of some presses, and the numbers."""
    model = model_of(Case(SECTION, size, 4.0 * size, "quadratic", nu=NU))
    seconds = math.inf
    for _ in range(repeats):
        start = time.perf_counter()
        problem = PressedBody(model).problem
        steps, _chosen = march_automatic(problem)
        seconds = min(seconds, time.perf_counter() - start)
    return problem.size.dofs, seconds, press_numbers(problem, steps[-1])


def _limit(found: list[float]) -> tuple[float, float]:
    """Return the limit of a sequence on three meshes, each half as coarse, and its uncertainty.

    Aitken's formula if the differences fall by a fourth at least; else the last value.
    """
    first, second = found[1] - found[0], found[2] - found[1]
    ratio = second / first if first else 0.0
    step = second * ratio / (1.0 - ratio) if 0.0 < ratio < 0.75 else 0.0
    return found[2] + step, abs(step or second)


def _peer() -> list[dict[str, str]]:
    """Return the lines of CalculiX's runs of the section."""
    with PEER.open(encoding="utf-8") as file:
        return [line for line in csv.DictReader(file) if (line["program"], line["body"]) == ("CalculiX", SECTION)]


def _rows(lines: list[Line], floors: Mapping[str, float]) -> list[Row]:
    rows = [
        Row(f"{name}: uncertainty of the truth, relative", "three finest meshes", 0.0, floors[name], 0.02,
            "errors of a few per cent are judged", measure="absolute")
        for name in NUMBERS
    ]  # fmt: skip
    for name in NUMBERS:
        errors = [line[6] for line in lines if (line[0], line[4]) == ("finger3d", name)]
        text = f"{name}: error with edges of {SIZES[0]:g} mm over that of the third finest mesh"
        rows.append(Row(text, "errors fall with the mesh", 1.0, errors[0] / errors[-3], 0.0, "refined", "verification",
                        "at least"))  # fmt: skip
    return rows


def _draw(figure: Any, lines: list[Line], floors: Mapping[str, float]) -> None:
    figure.set_size_inches(7.0, 4.4)
    figure.set_layout_engine("constrained")
    axes = figure.subplots()
    for (name, label), mark in zip(NUMBERS.items(), ("o-", "s-", "^-"), strict=True):
        some = [(line[3], 100.0 * line[6]) for line in lines if (line[0], line[4]) == ("finger3d", name)]
        known = [(x, y) for x, y in some if y > 100.0 * floors[name]]
        axes.loglog(*zip(*known, strict=True), mark, label=label)
    peer = [(line[3], 100.0 * line[6]) for line in lines if line[0] == "CalculiX"]
    axes.loglog(*zip(*peer, strict=True), "k*", ms=11, ls="none", label="normal force, CalculiX (penalty contact)")
    axes.set(xlabel="time from mesh to last increment (s)", ylabel="error (%)",
             title="What an error costs: section of the Fig. 9 finger")  # fmt: skip
    axes.grid(True, which="major", lw=0.4, alpha=0.6)
    axes.legend(fontsize=8)
