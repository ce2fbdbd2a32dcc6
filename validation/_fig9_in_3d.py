"""What would a designer have concluded from the plane strain section, and what is true of the finger 20 mm wide?

Source: Maeno 2004; Sec. III computes plane strain, Sec. IV builds the finger 20 mm wide and presses it 10 mm.  The
statements about Figs. 10 to 12 are tested on the solid with free end faces, at nu = 0.45 and 0.49.  Like the paper, the
study uses small strain; large deformation changes the results by as much again.  The solid is pressed in 40
increments: in ten, f_t has a peak at the points that came into contact first in each of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure

from ._paper import (
    BELOW_FIG9,
    INCREMENTS,
    MUS,
    STRAIN,
    STRESS,
    Profile,
    draw_grid,
    fig9,
    line,
    rows_by_mu,
    said,
    strains,
)
from ._press import fig9_finger, under
from ._rows import Result, Row, columns, listed
from .fig9_strains import ANGLES, gauges, statements

judged = listed(__file__)

SOLID = "solid"
PLANES = (SOLID, STRAIN, STRESS)
STEPS = {SOLID: 40, STRAIN: INCREMENTS, STRESS: INCREMENTS}


def run(quick: bool) -> Result:
    """The solid on swept meshes, and both plane models at the same in-plane sizes."""
    size, count = (4.0, 13) if quick else (1.5, 25)
    nus = (0.49,) if quick else (0.45, 0.49)
    x = np.linspace(0.0, 48.0, count)
    shear, gauge, middle, numbers, lines = {}, {}, {}, {}, []
    for nu in nus:
        for plane in PLANES:
            problem = fig9(nu, plane, size, [*line(x, fig9_finger(), BELOW_FIG9), *gauges()])
            frames = [under(problem, mu, STEPS[plane])[-1] for mu in MUS]
            shear[plane, nu] = np.array([strains(f, count)[2] for f in frames])
            gauge[plane, nu] = {t: np.array([f.gauges[f"{BELOW_FIG9}:{t}"] for f in frames]) for t in ANGLES}
            middle[plane, nu] = [Profile.of(problem, f) for f in frames]
            told = [measure(problem.points, f) for f in frames]
            width = problem.model.design.width_mm
            numbers[plane, nu] = np.array([[m["normal_force_N"] / width, m["friction_sum_N"] / width] for m in told])
            for i, mu in enumerate(MUS):
                profile = middle[plane, nu][i]
                strain = [float(gauge[plane, nu][t][i]) for t in (15, 30, 45, 60)]
                zones = (2.0 * profile.a, 2.0 * profile.deformed, 2.0 * profile.c)
                lines.append((plane, nu, mu, *map(float, numbers[plane, nu][i]), *zones, *strain))
    rows: list[Row] = []
    for nu in nus:
        rows += _checks(nu, size, numbers)
        rows += _statements(nu, shear, gauge, middle, numbers)
    names = "model nu mu force_N_per_mm friction_sum_N_per_mm width_at_rest_mm width_deformed_mm stick_width_mm"
    table = columns(f"{names} gauge15 gauge30 gauge45 gauge60", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, x, nus[-1], shear, gauge, middle))


def _checks(nu: float, size: float, numbers: dict) -> list[Row]:
    """The solid's force on a coarser mesh, and with its end faces held."""
    coarse = fig9(nu, SOLID, 1.5 * size)
    held = fig9(nu, SOLID, size)
    held = build(replace(held.model, held_ends=True))
    found = [measure(p.points, under(p, 0.25, STEPS[SOLID])[-1])["normal_force_N"] / 20.0 for p in (coarse, held)]
    here = f"N per mm, mu = .25, nu = {nu:g}"
    return [
        judged("force-20-mm-wide-edges-of", found[0], numbers[SOLID, nu][2][0], value=1.5 * size, size=size, here=here),
        judged("force-20-mm-wide", found[1], numbers[STRAIN, nu][2][0], here=here),
    ]


def _statements(nu: float, shear: dict, gauge: dict, middle: dict, numbers: dict) -> list[Row]:
    here = f"20 mm wide, nu = {nu:g}"
    profile = middle[SOLID, nu][2]
    change = {plane: float(np.ptp(shear[plane, nu], axis=0).max()) for plane in PLANES}
    at = {plane: float(np.ptp(gauge[plane, nu][30])) for plane in PLANES}
    rows = [
        said("force-of-plane-strain", numbers[SOLID, nu][2][0], wanted=numbers[STRAIN, nu][2][0], here=here),
        said("width-79-middle", 2.0 * profile.deformed, tolerance=1.0 + 2.0 * profile.edge_error(), here=here),
        said("shear-as-in-plane-strain", change[SOLID] / change[STRAIN], here=here),
        said("gauge-as-in-plane-strain", at[SOLID] / at[STRAIN], here=here),
    ]
    return [*rows, *statements("20 mm wide", nu, np.array(MUS), gauge[SOLID, nu])]


def _draw(figure: Any, x: np.ndarray, nu: float, shear: dict, gauge: dict, middle: dict) -> None:
    figure.set_size_inches(13.0, 8.6)
    figure.suptitle(f"The Fig. 9 finger at 10 mm, nu = {nu:g}: as built (left), and as the two plane models see it")
    profiles, strains, gauges = ([found[plane, nu] for plane in PLANES] for found in (middle, shear, gauge))
    rows = rows_by_mu(x, profiles, {"gamma_xy under the surface": strains}, gauges)
    draw_grid(figure, ["20 mm wide, z = 0", STRAIN, STRESS], rows)
