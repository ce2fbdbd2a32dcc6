"""As the finger is pressed, does the shear strain inside it change while the normal strains do not noticeably?

Source: Maeno 2004, Fig. 5 and Sec. II-B: R = 5 mm, mu = 0.25, plane stress: "the distribution of the shear strain
changes as a function of the change in the tangential contact force, whereas the distribution of normal strains do not
change noticeably".  Taken literally: the largest change along the line of nodes between 0.2 and 1 mm of each normal
strain is compared with that of the shear.  All strains grow with the depth, so the shapes are judged as well: every
profile is divided by its own largest value.  The paper does not give the depth of the line; half and twice the depth
assumed here are in the table.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ._paper import BELOW_R5, STRAIN, STRESS, half_cylinder, line_r5, said, strains
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))
NAMES = ("eps_x", "eps_y", "gamma_xy")


def run(quick: bool) -> Result:
    """Strains along lines under the surface at every increment."""
    size, count = (0.2, 15) if quick else (0.05, 45)
    found, lines, rows = {}, [], []
    for below in (BELOW_R5,) if quick else (BELOW_R5 / 2.0, BELOW_R5, 2.0 * BELOW_R5):
        x, gauges = line_r5(below, count)
        for plane, nu in CASES:
            frames = under(half_cylinder(nu, plane, size, gauges), 0.25)
            found[below, plane, nu] = np.array([strains(f, count) for f in frames])
            for frame, values in list(zip(frames, found[below, plane, nu], strict=True))[1::2]:
                points, depth = zip(x, *values, strict=True), frame.target.depth_mm
                lines += [(plane, nu, below, depth, *map(float, point)) for point in points]
    x, _ = line_r5(BELOW_R5, count)
    for plane, nu in JUDGED:
        rows += statements(f"{plane}, nu = {nu:g}", *found[BELOW_R5, plane, nu][[1, -1]])
    table = columns("plane nu below_mm depth_mm x_mm eps_x eps_y gamma_xy", lines)
    shown = {k[1:]: v for k, v in found.items() if k[0] == BELOW_R5}
    return Result(tuple(rows), table, lambda figure: _draw(figure, x, shown))


def statements(here: str, early: np.ndarray, last: np.ndarray) -> Iterator[Row]:
    """What Sec. II-B says of the strains (3, n) at a fifth of the depth and at full depth."""
    change = np.abs(last - early).max(axis=1)
    shape = np.abs(_normalised(last) - _normalised(early)).max(axis=1)
    reason = "a quarter would still be noticed"
    for k in (0, 1):
        what = f"{NAMES[k]} changes little with depth: largest change over that of gamma_xy, {here}"
        yield said(what, "Fig. 5", 0.25, change[k] / change[2], reason, 0.0, "at most")
        what = f"{NAMES[k]} keeps its shape: largest change of the normalised profile over that of gamma_xy, {here}"
        yield said(what, "Fig. 5", 0.25, shape[k] / shape[2], reason, 0.0, "at most")


def _normalised(strain: np.ndarray) -> np.ndarray:
    return np.asarray(strain / np.abs(strain).max(axis=1, keepdims=True))


def _draw(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    from matplotlib import colormaps

    figure.set_size_inches(12.0, 8.0)
    panels = figure.subplots(3, 3, sharex=True, sharey="row")
    figure.suptitle(f"Strains {BELOW_R5:g} mm under the surface, mu = .25")
    for column, (plane, nu) in enumerate(JUDGED):
        for row in range(3):
            for i in range(1, 10, 2):
                colour = colormaps["viridis"](0.9 * i / 9)
                panels[row, column].plot(x, found[plane, nu][i, row], color=colour, label=f"{0.1 * (i + 1):.1f} mm")
            panels[row, column].axhline(0.0, color="#999999", lw=0.7)
            panels[row, 0].set_ylabel(NAMES[row])
        panels[0, column].set_title(f"{plane}, nu = {nu:g}")
        panels[2, column].set_xlabel("x (mm)")
    panels[1, 0].legend(title="depth", frameon=False)
