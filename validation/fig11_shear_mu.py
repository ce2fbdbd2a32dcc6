"""Does the shear strain in the Fig. 9 finger change with friction more than in the half cylinder, also at large mu?

Source: Maeno 2004, Fig. 11 and Sec. III-B: 10 mm, plane strain: "when compared to Fig. 7, Fig. 11 reveals larger change
in shear strain"; "in particular, shear strain changes even when the friction coefficient is large at the node
x = 36 mm"; "the area near the edge of contact slips easily because both sides of the finger have been removed".
Fig. 7 is plane stress and Fig. 11 plane strain, so the two geometries are also compared in one plane state.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._paper import BELOW_FIG9, MUS, STRAIN, STRESS, Profile, fig9, half_cylinder, line, line_r5, said, strains
from ._press import fig9_finger, under
from ._rows import Result, Row, columns

NUS = (0.3, 0.45, 0.49)


def run(quick: bool) -> Result:
    """Both fingers in both plane states, under five coefficients, along their lines."""
    size, count = (3.0, 17) if quick else (0.5, 49)
    x = np.linspace(-48.0, 48.0, count)
    found, small, slip, lines = {}, {}, {}, []
    for nu in NUS:
        for plane in (STRAIN, STRESS):
            problem = fig9(nu, plane, size, line(x, fig9_finger(1.0), BELOW_FIG9))
            r5, gauges = line_r5(count=21)
            other = half_cylinder(nu, plane, size / 10.0, gauges)
            small[plane, nu] = np.array([strains(under(other, mu, 1)[-1], len(r5))[2] for mu in MUS])
            frames = [under(problem, mu, 1)[-1] for mu in MUS]
            found[plane, nu] = np.array([strains(f, count)[2] for f in frames])
            slip[plane, nu] = [(p.a, p.c) for p in (Profile.of(problem, f) for f in frames)]
            for mu, values in zip(MUS, found[plane, nu], strict=True):
                lines += [(plane, nu, mu, float(a), float(b)) for a, b in zip(x, values, strict=True)]
    rows = [row for nu in NUS for row in _statements(nu, x, found, small, slip)]
    table = columns("plane nu mu x_mm gamma_xy", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, x, found))


def _statements(nu: float, x: np.ndarray, found: dict, small: dict, slip: dict) -> list[Row]:
    change = {k: float(np.ptp(v, axis=0).max()) for k, v in found.items()}
    before = {k: float(np.ptp(v, axis=0).max()) for k, v in small.items()}
    values = found[STRAIN, nu][:, np.argmin(np.abs(x - 36.0))]
    a, c = slip[STRAIN, nu][-1]
    rows = [
        said(
            f"larger change of gamma_xy than in Fig. 7: ratio, {plane} against plane stress there, nu = {nu:g}",
            "Fig. 11", 1.0, change[plane, nu] / before[STRESS, nu], "larger", 0.0, "at least",
        )
        for plane in (STRAIN, STRESS)
    ]  # fmt: skip
    return [
        *rows,
        said(
            f"the geometry does it: ratio of the changes, both in plane strain, nu = {nu:g}", "Sec. III-B",
            1.0, change[STRAIN, nu] / before[STRAIN, nu], "larger", 0.0, "at least",
        ),
        said(
            f"gamma_xy at x = 36 changes at large mu: .5 to 1 over .06 to 1, plane strain, nu = {nu:g}", "Fig. 11",
            0.1, abs(values[-1] - values[-2]) / np.ptp(values), "a tenth of the signal", 0.0, "at least",
        ),
        said(
            f"the edge slips at large mu: slip zone at mu = 1 over a, plane strain, nu = {nu:g}", "Sec. III-B",
            0.02, (a - c) / a, "one of 50 points", 0.0, "at least",
        ),
    ]  # fmt: skip


def _draw(figure: Any, x: np.ndarray, found: dict[Any, np.ndarray]) -> None:
    from matplotlib import colormaps

    figure.set_size_inches(13.0, 6.6)
    panels = figure.subplots(2, 3, sharex=True, sharey="row")
    figure.suptitle(f"Shear strain {BELOW_FIG9:g} mm under the surface of the Fig. 9 finger at 10 mm")
    for column, nu in enumerate(NUS):
        for row, plane in enumerate((STRAIN, STRESS)):
            axes = panels[row, column]
            for i, mu in enumerate(MUS):
                axes.plot(x, found[plane, nu][i], color=colormaps["plasma"](0.85 * i / 4), label=f"{mu:g}")
            axes.axvline(36.0, color="#999999", ls=":", lw=1)
            axes.axhline(0.0, color="#999999", lw=0.7)
            axes.set_title(f"{plane}, nu = {nu:g}")
            panels[row, 0].set_ylabel("gamma_xy")
        panels[1, column].set_xlabel("x (mm); dotted: 36 mm")
    panels[0, 0].legend(title="mu", frameon=False)
