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
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d.analyses.press import press
from finger3d.analyses.result import PressResult

from ._press import block_tables
from ._rows import Result, Row, at_most, columns

SOURCE = "ANSYS 2025 R2, irisxu02/gelsight_ansys_sim; REFERENCES.md, 6.6"
KRATOS = "Kratos, dokkev/fingertip-design-framework; REFERENCES.md, 6.6"
THEIRS = 0.09
"""Largest error of a force that the authors of the ANSYS scenes give."""
HOUR = 3600.0
PRESS = 4
"""Increments of a press before a slide."""


@dataclass(frozen=True)
class Scene:
    """A published press.

    Attributes
    ----------
    size_mm : edges at the contact; a tenth or less of its width
    numbers : published number and how it is read from a press, by what it is
    seconds_there : published time, s; None if there is none
    """

    name: str
    object: dict[str, Any]
    legs: list[dict[str, Any]]
    mu: float
    size_mm: float
    numbers: dict[str, tuple[float, Callable[[PressResult], float]]]
    seconds_there: float | None
    source: str = SOURCE

    def tables(self, coarser: float) -> dict[str, Any]:
        """Return the tables of the scene, with edges longer by a factor."""
        size = coarser * self.size_mm
        more = {"object": self.object, "friction": {"mu": self.mu}, "press": {"leg": self.legs}}
        return block_tables((12.625, 4.0, 20.75), 0.1, 0.49, (size, min(4.0 * size, 2.5)), **more)


def _force(result: PressResult) -> float:
    return result.last.normal_force_N


def _largest_pull(result: PressResult) -> float:
    return max(abs(step.force_x_N) for step in result.steps)


def _pull(result: PressResult) -> float:
    return float(np.hypot(result.last.force_x_N, result.last.force_z_N))


def _depth(result: PressResult) -> float:
    """Depth at the end of the press, before the slide, which lowers the object."""
    return result.steps[PRESS - 1].depth_mm


def _sliding(result: PressResult) -> float:
    """Share of the contact points that slide."""
    status = list(result.to_dataframe("contact")["status"])
    return status.count("slip") / (len(status) - status.count("open"))


def _ratio_at(slide_mm: float) -> Callable[[PressResult], float]:
    def ratio(result: PressResult) -> float:
        slides = [step.slide_z_mm for step in result.steps]
        return float(np.interp(slide_mm, slides, [abs(s.force_z_N) / (s.normal_force_N or 1.0) for s in result.steps]))

    return ratio


def _slid(force_N: float, slide: dict[str, float], steps: int) -> list[dict[str, Any]]:
    return [{"force_N": force_N, "steps": PRESS}, {"force_N": force_N, **slide, "steps": steps}]


def _sphere(radius_mm: float) -> dict[str, Any]:
    return {"shape": "sphere", "radius_mm": radius_mm}


TWO_N = {"hemisphere R 50": (_sphere(50.0), 0.9, 0.725, 4.9), "hemisphere R 10": (_sphere(10.0), 0.6, 0.783, 6.0),
         "cylinder R 50": ({"shape": "cylinder", "radius_mm": 50.0}, 1.0, 0.701, 1.4)}  # fmt: skip

SCENES = (
    Scene("ball R 3, pressed .8 mm", _sphere(3.0), [{"depth_mm": 0.8, "steps": 6}], 0.5, 0.35,
          {"normal force, N": (0.36087, _force)}, 130.0),
    Scene("hemisphere R 50, .2266 mm deep, slid 2 mm", _sphere(50.0),
          [{"depth_mm": 0.2266, "steps": PRESS}, {"depth_mm": 0.2266, "slide_x_mm": 2.0, "steps": 16}], 0.5, 0.9,
          {"largest tangential force, N": (0.237, _largest_pull),
           "normal force after the press, N": (0.502, lambda result: result.steps[PRESS - 1].normal_force_N)}, None),
    *(Scene(f"{name}, 2 N, slid 2 mm", shape, _slid(2.0, {"slide_x_mm": 2.0}, 16), 0.35, size,
            {"tangential force, N": (force, _pull)}, hours * HOUR)
      for name, (shape, size, force, hours) in TWO_N.items()),
    Scene("cylinder of 100 mm diameter, 4 N, slid 1.1 mm along its axis", {"shape": "cylinder", "radius_mm": 50.0},
          _slid(4.0, {"slide_z_mm": 1.1}, 11), 0.6, 1.1,
          {"depth, mm": (0.34, _depth), "tangential over normal force at .4 mm": (0.20, _ratio_at(0.4)),
           "tangential over normal force at 1.1 mm": (0.40, _ratio_at(1.1)),
           "share of the points that slide": (1.0 / 3.0, _sliding)}, 12.0 * HOUR),
    Scene("plane, 5 N, slid 1 mm", {"shape": "plane"}, _slid(5.0, {"slide_x_mm": 1.0}, 10), 0.45, 1.2,
          {"depth, mm": (0.093, _depth), "tangential force, N": (2.15, _pull),
           "share of the points that slide": (1488.0 / 4080.0, _sliding)}, 12.0 * HOUR),
)  # fmt: skip
KRATOS_FORCES = (0.397, 0.466, 0.500)


