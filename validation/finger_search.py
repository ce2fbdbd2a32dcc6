"""Which radius R, edge height H and gauge make the finger most sensitive to friction: R = 100, H = 36.6 mm, 30 degrees?

Source: Maeno 2004, Sec. III-B.  Fingers are judged by their shear strain in plane strain, as the paper may have done;
then by their best gauge, also as solids 20 mm wide.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d._types import Float

from ._paper import BELOW_FIG9, INCREMENTS, MUS, STRAIN, Profile, fig9, line, pressed, said, strains
from ._press import fig9_finger, under
from ._rows import Result, Row, at_most, columns, together

RADII = (60.0, 80.0, 100.0, 150.0, 200.0, 300.0)
EDGES = (15.0, 25.0, 36.6, 50.0, 60.0)
NUS = (0.45, 0.49)
CHOSEN = (100.0, 36.6)


def _shear(quick: bool) -> Result:
    """Over radius R and edge height H, is R = 100, H = 36.6 mm the finger most sensitive to friction over a large
    range?

    Source: Maeno 2004, Sec. III: R and H were varied at 10 mm, plane strain; "a cylinder having a radius of 100 mm
    and an edge height of 36.6 mm was the most sensitive to changes in the friction coefficient throughout a large
    range". What was maximised is not told. Here it is the smallest change of gamma_xy from one mu to the next of
    .06, .125, .25, .5, 1, at the place along the line where that is largest; the whole change from .06 to 1 is in
    the table. Length (100 mm) and the line's depth are kept. Flat and low fingers are strained most by 10 mm and
    touch along their whole length, so the choice is also judged among those that are at least as high and touch no
    farther than the paper's.

    A condensation for each R, H and nu; five coefficients each.
    """
    size, count = (4.0, 15) if quick else (1.0, 45)
    radii, edges, nus = (RADII[1:4], EDGES[1:4], NUS[1:]) if quick else (RADII, EDGES, NUS)
    x = np.linspace(4.0, 48.0, count)
    found, shape, lines = {}, {}, []
    for nu in nus:
        for radius in radii:
            for edge in edges:
                design = fig9_finger(1.0, radius, edge)
                problem = fig9(nu, size=size, gauges=line(x, design, BELOW_FIG9), radius=radius, edge=edge)
                frames = [pressed(problem, mu)[-1] for mu in MUS]
                shear = np.array([strains(f, count)[2] for f in frames])
                least = np.abs(np.diff(shear, axis=0)).min(axis=0)
                whole = np.ptp(shear, axis=0)
                found[nu, radius, edge] = (float(least.max()), float(whole.max()))
                at = (float(x[least.argmax()]), float(x[whole.argmax()]))
                reach = Profile.of(problem, frames[MUS.index(0.25)]).a
                shape[nu, radius, edge] = (design.height_mm, reach)
                lines.append((nu, radius, edge, design.height_mm, 2 * reach, least.max(), at[0], whole.max(), at[1]))
    sound = {k: v[0] >= 49.9 and v[1] <= size / 2 + shape[(k[0], *CHOSEN)][1] for k, v in shape.items()}
    rows = [row for nu in nus for row in _statements_shear(nu, found, sound)]
    names = "nu R_mm H_mm height_mm contact_mm least_change at_x_mm whole_change at_x_mm_whole"
    table = columns(names, [tuple(map(float, row)) for row in lines])
    return Result(tuple(rows), table, lambda figure: _draw_shear(figure, nus, radii, edges, found))


def _statements_shear(nu: float, found: dict[Any, tuple[float, float]], sound: dict[Any, bool]) -> Iterator[Row]:
    for among, chosen in (("", found), (" of those as high that touch no farther", sound)):
        here = {k[1:]: found[k] for k, kept in chosen.items() if k[0] == nu and kept}
        for k, what in ((0, "smallest change from mu to mu"), (1, "change from mu = .06 to 1")):
            best = max(here, key=lambda case: here[case][k])
            share, words = found[(nu, *CHOSEN)][k] / here[best][k], {"radius": best[0], "edge": best[1], "nu": nu}
            yield said("finger-by-shear", share, what=what, among=among, **words)


def _draw_shear(figure: Any, nus: Any, radii: Any, edges: Any, found: dict[Any, tuple[float, float]]) -> None:
    panels = figure.subplots(len(nus), 2, squeeze=False)
    for row, nu in enumerate(nus):
        for k, what in enumerate(("smallest change of gamma_xy from mu to mu", "change of gamma_xy, mu = .06 to 1")):
            values = np.array([[found[nu, r, h][k] for r in radii] for h in edges])
            _draw_map(panels[row, k], radii, edges, values)
            panels[row, k].set_title(f"{what}, nu = {nu:g}")
    figure.suptitle("Sensitivity to friction at 10 mm, plane strain; framed: the paper's choice")


def _draw_map(axes: Any, radii: Any, edges: Any, values: Float, texts: Any = None, label: str = "") -> None:
    """Draw values (H, R) of fingers with a text in every cell, and a frame around the paper's finger."""
    from matplotlib.patches import Rectangle

    picture = axes.imshow(values, origin="lower", aspect="auto", cmap="viridis")
    for (i, j), value in np.ndenumerate(values):
        told = f"{value:.3f}" + (f"\n{texts[i][j]}" if texts else "")
        colour = "w" if value < 0.6 * values.max() else "k"
        axes.text(j, i, told, ha="center", va="center", fontsize=9, color=colour)
    corner = list(radii).index(CHOSEN[0]) - 0.5, list(edges).index(CHOSEN[1]) - 0.5
    axes.add_patch(Rectangle(corner, 1.0, 1.0, fill=False, edgecolor="#e74c3c", lw=2.5))
    axes.set_xticks(range(len(radii)), [f"{r:g}" for r in radii])
    axes.set_yticks(range(len(edges)), [f"{h:g}" for h in edges])
    axes.set(xlabel="R (mm)", ylabel="H (mm)")
    axes.figure.colorbar(picture, ax=axes, label=label)


