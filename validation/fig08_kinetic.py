"""Does a kinetic friction coefficient below the static one change the shear strain much?

Source: Maeno 2004, Fig. 8 and Sec. II-B: R = 5 mm, 1 mm, static mu = 0.25, ratios 0.7, 0.5 and 0.1: "the shear strain
does not vary greatly when the ratio is over 0.5"; the same for other static coefficients; "hence we can estimate the
static friction coefficient ... when the ratio is larger than 0.5".  The first statement is judged against the largest
shear strain, as one would judge the figure; the conclusion against the change that mu from 0.06 to 1 causes, which is
the signal of a sensor.  mu_k < mu_s needs a rule: `keep` (a slipping point keeps slipping at mu_k until its slip would
reverse) and `paper` (every increment starts with all points sticking); the result of the second depends on the mesh and
on the increments.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.contact.friction import Branch, TwoCoefficients

from ._paper import MUS, STRAIN, STRESS, half_cylinder, line_r5, said, strains
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.3), (STRAIN, 0.49))
RATIOS = (1.0, 0.7, 0.5, 0.1)
BRANCHES: tuple[Branch, ...] = ("keep", "paper")


def run(quick: bool) -> Result:
    """Ratios and branches at mu = .25, and in the full run also at .125 and .5."""
    size, count = (0.2, 15) if quick else (0.05, 45)
    x, gauges = line_r5(count=count)
    found, lines, rows = {}, [], []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size, gauges)
        signal = np.ptp([strains(under(problem, mu)[-1], count)[2] for mu in MUS], axis=0).max()
        for static in (0.25,) if quick else (0.25, 0.125, 0.5):
            for branch in BRANCHES:
                for ratio in RATIOS:
                    frame = under(problem, TwoCoefficients(static, ratio, branch))[-1]
                    found[plane, nu, static, branch, ratio] = strains(frame, count)[2]
                    points = zip(x, found[plane, nu, static, branch, ratio], strict=True)
                    lines += [(plane, nu, static, branch, ratio, *map(float, point)) for point in points]
        if (plane, nu) in JUDGED:
            rows += _statements(plane, nu, found, signal)
    table = columns("plane nu mu_static branch ratio x_mm gamma_xy", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, x, found))


def _statements(plane: str, nu: float, found: dict[Any, np.ndarray], signal: float) -> list[Row]:
    rows = []
    statics = sorted({k[2] for k in found if k[:2] == (plane, nu)})
    largest = np.abs(found[plane, nu, 0.25, "keep", 1.0]).max()
    for branch in BRANCHES:
        here = f"{plane}, nu = {nu:g}, branch {branch}"

        def change(ratio: float, static: float = 0.25, branch: str = branch) -> float:
            whole = found[plane, nu, static, branch, 1.0]
            return float(np.abs(found[plane, nu, static, branch, ratio] - whole).max())

        close, far = max(change(0.7), change(0.5)), change(0.1)
        eye, tenth = "5 % would be seen in a figure", "a tenth of the signal"
        what = "change of gamma_xy over the largest gamma_xy"
        told = f"ratios .7 and .5 change little: {what}, {here}"
        rows.append(said(told, "Fig. 8", 0.05, close / largest, eye, 0.0, "at most"))
        rows.append(said(f"ratio .1 changes more: {what}, {here}", "Fig. 8", 0.05, far / largest, eye, 0.0, "at least"))
        if len(statics) > 1:
            worst = max(change(0.5, s) for s in statics if s != 0.25)
            said_of = f"the same at mu = .125 and .5: ratio .5, {what}, {here}"
            rows.append(said(said_of, "Sec. II-B", 0.05, worst / largest, eye, 0.0, "at most"))
        what = f"mu can be told at ratio .5: change of gamma_xy over that by mu = .06 to 1, {here}"
        rows.append(said(what, "Sec. II-B", 0.1, change(0.5) / signal, tenth, 0.0, "at most"))
    return rows


def _draw(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.set_size_inches(12.0, 6.4)
    panels = figure.subplots(2, 3, sharex=True, sharey="col")
    figure.suptitle("Shear strain .5 mm under the surface at 1 mm, static mu = .25; rows: the rule for mu_k < mu_s")
    for column, (plane, nu) in enumerate(CASES):
        for row, branch in enumerate(BRANCHES):
            axes = panels[row, column]
            for i, ratio in enumerate(RATIOS):
                axes.plot(x, found[plane, nu, 0.25, branch, ratio], color=f"C{i}", label=f"{ratio:g}", lw=1.2)
            axes.axhline(0.0, color="#999999", lw=0.7)
            axes.set_title(f"{plane}, nu = {nu:g}, branch {branch}")
            panels[row, 0].set_ylabel("gamma_xy")
        panels[1, column].set_xlabel("x (mm)")
    panels[0, 0].legend(title="mu_k / mu_s", frameon=False)
