"""How do shear and gauge strain in the Fig. 9 finger change with friction, and at which angle most linearly?

Source: Maeno 2004, Figs. 11 and 12 and Sec. III-B: R = 100 mm, H = 36.6 mm, plane strain, pressed 10 mm.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from finger3d.mechanics.model import Gauge

from ._paper import (
    BELOW_FIG9,
    MUS,
    STRAIN,
    STRESS,
    Profile,
    by_mu,
    draw_grid,
    fig9,
    half_cylinder,
    line,
    line_r5,
    pressed,
    said,
    strains,
)
from ._press import fig9_finger
from ._rows import Result, Row, columns, together

NUS = (0.3, 0.45, 0.49)


def _shear(quick: bool) -> Result:
    """Does the shear strain in the Fig. 9 finger change with friction more than in the half cylinder, also at large
    mu?

    Source: Maeno 2004, Fig. 11 and Sec. III-B: 10 mm, plane strain: "when compared to Fig. 7, Fig. 11 reveals
    larger change in shear strain"; "in particular, shear strain changes even when the friction coefficient is large
    at the node x = 36 mm"; "the area near the edge of contact slips easily because both sides of the finger have
    been removed". Fig. 7 is plane stress and Fig. 11 plane strain, so the two geometries are also compared in one
    plane state.

    Both fingers in both plane states, under five coefficients, along their lines.
    """
    size, count = (3.0, 17) if quick else (0.5, 49)
    x = np.linspace(-48.0, 48.0, count)
    found, small, slip, lines = {}, {}, {}, []
    for nu in NUS:
        for plane in (STRAIN, STRESS):
            problem = fig9(nu, plane, size, line(x, fig9_finger(1.0), BELOW_FIG9))
            r5, gauges = line_r5(count=21)
            other = half_cylinder(nu, plane, size / 10.0, gauges)
            small[plane, nu] = np.array([strains(pressed(other, mu)[-1], len(r5))[2] for mu in MUS])
            frames = [pressed(problem, mu)[-1] for mu in MUS]
            found[plane, nu] = np.array([strains(f, count)[2] for f in frames])
            slip[plane, nu] = [(p.a, p.c) for p in (Profile.of(problem, f) for f in frames)]
            for mu, values in zip(MUS, found[plane, nu], strict=True):
                lines += [(plane, nu, mu, float(a), float(b)) for a, b in zip(x, values, strict=True)]
    rows = [row for nu in NUS for row in _statements(nu, x, found, small, slip)]
    table = columns("plane nu mu x_mm gamma_xy", lines)
    return Result(tuple(rows), table, lambda figure: _draw_shear(figure, x, found))


def _statements(nu: float, x: np.ndarray, found: dict, small: dict, slip: dict) -> list[Row]:
    change = {k: float(np.ptp(v, axis=0).max()) for k, v in found.items()}
    before = {k: float(np.ptp(v, axis=0).max()) for k, v in small.items()}
    values = found[STRAIN, nu][:, np.argmin(np.abs(x - 36.0))]
    a, c = slip[STRAIN, nu][-1]
    rows = [
        said("more-than-fig-7", change[plane, nu] / before[STRESS, nu], plane=plane, nu=nu)
        for plane in (STRAIN, STRESS)
    ]  # fmt: skip
    return [
        *rows,
        said("the-geometry-does-it", change[STRAIN, nu] / before[STRAIN, nu], nu=nu),
        said("shear-at-36", abs(values[-1] - values[-2]) / np.ptp(values), here=f"plane strain, nu = {nu:g}"),
        said("edge-slips", (a - c) / a, here=f"plane strain, nu = {nu:g}"),
    ]


def _draw_shear(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.suptitle(f"Shear strain {BELOW_FIG9:g} mm under the surface of the Fig. 9 finger at 10 mm")
    rows = []
    for plane in (STRAIN, STRESS):
        cells = [by_mu((x, values) for values in found[plane, nu]) for nu in NUS]
        rows.append((f"gamma_xy, {plane}", "x (mm)", "mu", cells))
    draw_grid(figure, [f"nu = {nu:g}" for nu in NUS], rows)


ANGLES = (0, 15, 30, 45, 60, 75, 90)
FINE = (0.06, 0.125, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
CASES = ((STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49), (STRESS, 0.49))
DEPTHS = (1.5, BELOW_FIG9, 6.0)
SURFACE = 43.287  # mm, height of the surface at x = 36


def gauges() -> list[Gauge]:
    """At x = 36 mm, three depths and seven angles."""
    return [Gauge(f"{b}:{t}", 36.0, SURFACE - b, angle=math.radians(t)) for b in DEPTHS for t in ANGLES]


def bend(mu: np.ndarray, strain: np.ndarray) -> float:
    """Largest distance from the best straight line over the range of strain."""
    return float(np.abs(strain - np.polyval(np.polyfit(mu, strain, 1), mu)).max() / np.ptp(strain))


def _gauges(quick: bool) -> Result:
    """Does the strain of a gauge at x = 36 mm fall as friction grows, and most linearly when the gauge is at 30
    degrees?

    Source: Maeno 2004, Figs. 12 and 14, Sec. III-B: plane strain, 10 mm: "the strain is large when the angle is
    large; however, when the angle is 30 degrees, the change in strain is rather linear over the entire range"; "the
    strain is small when the friction coefficient is large". The gauge's depth is not told: y = 40 mm (3.3 mm under
    the surface) is taken, and 1.5 and 6 mm are in the table. Linear: the largest distance from the best straight
    line over the range of strain.

    Every angle and depth from one condensation for each nu.
    """
    mus = np.array(FINE[1::2] if quick else FINE)
    found, lines = {}, []
    for plane, nu in CASES:
        problem = fig9(nu, plane, 3.0 if quick else 0.5, gauges())
        frames = [pressed(problem, float(mu))[-1] for mu in mus]
        for below in DEPTHS:
            for angle in ANGLES:
                strain = np.array([f.gauges[f"{below}:{angle}"] for f in frames])
                found[plane, nu, below, angle] = strain
                lines += [(plane, nu, below, angle, float(m), float(s)) for m, s in zip(mus, strain, strict=True)]
    rows: list[Row] = []
    for case in CASES:
        rows += statements(*case, mus, {t: found[(*case, BELOW_FIG9, t)] for t in ANGLES})
    table = columns("plane nu below_mm angle_deg mu strain", lines)
    return Result(tuple(rows), table, lambda figure: _draw_gauges(figure, mus, found))


def statements(plane: str, nu: float, mus: np.ndarray, strain: dict[int, np.ndarray]) -> list[Row]:
    """What Secs. III-B and IV say of the gauge, for strains (m,) by angle."""
    here = f"{plane}, nu = {nu:g}"
    change = {t: float(np.ptp(s)) for t, s in strain.items()}
    bent = {t: bend(mus, s) for t, s in strain.items()}
    steps = np.diff(strain[30])
    return [
        said("strain-at-30-falls", steps[steps > 0.0].sum() / np.abs(steps).sum(), here=here),
        said("grows-with-angle", change[60] / change[30], here=here),
        said("most-linear", bent[30] / min(bent[t] for t in (15, 30, 45, 60)), here=here),
        said("strain-tells-mu", change[30] / np.abs(strain[30]).max(), here=here),
    ]


def _draw_gauges(figure: Any, mus: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.suptitle("Gauge strain at x = 36 mm, 3.3 mm under the surface, depth 10 mm")
    cells = [{f"{t}°": (mus, found[*case, BELOW_FIG9, t]) for t in ANGLES[:-1]} for case in CASES]
    names = [f"{plane}, nu = {nu:g}" for plane, nu in CASES]
    draw_grid(figure, names, [("normal strain along the gauge", "mu", "angle", cells)])


def run(quick: bool) -> Result:
    """Shear along the line, then gauges at x = 36 mm."""
    return together((13.0, 11.2), shear=_shear(quick), gauges=_gauges(quick))