NU = 0.49
DOMAINS = {STRAIN: "plane strain", "solid": "20 mm wide"}
GAUGE = (36.0, 30.0)
ANGLES = np.arange(0.0, 91.0, 5.0)
SIZES = {STRAIN: 1.0, "solid": 2.0}
STEPS = {STRAIN: (INCREMENTS, INCREMENTS // 2), "solid": (80, 40)}  # increments; half as many give the error
OTHERS = {STRAIN: (0.5, 2.0), "solid": (1.5, 3.0)}
RANGES = {"mu = .06 to 1": len(MUS), "mu = .06 to .5": MUS.index(0.5) + 1}
_HEIGHT = 49.9  # mm, the paper's finger is 50 mm high


@dataclass(frozen=True)
class Judged:
    """A finger in one domain: sensitivity (angles, x) by range, strain per mu; height and contact half length (mm).

    `error` (angles, x) by range is that of the strain by the increments.
    """

    value: dict[str, Float]
    height: float
    reach: float
    error: dict[str, Float]

    def best(self, x: Float, over: str) -> tuple[float, float, float]:
        """Largest sensitivity, and the gauge that has it: x (mm), angle (degrees)."""
        value = self.value[over]
        i, j = np.unravel_index(int(value.argmax()), value.shape)
        return float(value[i, j]), float(x[j]), float(ANGLES[i])


def judged(plane: str, radius: float, edge: float, x: Float, size: float, quick: bool = False) -> Judged:
    """Condense a finger once, press it at every mu, read every gauge."""
    design = fig9_finger(1.0, radius, edge)
    gauges = line(x, design, BELOW_FIG9)
    problem = fig9(NU, plane, size, gauges, radius=radius, edge=edge)
    counts = STEPS[plane] if not quick else (10, 5)
    ends, half = ([under(problem, mu, n)[-1] for mu in MUS] for n in counts)
    along = _along(ends, len(x))
    left = np.abs(along - _along(half, len(x)))
    slope = np.diff(along, axis=0) / np.diff(MUS)[:, None, None]
    value = {over: (slope[: n - 1] * np.sign(along[n - 1] - along[0])).min(axis=0) for over, n in RANGES.items()}
    error = {over: left[:n].max(axis=0) for over, n in RANGES.items()}
    return Judged(value, design.height_mm, Profile.of(problem, ends[MUS.index(0.25)]).a, error)


def _along(ends: list[Any], count: int) -> Float:
    """Strain (mu, angle, x) along every direction."""
    e = np.array([strains(end, count) for end in ends])
    t = np.deg2rad(ANGLES)[:, None]
    return np.asarray(
        e[:, 0, None] * np.cos(t) ** 2 + e[:, 1, None] * np.sin(t) ** 2 + e[:, 2, None] * np.sin(t) * np.cos(t)
    )


def _gauges(quick: bool) -> Result:
    """Does the best finger for friction, by radius R, edge height H, gauge place x and angle, change in 20 mm of
    width?

    Source: Maeno 2004, Sec. III-B: R = 100, H = 36.6 mm, a gauge at x = 36 mm and 30 degrees, chosen in plane
    strain at 10 mm to be sensitive to friction throughout a large range. The criterion is that of `finger3d
    optimise`: the least change of strain per mu between neighbours of .06, .125, .25, .5, 1, negative where the
    strain turns back; and the same up to .5 only. Every finger is judged at its best gauge, 4 to 48 mm from the
    middle along the line of _paper.py, 0 to 90 degrees, at z = 0. The table has the paper's finger on a finer and a
    coarser mesh as well. The first part judges the same fingers by their shear strain, in plane strain.

    A condensation for each R and H, in plane strain and as a solid.
    """
    x = np.linspace(4.0, 48.0, 12 if quick else 45)
    radii, edges = ((80.0, 100.0), (25.0, 36.6)) if quick else (RADII, EDGES)
    found, lines = {}, []
    for plane, name in DOMAINS.items():
        size = SIZES[plane] * (3.0 if quick else 1.0)
        for radius in radii:
            for edge in edges:
                found[plane, radius, edge] = finger = judged(plane, radius, edge, x, size, quick)
                lines.append((name, size, radius, edge, *_numbers(finger, x)))
        for other in () if quick else OTHERS[plane]:
            lines.append((name, other, *CHOSEN, *_numbers(judged(plane, *CHOSEN, x, other), x)))
    names = "domain mesh_mm R_mm H_mm height_mm contact_mm"
    names += " per_mu_to_1 x_mm_to_1 angle_deg_to_1 per_mu_to_half x_mm_to_half angle_deg_to_half"
    rows = [row for plane in DOMAINS for over in RANGES for row in _statements_gauges(plane, over, found, x)]
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_gauges(figure, radii, edges, found, x))


def _numbers(finger: Judged, x: Float) -> list[float]:
    return [finger.height, 2.0 * finger.reach, *(v for over in RANGES for v in finger.best(x, over))]


def _sound(plane: str, found: dict[Any, Judged]) -> dict[Any, Judged]:
    """Fingers as high as the paper's that touch no farther than it: flat and low ones are merely strained more."""
    reach = found[(plane, *CHOSEN)].reach
    return {k[1:]: f for k, f in found.items() if k[0] == plane and f.height >= _HEIGHT and f.reach <= reach + 1.0}


def _statements_gauges(plane: str, over: str, found: dict[Any, Judged], x: Float) -> Iterator[Row]:
    where, own = f"{DOMAINS[plane]}, {over}", found[(plane, *CHOSEN)]
    for among, here in (
        ("", {k[1:]: f for k, f in found.items() if k[0] == plane}),
        (" of those as high that touch no farther", _sound(plane, found)),
    ):
        best = max(here, key=lambda k: here[k].best(x, over)[0])
        share = own.best(x, over)[0] / here[best].best(x, over)[0]
        yield said("finger-by-gauge", share, here=where, among=among, radius=best[0], edge=best[1])
    value, at, angle = own.best(x, over)
    i, j = int(np.argmin(abs(ANGLES - GAUGE[1]))), int(np.argmin(abs(x - GAUGE[0])))
    yield said("gauge-at-36", own.value[over][i, j] / value, here=where, x=at, angle=angle)
    error, step = own.error[over].ravel()[own.value[over].argmax()], np.diff(MUS).min()
    text = f"error of the strain by the increments at the best gauge, {where}, over the least change from mu to mu"
    yield at_most(text, "half as many increments", 0.3, float(error / (abs(value) * step)),
                  "the least change may be small", "statement")  # fmt: skip


def _draw_gauges(figure: Any, radii: Any, edges: Any, found: dict[Any, Judged], x: Float) -> None:
    panels = figure.subplots(3, 2).T
    whole, half = RANGES
    for row, (plane, name) in enumerate(DOMAINS.items()):
        best = [[found[plane, r, h].best(x, half) for r in radii] for h in edges]
        values = np.array([[value for value, _, _ in own] for own in best])
        gauges = [[f"{at:.0f} mm, {angle:.0f}°" for _, at, angle in own] for own in best]
        _draw_map(panels[row, 0], radii, edges, values, gauges, "least |d strain / d mu|")
        panels[row, 0].set_title(f"{name}, {half}: each finger's best gauge")
        for k, over in enumerate((half, whole), start=1):
            _gauge_map(figure, panels[row, k], found[(plane, *CHOSEN)], x, name, over)
    figure.suptitle(f"Sensitivity to friction, nu = {NU:g}, 10 mm deep; red: the paper's choice")


def _gauge_map(figure: Any, axes: Any, finger: Judged, x: Float, name: str, over: str) -> None:
    value = finger.value[over]
    largest = float(abs(value).max())
    picture = axes.pcolormesh(x, ANGLES, value, cmap="RdBu", vmin=-largest, vmax=largest, shading="nearest")
    _, at, angle = finger.best(x, over)
    axes.plot(at, angle, "k*", ms=13, label=f"best, x = {at:.0f} mm, {angle:.0f}°")
    axes.plot(*GAUGE, "s", ms=10, mfc="none", mec="#e74c3c", mew=2.5, label="the paper's, 36 mm, 30°")
    axes.set(xlabel="x of the gauge (mm)", ylabel="angle (degrees)", title=f"{name}, {over}: R = 100, H = 36.6")
    axes.legend(loc="lower left")
    figure.colorbar(picture, ax=axes, label="least d strain / d mu; < 0: turns back")


def run(quick: bool) -> Result:
    """Fingers by their shear strain, then by their best gauge."""
    return together((13.0, 8.0, 12.0), shear=_shear(quick), gauges=_gauges(quick))
