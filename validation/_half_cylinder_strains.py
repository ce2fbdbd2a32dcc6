"""How do the strains inside the half cylinder change with the depth, with friction and with its kinetic coefficient?

Source: Maeno 2004, Figs. 5, 7 and 8 and Sec. II-B: R = 5 mm, E = 1 MPa, pressed 1 mm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.contact.friction import Branch, TwoCoefficients

from ._paper import (
    BELOW_R5,
    CASES,
    MUS,
    NAMES_SHOWN,
    SHOWN,
    STRAIN,
    STRESS,
    Profile,
    by_mu,
    draw_grid,
    draw_shown,
    half_cylinder,
    line_r5,
    pressed,
    said,
    strains,
)
from ._press import under
from ._rows import Result, Row, columns, together

NAMES = ("eps_x", "eps_y", "gamma_xy")


def _depths(quick: bool) -> Result:
    """As the finger is pressed, does the shear strain inside it change while the normal strains do not noticeably?

    Source: Maeno 2004, Fig. 5 and Sec. II-B: R = 5 mm, mu = 0.25, plane stress: "the distribution of the shear
    strain changes as a function of the change in the tangential contact force, whereas the distribution of normal
    strains do not change noticeably". Taken literally: the largest change along the line of nodes between 0.2 and 1
    mm of each normal strain is compared with that of the shear. All strains grow with the depth, so the shapes are
    judged as well: every profile is divided by its own largest value. The paper does not give the depth of the
    line; half and twice the depth assumed here are in the table.

    Strains along lines under the surface at every increment.
    """
    size, count = (0.2, 15) if quick else (0.05, 45)
    found, lines, rows = {}, [], []
    for below in (BELOW_R5,) if quick else (BELOW_R5 / 2.0, BELOW_R5, 2.0 * BELOW_R5):
        x, gauges = line_r5(below, count)
        for plane, nu in CASES:
            frames = pressed(half_cylinder(nu, plane, size, gauges), 0.25, 10)
            found[below, plane, nu] = np.array([strains(f, count) for f in frames])
            for frame, values in list(zip(frames, found[below, plane, nu], strict=True))[1::2]:
                points, depth = zip(x, *values, strict=True), frame.target.depth_mm
                lines += [(plane, nu, below, depth, *map(float, point)) for point in points]
    x, _ = line_r5(BELOW_R5, count)
    for plane, nu in SHOWN:
        rows += statements_depths(f"{plane}, nu = {nu:g}", *found[BELOW_R5, plane, nu][[1, -1]])
    table = columns("plane nu below_mm depth_mm x_mm eps_x eps_y gamma_xy", lines)
    shown = {k[1:]: v for k, v in found.items() if k[0] == BELOW_R5}
    return Result(tuple(rows), table, lambda figure: _draw_depths(figure, x, shown))


def statements_depths(here: str, early: np.ndarray, last: np.ndarray) -> Iterator[Row]:
    """What Sec. II-B says of the strains (3, n) at a fifth of the depth and at full depth."""
    change = np.abs(last - early).max(axis=1)
    shape = np.abs(_normalised(last) - _normalised(early)).max(axis=1)
    for k in (0, 1):
        yield said("little-with-depth", change[k] / change[2], name=NAMES[k], here=here)
        yield said("keeps-its-shape", shape[k] / shape[2], name=NAMES[k], here=here)


def _normalised(strain: np.ndarray) -> np.ndarray:
    return np.asarray(strain / np.abs(strain).max(axis=1, keepdims=True))


def _draw_depths(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.suptitle(f"Strains {BELOW_R5:g} mm under the surface, mu = .25")
    shown = range(1, 10, 2)
    curves = {case: {f"{0.1 * (i + 1):.1f} mm": (x, *found[case][i]) for i in shown} for case in SHOWN}
    draw_shown(figure, NAMES, "depth", curves)


JUDGED_MUS = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))


def _mus(quick: bool) -> Result:
    """Which strain in the half cylinder tells the friction coefficient: the shear near the edge, or eps_x in the
    middle?

    Source: Maeno 2004, Fig. 7 and Sec. II-B: R = 5 mm, 1 mm, plane stress, mu = .06 to 1: all strains change with
    mu; "the changes in tangential strain eps_x are not large"; "the shear strain near the slip area should be used
    ... rather than the tangential strain". Shinoda used eps_x at x = 0: the shear is to change more than this, a
    ratio below 1. The line's depth is not told; half and twice it are in the table and in the counts.

    Strains along lines under the surface for five coefficients.
    """
    size, count = (0.2, 15) if quick else (0.05, 45)
    depths = (BELOW_R5,) if quick else (BELOW_R5 / 2.0, BELOW_R5, 2.0 * BELOW_R5)
    along = {below: line_r5(below, count) for below in depths}
    gauges = [replace(g, name=f"{below} {g.name}") for below, (_, own) in along.items() for g in own]
    found, half, lines = {}, {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size, gauges)
        for mu in MUS:
            frame = pressed(problem, mu)[-1]
            half[plane, nu] = Profile.of(problem, frame).a
            for below, (x, _) in along.items():
                key = (below, plane, nu, mu)
                found[key] = strains(frame, count, f"{below} ")
                lines += [(plane, nu, below, mu, *map(float, point)) for point in zip(x, *found[key], strict=True)]
    x, _ = line_r5(BELOW_R5, count)
    rows = []
    for plane, nu in JUDGED_MUS:
        values = np.array([found[BELOW_R5, plane, nu, mu] for mu in MUS])
        here = f"{plane}, nu = {nu:g}"
        rows += statements_mus(here, x, values, half[plane, nu])
    rows += _on_all_lines(found)
    table = columns("plane nu below_mm mu x_mm eps_x eps_y gamma_xy", lines)
    shown = {k[1:]: v for k, v in found.items() if k[0] == BELOW_R5}
    return Result(tuple(rows), table, lambda figure: _draw_mus(figure, x, shown))


def statements_mus(here: str, x: np.ndarray, values: np.ndarray, a: float) -> list[Row]:
    """What Sec. II-B says of the strains (mus, 3, n) along x (n,) under a contact of half-width a."""
    change = np.ptp(values, axis=0)
    middle, most = len(x) // 2, int(np.argmax(change[2]))
    return [
        said("shear-changes", change[2].max() / np.abs(values[:, 2]).max(), here=here),
        said("shear-more-than-eps-x", change[0][middle] / change[2].max(), here=here),
        said("shear-near-edge", abs(x[most]) / a, here=here),
    ]


def _on_all_lines(found: dict[Any, np.ndarray]) -> Iterator[Row]:
    """In how many combinations of line and Poisson's ratio the shear changes more than eps_x at x = 0."""
    bodies = dict.fromkeys(key[:3] for key in found)
    change = {body: np.ptp([found[(*body, mu)] for mu in MUS], axis=0) for body in bodies}
    more = {body: c[2].max() > c[0][c.shape[1] // 2] for body, c in change.items()}
    for plane in (STRESS, STRAIN):
        judged = [wins for (_, own, _), wins in more.items() if own == plane]
        yield said("shear-more-on-all-lines", sum(judged), len(judged), plane=plane)


def _draw_mus(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.suptitle(f"Strains {BELOW_R5:g} mm under the surface at 1 mm under five friction coefficients")
    curves = {case: by_mu((x, *found[*case, mu]) for mu in MUS) for case in SHOWN}
    draw_shown(figure, NAMES, "mu", curves)


JUDGED_KINETIC = ((STRESS, 0.3), (STRAIN, 0.49))
RATIOS = (1.0, 0.7, 0.5, 0.1)
BRANCHES: tuple[Branch, ...] = ("keep", "paper")


def _kinetic(quick: bool) -> Result:
    """Does a kinetic friction coefficient below the static one change the shear strain much?

    Source: Maeno 2004, Fig. 8 and Sec. II-B: R = 5 mm, 1 mm, static mu = 0.25, ratios 0.7, 0.5 and 0.1: "the shear
    strain does not vary greatly when the ratio is over 0.5"; the same for other static coefficients; "hence we can
    estimate the static friction coefficient ... when the ratio is larger than 0.5". The first statement is judged
    against the largest shear strain, as one would judge the figure; the conclusion against the change that mu from
    0.06 to 1 causes, which is the signal of a sensor. mu_k < mu_s needs a rule: `keep` (a slipping point keeps
    slipping at mu_k until its slip would reverse) and `paper` (every increment starts with all points sticking);
    the result of the second depends on the mesh and on the increments.

    Ratios and branches at mu = .25, and in the full run also at .125 and .5.
    """
    size, count = (0.2, 15) if quick else (0.05, 45)
    x, gauges = line_r5(count=count)
    found, lines, rows = {}, [], []
    for plane, nu in SHOWN:
        problem = half_cylinder(nu, plane, size, gauges)
        signal = np.ptp([strains(pressed(problem, mu)[-1], count)[2] for mu in MUS], axis=0).max()
        for static in (0.25,) if quick else (0.25, 0.125, 0.5):
            for branch in BRANCHES:
                for ratio in RATIOS:
                    frame = under(problem, TwoCoefficients(static, ratio, branch))[-1]
                    found[plane, nu, static, branch, ratio] = strains(frame, count)[2]
                    points = zip(x, found[plane, nu, static, branch, ratio], strict=True)
                    lines += [(plane, nu, static, branch, ratio, *map(float, point)) for point in points]
        if (plane, nu) in JUDGED_KINETIC:
            rows += _statements(plane, nu, found, signal)
    table = columns("plane nu mu_static branch ratio x_mm gamma_xy", lines)
    return Result(tuple(rows), table, lambda figure: _draw_kinetic(figure, x, found))


def _statements(plane: str, nu: float, found: dict[Any, np.ndarray], signal: float) -> list[Row]:
    rows = []
    statics = sorted({k[2] for k in found if k[:2] == (plane, nu)})
    largest = np.abs(found[plane, nu, 0.25, "keep", 1.0]).max()
    for branch in BRANCHES:
        here = f"{plane}, nu = {nu:g}, branch {branch}"

        def change(ratio: float, static: float = 0.25, branch: str = branch) -> float:
            whole = found[plane, nu, static, branch, 1.0]
            return float(np.abs(found[plane, nu, static, branch, ratio] - whole).max())

        rows.append(said("kinetic-half", max(change(0.7), change(0.5)) / largest, here=here))
        rows.append(said("kinetic-tenth", change(0.1) / largest, here=here))
        if len(statics) > 1:
            worst = max(change(0.5, s) for s in statics if s != 0.25)
            rows.append(said("kinetic-other-mu", worst / largest, here=here))
        rows.append(said("kinetic-told", change(0.5) / signal, here=here))
    return rows


def _draw_kinetic(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.suptitle("Shear strain .5 mm under the surface at 1 mm, static mu = .25; rows: the rule for mu_k < mu_s")
    rows = []
    for rule in BRANCHES:
        cells = [{f"{ratio:g}": (x, found[*case, 0.25, rule, ratio]) for ratio in RATIOS} for case in SHOWN]
        rows.append((f"gamma_xy, {rule}", "x (mm)", "mu_k / mu_s", cells))
    draw_grid(figure, NAMES_SHOWN, rows)


def run(quick: bool) -> Result:
    """Strains over the depth, over mu, and with a kinetic coefficient."""
    return together((12.0, 22.4), depths=_depths(quick), mus=_mus(quick), kinetic=_kinetic(quick))
