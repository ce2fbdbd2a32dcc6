"""Do presses and slides of a gel pad agree with those that ANSYS and Kratos needed minutes to a night for?

Sources: validation/REFERENCES.md, 6.6.  ANSYS 2025 R2, on an i7-14700F, for a gel 25.25 x 20.75 mm, 4 mm thick, bonded
to a rigid back, E = .1 MPa, nu = .49, neo-Hookean; its authors give 9 % as the error of their forces at its default
tolerance.  Kratos, for a section whose three meshes do not converge.  Here every increment satisfies the contact
conditions to 1e-8, and every number has the error bar of its mesh and increments.

Not published, and inferred: the static friction of the plane, for which its kinetic one is taken; the radius and the
modulus of the half cylinder, R = 2 mm and E = 1 MPa, per millimetre of width.  The pad that tapers, .469 N at 1 mm,
is left out: its walls are not described.  "Overnight" is drawn as 12 hours.

Tangential forces of spheres exceed mu N where the contact leans: the friction of a tilted facet and the sideways push
of its pressure both count.  `force_x_N` is the whole of it, as a load cell reads it, and `tangential_force_x_N` the
friction alone; the study shows both.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from finger3d._types import Tree
from finger3d.analyses.press import press
from finger3d.analyses.result import PressResult

from ._press import block_tables
from ._rows import Result, Row, columns, given, listed

judged = listed(__file__)

PRESS = 4
"""Increments of a press before a slide."""


GIVEN = given(__file__)
"""Published presses: tables of the scene, edges at the contact, a tenth or less of its width, and numbers by what they
are, each with the way in which it is read from a press; and the half cylinder on a section."""


def _pull(result: PressResult) -> float:
    return float(np.hypot(result.last.force_x_N, result.last.force_z_N))


def _sliding(result: PressResult) -> float:
    """Share of the contact points that slide."""
    status = list(result.to_dataframe("contact")["status"])
    return status.count("slip") / (len(status) - status.count("open"))


def _ratio_at(slide_mm: float) -> Callable[[PressResult], float]:
    def ratio(result: PressResult) -> float:
        slides = [step.slide_z_mm for step in result.steps]
        return float(np.interp(slide_mm, slides, [abs(s.force_z_N) / (s.normal_force_N or 1.0) for s in result.steps]))

    return ratio


READ: dict[str, Callable[[PressResult], float]] = {
    "force": lambda result: result.last.normal_force_N,
    "force after the press": lambda result: result.steps[PRESS - 1].normal_force_N,
    "largest pull": lambda result: max(abs(step.force_x_N) for step in result.steps),
    "pull": _pull,
    "depth before the slide": lambda result: result.steps[PRESS - 1].depth_mm,
    "ratio at .4 mm": _ratio_at(0.4),
    "ratio at 1.1 mm": _ratio_at(1.1),
    "sliding": _sliding,
}


def _tables(scene: Tree, coarser: float) -> Tree:
    """Return the tables of a scene, with edges longer by a factor."""
    size = coarser * scene["size_mm"]
    return block_tables((12.625, 4.0, 20.75), 0.1, 0.49, (size, min(4.0 * size, 2.5)), **scene["tables"])


def run(quick: bool) -> Result:
    """Quick: the ball, the plane and the section, on edges twice as long."""
    coarser = 2.0 if quick else 1.0
    every = GIVEN["scene"]
    scenes = [every[0], every[-1]] if quick else every
    rows, lines, curves, times = list[Row](), [], {}, []
    for scene in scenes:
        name, seconds_there = scene["name"], scene.get("seconds_there", np.nan)
        began = time.perf_counter()
        result = press(_tables(scene, coarser), figures=False)
        seconds = time.perf_counter() - began
        times.append((name, seconds, seconds_there))
        curves[name] = [(step.slide_x_mm, step.force_x_N) for step in result.steps]
        for what, number in scene["numbers"].items():
            theirs, here = number["published"], READ[number["read"]](result)
            rows.append(judged("beside-ansys", here, theirs, what=what, name=name))
            lines.append((name, what, theirs, here, _bar(result, what), seconds, seconds_there))
        rows.append(judged("largest-residual", max(step.residual or 0.0 for step in result.steps), name=name))
    section = press(GIVEN["section"] | {"mesh": {"size_mm": 0.1 * coarser}}, figures=False)
    rows.append(judged("beside-kratos", section.last.normal_force_N))
    names = "scene number theirs here bar seconds_here seconds_there"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, times, curves))


def _bar(result: PressResult, what: str) -> float:
    """Return the error bar of a force or a depth at the end; NaN of other numbers."""
    key = {"normal force, N": "normal_force_N", "tangential force, N": "force_x_N", "depth, mm": "depth_mm"}.get(what)
    estimate = result.summary()["error_estimate"] or {}
    parts = [(estimate.get(part) or {}).get(key, np.nan) for part in ("discretisation", "steps")]
    return float(np.nansum(parts)) if key and not np.isnan(parts[0]) else np.nan


def _draw(figure: Any, times: list[tuple[str, float, float]], curves: dict[str, Any]) -> None:
    figure.set_size_inches(11.0, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    known = [(name, here, there) for name, here, there in times if np.isfinite(there)]
    place = np.arange(len(known))
    left.barh(place - 0.2, [there for *_, there in known], 0.36, color="#b3b3b3", label="ANSYS, 8 cores (published)")
    left.barh(
        place + 0.2, [here for _, here, _ in known], 0.36, color="#2166ac", label="finger3d, 2 cores, with error bars"
    )
    left.set(xscale="log", xlabel="time (s)", xlim=(1.0, 1e6))
    names = [name.replace(", slid", ",\nslid").replace(", pressed", ",\npressed") for name, *_ in known]
    left.set_yticks(place, names, fontsize=8)
    left.set_ylim(len(known) + 0.6, -0.6)
    left.legend(frameon=False, fontsize=8, loc="lower right")
    left.set_title("time of a press or a slide")
    name = GIVEN["scene"][-1]["name"]
    slide, pull = np.abs(curves[name]).T
    right.plot(slide, pull, "o-", color="#2166ac", ms=4, label="finger3d")
    right.axhline(2.15, color="#888888", ls="--", label="ANSYS at 1 mm, 2.15 N")
    right.axhline(0.45 * 5.0, color="#222222", lw=0.8, label="mu N")
    right.set(xlabel="slide (mm)", ylabel="tangential force (N)", ylim=(0.0, 2.6))
    right.set_title("a plane with 5 N slides over the gel")
    right.legend(frameon=False, fontsize=8, loc="lower right")
