"""Which strain in the half cylinder tells the friction coefficient: the shear near the edge, or eps_x in the middle?

Source: Maeno 2004, Fig. 7 and Sec. II-B: R = 5 mm, 1 mm, plane stress, mu = .06 to 1: all strains change with mu; "the
changes in tangential strain eps_x are not large"; "the shear strain near the slip area should be used ... rather than
the tangential strain".  Shinoda used eps_x at x = 0: the shear is to change more than this, a ratio below 1.  The
line's depth is not told; half and twice it are in the table and in the counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ._paper import BELOW_R5, MUS, STRAIN, STRESS, Profile, half_cylinder, line_r5, said, strains
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
DRAWN = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))
NAMES = ("eps_x", "eps_y", "gamma_xy")


def run(quick: bool) -> Result:
    """Strains along lines under the surface for five coefficients."""
    size, count = (0.2, 15) if quick else (0.05, 45)
    depths = (BELOW_R5,) if quick else (BELOW_R5 / 2.0, BELOW_R5, 2.0 * BELOW_R5)
    along = {below: line_r5(below, count) for below in depths}
    gauges = [replace(g, name=f"{below} {g.name}") for below, (_, own) in along.items() for g in own]
    found, half, lines = {}, {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size, gauges)
        for mu in MUS:
            frame = under(problem, mu, 1)[-1]
            half[plane, nu] = Profile.of(problem, frame).a
            for below, (x, _) in along.items():
                key = (below, plane, nu, mu)
                found[key] = strains(frame, count, f"{below} ")
                lines += [(plane, nu, below, mu, *map(float, point)) for point in zip(x, *found[key], strict=True)]
    x, _ = line_r5(BELOW_R5, count)
    rows = []
    for plane, nu in JUDGED:
        values = np.array([found[BELOW_R5, plane, nu, mu] for mu in MUS])
        here = f"{plane}, nu = {nu:g}"
        rows += statements(here, x, values, half[plane, nu])
    rows += _on_all_lines(found)
    table = columns("plane nu below_mm mu x_mm eps_x eps_y gamma_xy", lines)
    shown = {k[1:]: v for k, v in found.items() if k[0] == BELOW_R5}
    return Result(tuple(rows), table, lambda figure: _draw(figure, x, shown))


def statements(here: str, x: np.ndarray, values: np.ndarray, a: float) -> list[Row]:
    """What Sec. II-B says of the strains (mus, 3, n) along x (n,) under a contact of half-width a."""
    change = np.ptp(values, axis=0)
    middle, most = len(x) // 2, int(np.argmax(change[2]))
    return [
        said(
            f"gamma_xy changes with mu: its largest change over its largest value, {here}", "Fig. 7", 0.05,
            change[2].max() / np.abs(values[:, 2]).max(), "5 % would be seen in a figure", 0.0, "at least",
        ),
        said(
            f"gamma_xy changes more than eps_x at x = 0: change of eps_x over the largest of gamma_xy, {here}",
            "Fig. 7", 1.0, change[0][middle] / change[2].max(), "more", 0.0, "at most",
        ),
        said(
            f"gamma_xy changes most near the edge: |x|/a of its largest change, {here}", "Fig. 7", 0.5,
            abs(x[most]) / a, "the outer half of the contact", 0.0, "at least",
        ),
    ]  # fmt: skip


def _on_all_lines(found: dict[Any, np.ndarray]) -> Iterator[Row]:
    """In how many combinations of line and Poisson's ratio the shear changes more than eps_x at x = 0."""
    bodies = dict.fromkeys(key[:3] for key in found)
    change = {body: np.ptp([found[(*body, mu)] for mu in MUS], axis=0) for body in bodies}
    more = {body: c[2].max() > c[0][c.shape[1] // 2] for body, c in change.items()}
    for plane in (STRESS, STRAIN):
        judged = [wins for (_, own, _), wins in more.items() if own == plane]
        what = f"gamma_xy changes more than eps_x at x = 0: of {len(judged)} combinations of line and nu, {plane}"
        yield said(what, "Fig. 7", len(judged), sum(judged), "in all of them", 0.0, "at least")


def _draw(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    from matplotlib import colormaps

    figure.set_size_inches(12.0, 8.0)
    panels = figure.subplots(3, 3, sharex=True, sharey="row")
    figure.suptitle(f"Strains {BELOW_R5:g} mm under the surface at 1 mm under five friction coefficients")
    for column, (plane, nu) in enumerate(DRAWN):
        for row in range(3):
            for i, mu in enumerate(MUS):
                colour = colormaps["plasma"](0.85 * i / 4)
                panels[row, column].plot(x, found[plane, nu, mu][row], color=colour, label=f"{mu:g}")
            panels[row, column].axhline(0.0, color="#999999", lw=0.7)
            panels[row, 0].set_ylabel(NAMES[row])
        panels[0, column].set_title(f"{plane}, nu = {nu:g}")
        panels[2, column].set_xlabel("x (mm)")
    panels[1, 0].legend(title="mu", frameon=False)
