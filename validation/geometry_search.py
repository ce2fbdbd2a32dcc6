"""Over radius R and edge height H, is R = 100, H = 36.6 mm the finger most sensitive to friction over a large range?

Source: Maeno 2004, Sec. III: R and H were varied at 10 mm, plane strain; "a cylinder having a radius of 100 mm and an
edge height of 36.6 mm was the most sensitive to changes in the friction coefficient throughout a large range".  What
was maximised is not told.  Here it is the smallest change of gamma_xy from one mu to the next of .06, .125, .25, .5, 1,
at the place along the line where that is largest; the whole change from .06 to 1 is in the table.  Length (100 mm) and
the line's depth are kept.  Flat and low fingers are strained most by 10 mm and touch along their whole length, so the
choice is also judged among those that are at least as high and touch no farther than the paper's.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ._paper import BELOW_FIG9, MUS, Profile, fig9, line, said, strains
from ._press import fig9_finger, under
from ._rows import Result, Row, columns

RADII = (60.0, 80.0, 100.0, 150.0, 200.0, 300.0)
EDGES = (15.0, 25.0, 36.6, 50.0, 60.0)
NUS = (0.45, 0.49)
CHOSEN = (100.0, 36.6)


def run(quick: bool) -> Result:
    """A condensation for each R, H and nu; five coefficients each."""
    size, count = (4.0, 15) if quick else (1.0, 45)
    radii, edges, nus = (RADII[1:4], EDGES[1:4], NUS[1:]) if quick else (RADII, EDGES, NUS)
    x = np.linspace(4.0, 48.0, count)
    found, shape, lines = {}, {}, []
    for nu in nus:
        for radius in radii:
            for edge in edges:
                design = fig9_finger(1.0, radius, edge)
                problem = fig9(nu, size=size, gauges=line(x, design, BELOW_FIG9), radius=radius, edge=edge)
                frames = [under(problem, mu, 1)[-1] for mu in MUS]
                shear = np.array([strains(f, count)[2] for f in frames])
                least = np.abs(np.diff(shear, axis=0)).min(axis=0)
                whole = np.ptp(shear, axis=0)
                found[nu, radius, edge] = (float(least.max()), float(whole.max()))
                at = (float(x[least.argmax()]), float(x[whole.argmax()]))
                reach = Profile.of(problem, frames[MUS.index(0.25)]).a
                shape[nu, radius, edge] = (design.height_mm, reach)
                lines.append((nu, radius, edge, design.height_mm, 2 * reach, least.max(), at[0], whole.max(), at[1]))
    sound = {k: v[0] >= 49.9 and v[1] <= size / 2 + shape[(k[0], *CHOSEN)][1] for k, v in shape.items()}
    rows = [row for nu in nus for row in _statements(nu, found, sound)]
    names = "nu R_mm H_mm height_mm contact_mm least_change at_x_mm whole_change at_x_mm_whole"
    table = columns(names, [tuple(map(float, row)) for row in lines])
    return Result(tuple(rows), table, lambda figure: _draw(figure, nus, radii, edges, found))


def _statements(nu: float, found: dict[Any, tuple[float, float]], sound: dict[Any, bool]) -> Iterator[Row]:
    for among, chosen in (("", found), (" of those as high that touch no farther", sound)):
        here = {k[1:]: found[k] for k, kept in chosen.items() if k[0] == nu and kept}
        for k, what in ((0, "smallest change from mu to mu"), (1, "change from mu = .06 to 1")):
            best = max(here, key=lambda case: here[case][k])
            against = f"over that of the best{among}, R = {best[0]:g}, H = {best[1]:g}, nu = {nu:g}"
            text = f"R = 100, H = 36.6 is the most sensitive: its {what} {against}"
            share = found[(nu, *CHOSEN)][k] / here[best][k]
            yield said(text, "Sec. III-B", 1.0, share, "within a tenth of the best", 0.1, "at least")


def _draw(figure: Any, nus: Any, radii: Any, edges: Any, found: dict[Any, tuple[float, float]]) -> None:
    figure.set_size_inches(12.0, 4.2 * len(nus))
    panels = figure.subplots(len(nus), 2, squeeze=False)
    for row, nu in enumerate(nus):
        for k, what in enumerate(("smallest change of gamma_xy from mu to mu", "change of gamma_xy, mu = .06 to 1")):
            axes = panels[row, k]
            values = np.array([[found[nu, r, h][k] for r in radii] for h in edges])
            picture = axes.imshow(values, origin="lower", aspect="auto", cmap="viridis")
            for i, j in np.ndindex(values.shape):
                colour = "w" if values[i, j] < 0.6 * values.max() else "k"
                axes.text(j, i, f"{values[i, j]:.3f}", ha="center", va="center", fontsize=9, color=colour)
            axes.add_patch(_frame(radii.index(CHOSEN[0]), edges.index(CHOSEN[1])))
            axes.set_xticks(range(len(radii)), [f"{r:g}" for r in radii])
            axes.set_yticks(range(len(edges)), [f"{h:g}" for h in edges])
            axes.set(xlabel="R (mm)", ylabel="H (mm)", title=f"{what}, nu = {nu:g}")
            figure.colorbar(picture, ax=axes)
    figure.suptitle("Sensitivity to friction at 10 mm, plane strain; framed: the paper's choice")


def _frame(column: int, row: int) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, fill=False, edgecolor="#e74c3c", lw=2.5)
