"""Is an increment of .1 mm small enough, so that smaller ones change the results little?

Source: Maeno 2004, Sec. II-A: "the value 0.1 was small enough for our model because the change in result was
sufficiently small even when the increment value was made smaller".  The half cylinder under 1 mm, mu = .25, in 1 to 320
plain increments, as the paper made them; each result against the exact path from event to event, which has no
increments, and the rate at which the error of the dissipation falls (1 or more: friction is taken under
the mean normal force of an increment).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.history import StepResult

from ._exact_path import exact_press
from ._increments import PlainCoulomb
from ._paper import STRAIN, STRESS, Profile, half_cylinder, line_r5, said, strains
from ._press import changed, under
from ._rows import Result, Row, at_least, columns

CASES = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.49))
COUNTS = (1, 2, 5, 10, 20, 40, 80, 160, 320)
PATH = 0
"""Stands for the path among numbers of increments."""
NAMES = ("normal force", "sum of |f_t|", "stick half-width", "dissipation", "largest gamma_xy")


def run(quick: bool) -> Result:
    """One condensation for each case."""
    size, most = (0.2, 80) if quick else (0.05, 320)
    counts = [n for n in COUNTS if n <= most]
    x, gauges = line_r5(count=21)
    found, lines, rows = {}, [], []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size, gauges)
        for count in (PATH, *counts):
            frame = under(problem, PlainCoulomb(0.25), count)[-1] if count else _exact(problem)
            profile = Profile.of(problem, frame)
            friction = float(np.abs(profile.q) @ profile.area)
            shear = float(np.abs(strains(frame, len(x))[2]).max())
            found[plane, nu, count] = np.array([profile.force, friction, profile.c, frame.dissipation_mJ, shear])
            size_mm = 1.0 / count if count else 0.0
            lines.append((plane, nu, count, size_mm, *map(float, found[plane, nu, count])))
        rows += _statements(plane, nu, found, counts)
    names = "plane nu increments increment_mm force_N_per_mm friction_sum_N_per_mm c_mm dissipation_mJ_per_mm gamma_xy"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, found, counts))


def _exact(problem: Problem) -> StepResult:
    """The end of the exact path."""
    legs = tuple(replace(leg, steps=1) for leg in problem.model.legs)
    return exact_press(changed(problem, friction=Coulomb(0.25), legs=legs))[-1]


def _statements(plane: str, nu: float, found: dict[Any, np.ndarray], counts: list[int]) -> list[Row]:
    here = f"{plane}, nu = {nu:g}"
    off = {n: np.abs(found[plane, nu, n] / found[plane, nu, PATH] - 1.0) for n in counts}
    rows = [
        said(
            f".1 mm is small enough for the {NAMES[k]}: change by smaller increments, relative, {here}", "Sec. II-A",
            0.02, off[10][k], "2 % would be called small", 0.0, "at most",
        )
        for k in (0, 1, 3, 4)
    ]  # fmt: skip
    rate = float(np.log(off[5][3] / off[counts[-1]][3]) / np.log(counts[-1] / 5))
    what = f"rate at which the dissipation settles, 5 to {counts[-1]} increments, {here}"
    reason = "about 1; c moves from point to point"
    return [*rows, at_least(what, "first order at least", 0.8, rate, reason, "sensitivity")]


def _draw(figure: Any, found: dict[Any, np.ndarray], counts: list[int]) -> None:
    figure.set_size_inches(13.0, 4.8)
    panels = figure.subplots(1, 4, sharey=True)
    figure.suptitle("Error of plain increments against the path; dotted line: the paper's .1 mm")
    for axes, (plane, nu) in zip(panels, CASES, strict=True):
        last = found[plane, nu, PATH]
        for k, name in enumerate(NAMES):
            error = [100 * abs(found[plane, nu, n][k] / last[k] - 1.0) for n in counts]
            axes.loglog([1.0 / n for n in counts], np.maximum(error, 1e-4), "o-", ms=3, color=f"C{k}", label=name)
        axes.axvline(0.1, color="#999999", ls=":", lw=1)
        axes.set(xlabel="increment (mm)", title=f"{plane}, nu = {nu:g}", ylim=(1e-3, 1e4))
    panels[0].set_ylabel("error (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(NAMES), frameon=False)
