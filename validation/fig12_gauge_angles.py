"""Does the strain of a gauge at x = 36 mm fall as friction grows, and most linearly when the gauge is at 30 degrees?

Source: Maeno 2004, Figs. 12 and 14, Sec. III-B: plane strain, 10 mm: "the strain is large when the angle is large;
however, when the angle is 30 degrees, the change in strain is rather linear over the entire range"; "the strain is
small when the friction coefficient is large".  The gauge's depth is not told: y = 40 mm (3.3 mm under the surface) is
taken, and 1.5 and 6 mm are in the table.  Linear: the largest distance from the best straight line over the range of
strain.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from finger3d.mechanics.model import Gauge

from ._paper import BELOW_FIG9, STRAIN, STRESS, fig9, said
from ._press import under
from ._rows import Result, Row, columns

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


def run(quick: bool) -> Result:
    """Every angle and depth from one condensation for each nu."""
    mus = np.array(FINE[1::2] if quick else FINE)
    found, lines = {}, []
    for plane, nu in CASES:
        problem = fig9(nu, plane, 3.0 if quick else 0.5, gauges())
        frames = [under(problem, float(mu), 1)[-1] for mu in mus]
        for below in DEPTHS:
            for angle in ANGLES:
                strain = np.array([f.gauges[f"{below}:{angle}"] for f in frames])
                found[plane, nu, below, angle] = strain
                lines += [(plane, nu, below, angle, float(m), float(s)) for m, s in zip(mus, strain, strict=True)]
    rows: list[Row] = []
    for case in CASES:
        rows += statements(*case, mus, {t: found[(*case, BELOW_FIG9, t)] for t in ANGLES})
    table = columns("plane nu below_mm angle_deg mu strain", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, mus, found))


def statements(plane: str, nu: float, mus: np.ndarray, strain: dict[int, np.ndarray]) -> list[Row]:
    """What Secs. III-B and IV say of the gauge, for strains (m,) by angle."""
    here = f"{plane}, nu = {nu:g}"
    change = {t: float(np.ptp(s)) for t, s in strain.items()}
    bent = {t: bend(mus, s) for t, s in strain.items()}
    steps = np.diff(strain[30])
    return [
        said(
            f"strain at 30 degrees falls as mu grows: rising steps over all movement, {here}", "Fig. 14", 0.0,
            steps[steps > 0.0].sum() / np.abs(steps).sum(), "round-off and increments", 0.05, "absolute",
        ),
        said(
            f"strain grows with the angle to 60 degrees: change of strain at 60 over that at 30 degrees, {here}",
            "Fig. 12", 1.0, change[60] / change[30], "larger", 0.0, "at least",
        ),
        said(
            f"30 degrees is the most linear of 15, 30, 45, 60: its bend over the smallest of them, {here}", "Fig. 12",
            1.0, bent[30] / min(bent[t] for t in (15, 30, 45, 60)), "within a tenth", 0.1, "at most",
        ),
        said(
            f"the strain tells mu: change of strain at 30 degrees from .06 to 1 over its value, {here}", "Fig. 12", 0.1,
            change[30] / np.abs(strain[30]).max(), "a signal of a tenth", 0.0, "at least",
        ),
    ]  # fmt: skip


def _draw(figure: Any, mus: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    figure.set_size_inches(13.0, 4.6)
    panels = figure.subplots(1, 4, sharey=True)
    figure.suptitle("Gauge strain at x = 36 mm, 3.3 mm under the surface, depth 10 mm")
    for axes, (plane, nu) in zip(panels, CASES, strict=True):
        for i, angle in enumerate(ANGLES[:-1]):
            wide = {"lw": 2.2} if angle == 30 else {"lw": 1.1}
            axes.plot(mus, found[plane, nu, BELOW_FIG9, angle], "o-", ms=3, color=f"C{i}", label=f"{angle}°", **wide)
        axes.axhline(0.0, color="#999999", lw=0.7)
        axes.set(xlabel="mu", title=f"{plane}, nu = {nu:g}")
    panels[0].set_ylabel("normal strain along the gauge")
    panels[0].legend(title="angle", frameon=False, ncols=2, loc="lower left")
