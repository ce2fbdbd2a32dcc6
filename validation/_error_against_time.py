"""What does an error cost in time: force, gauge strain and stick area of a section, beside CalculiX and FElupe?

The Fig. 9 finger in plane strain, nu = 0.45, mu = 0.25, pressed 10 mm: the section of beside_calculix.py, on its
quadratic meshes and on finer and coarser ones, of equal grading, in automatic increments.  The truth is extrapolated
from the two finest meshes by the rate of each number on the three finest; where these do not converge evenly, it is
that of the finest mesh, uncertain by the last difference.  Errors below the uncertainty are not drawn.  Times are the
least of three, from the meshing to the last increment.  Both peers press half sections in ten increments, once on each
mesh, and their errors include those of their penalties: CalculiX those of beside_calculix.py, FElupe 11.3 those of its
defaults.  Where ccx or FElupe is not installed its committed runs are shown.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from finger3d.accuracy.estimate import press_numbers
from finger3d.analyses.pressed_body import PressedBody
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.step_halving import march_automatic
from finger3d.mechanics.model import Leg, Model

from . import _ccx, _felupe
from ._ccx import program
from ._cost import SECTION, Case, model_of
from ._felupe import felupe_press, is_felupe_installed
from ._rows import Result, Row, at_least, columns, committed_instead, zero
from .beside_calculix import calculix

NU = 0.45
SIZES = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
NUMBERS = {"normal_force_N": "normal force", "gauge_g": "gauge strain", "stick_area_mm2": "stick area"}
PEERS = {"CalculiX": (2.0, 1.0), "FElupe": (4.0, 2.0, 1.0, 0.5)}
"""Peers, and the edges, mm, of their meshes."""
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
    for peer, edges in PEERS.items():
        lines += _of_peer(peer, edges[:1] if quick else edges, force)
    return Result(tuple(_rows(lines, floors)), columns(COLUMNS, lines), lambda figure: _draw(figure, lines, floors))


def _case(size: float) -> Case:
    return Case(SECTION, size, 4.0 * size, "quadratic", nu=NU)


def _pressed(size: float, repeats: int) -> tuple[int, float, Mapping[str, float]]:
    """Return the unknowns, the least seconds of some presses, and the numbers."""
    model = model_of(_case(size))
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


def _of_peer(peer: str, edges: tuple[float, ...], truth: float) -> list[Line]:
    """Return the lines of a peer, or those that are committed."""
    run, installed, install = {
        "CalculiX": (_by_calculix, program() is not None, _ccx.INSTALL),
        "FElupe": (_by_felupe, is_felupe_installed(), _felupe.INSTALL),
    }[peer]
    if not installed:
        kept = committed_instead("error_against_time", peer, install)
        found = [(x["size_mm"], x["dofs"], x["seconds"], x["value"]) for x in kept if x["program"] == peer]
    else:
        found = [(size, build(model_of(_case(size))).size.dofs, *run(size)) for size in edges]
    return [
        (peer, size, dofs, seconds, "normal_force_N", value, abs(value / truth - 1.0))
        for size, dofs, seconds, value in found
    ]


def _by_calculix(size: float) -> tuple[float, float]:
    """Return the seconds and the force (N) of a press by CalculiX."""
    answer = calculix(_case(size))
    return answer.wall, answer.force


def _by_felupe(size: float) -> tuple[float, float]:
    """Return the seconds, with those of the mesh, and the force (N) of a press by FElupe."""
    model: Model = replace(model_of(_case(size)), legs=(Leg(10.0, steps=10),), gauges=())
    start = time.perf_counter()
    _, force = felupe_press(model, build(model).mesh)
    return time.perf_counter() - start, force


def _rows(lines: list[Line], floors: Mapping[str, float]) -> list[Row]:
    rows = [
        zero(f"{name}: uncertainty of the truth, relative", "three finest meshes", floors[name], 0.02,
            "errors of a few per cent are judged")
        for name in NUMBERS
    ]  # fmt: skip
    for name in NUMBERS:
        errors = [line[6] for line in lines if (line[0], line[4]) == ("finger3d", name)]
        text = f"{name}: error with edges of {SIZES[0]:g} mm over that of the third finest mesh"
        rows.append(at_least(text, "errors fall with the mesh", 1.0, errors[0] / errors[-3], "refined"))
    return rows


def _draw(figure: Any, lines: list[Line], floors: Mapping[str, float]) -> None:
    figure.set_size_inches(7.0, 4.4)
    axes = figure.subplots()
    for (name, label), mark in zip(NUMBERS.items(), ("o-", "s-", "^-"), strict=True):
        some = [(line[3], 100.0 * line[6]) for line in lines if (line[0], line[4]) == ("finger3d", name)]
        known = [(x, y) for x, y in some if y > 100.0 * floors[name]]
        axes.loglog(*zip(*known, strict=True), mark, label=label)
    for peer, mark in zip(PEERS, ("k*", "kD"), strict=True):
        theirs = [(line[3], 100.0 * line[6]) for line in lines if line[0] == peer]
        axes.loglog(*zip(*theirs, strict=True), mark, ms=8, ls="none", label=f"normal force, {peer} (penalty contact)")
    axes.set(xlabel="time from mesh to last increment (s)", ylabel="error (%)",
             title="What an error costs: section of the Fig. 9 finger")  # fmt: skip