def _kratos(coarser: float) -> dict[str, Any]:
    return {
        "finger": {"geometry": "block", "half_length_mm": 5.0, "height_mm": 5.0, "width_mm": 1.0},
        "material": {"E_MPa": 1.0, "nu": 0.49},
        "object": {"shape": "cylinder", "radius_mm": 2.0},
        "press": {"depth_mm": 0.5, "steps": 8},
        "model": {"domain": "plane-strain"},
        "mesh": {"size_mm": 0.1 * coarser},
    }


def run(quick: bool) -> Result:
    """Quick: the ball, the plane and the section, on edges twice as long."""
    coarser = 2.0 if quick else 1.0
    scenes = [SCENES[0], SCENES[-1]] if quick else SCENES
    rows, lines, curves, times = list[Row](), [], {}, []
    for scene in scenes:
        began = time.perf_counter()
        result = press(scene.tables(coarser), figures=False)
        seconds = time.perf_counter() - began
        times.append((scene.name, seconds, scene.seconds_there))
        curves[scene.name] = [(step.slide_x_mm, step.force_x_N) for step in result.steps]
        for what, (theirs, read) in scene.numbers.items():
            here = read(result)
            rows.append(_beside(scene, what, theirs, here))
            lines.append((scene.name, what, theirs, here, _bar(result, what), seconds, scene.seconds_there or np.nan))
        residual = max(step.residual or 0.0 for step in result.steps)
        rows.append(at_most(f"largest residual, {scene.name}", "Eqs. 1 to 4", 1e-8, residual))
    rows.append(_kratos_row(coarser))
    names = "scene number theirs here bar seconds_here seconds_there"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, times, curves))


def _beside(scene: Scene, what: str, theirs: float, here: float) -> Row:
    reason = "the authors' own bound, 9 %, and what is read off a figure"
    return Row(f"{what}: {scene.name}", scene.source, theirs, here, THEIRS, reason, "statement")


def _bar(result: PressResult, what: str) -> float:
    """Return the error bar of a force or a depth at the end; NaN of other numbers."""
    key = {"normal force, N": "normal_force_N", "tangential force, N": "force_x_N", "depth, mm": "depth_mm"}.get(what)
    estimate = result.summary()["error_estimate"] or {}
    parts = [(estimate.get(part) or {}).get(key, np.nan) for part in ("discretisation", "steps")]
    return float(np.nansum(parts)) if key and not np.isnan(parts[0]) else np.nan


def _kratos_row(coarser: float) -> Row:
    """Where a force converges that rises from mesh to mesh there."""
    force = press(_kratos(coarser), figures=False).last.normal_force_N
    return Row("normal force of a half cylinder R 2 on a section, N per mm: the finest of three meshes, which rise "
               "by 17 and 7 %", KRATOS, KRATOS_FORCES[-1], force, 0.1, "E and R are inferred", "statement")  # fmt: skip


def _draw(figure: Any, times: list[tuple[str, float, float | None]], curves: dict[str, Any]) -> None:
    figure.set_size_inches(11.0, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    known = [(name, here, there) for name, here, there in times if there]
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
    name = SCENES[-1].name
    slide, pull = np.abs(curves[name]).T
    right.plot(slide, pull, "o-", color="#2166ac", ms=4, label="finger3d")
    right.axhline(2.15, color="#888888", ls="--", label="ANSYS at 1 mm, 2.15 N")
    right.axhline(0.45 * 5.0, color="#222222", lw=0.8, label="mu N")
    right.set(xlabel="slide (mm)", ylabel="tangential force (N)", ylim=(0.0, 2.6))
    right.set_title("a plane with 5 N slides over the gel")
    right.legend(frameon=False, fontsize=8, loc="lower right")
