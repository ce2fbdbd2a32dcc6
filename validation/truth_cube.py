"""Do beads inside a compressed cube of silicone move as computed, and do they tell the friction of the plate?

Source: Kerdok et al. 2003, validation/REFERENCES.md, 9.2: a cube of 80 mm, cast on a rigid base, with beads every 10 mm
whose places a CT scan has before and after compressions by a plate, published as 5, 12.5 and 18.25 % of the height.
Neither forces nor the friction of the plate are published.  The beads of the middle slice above one another at the
centre and 30 mm to either side of it are compared: their movement towards the base (the mean of both sides) and the
distance of the outer two, 63 changes in all.  They do not depend on Young's modulus, since the travel is prescribed.

The cube is glued to the base, neo-Hookean, nu = 0.499, at large deformation, under a plane with several coefficients of
friction.  At each compression the travel of the plate and a shift of all beads along it are fitted: the beads next to
the plate moved further than the published travel, and each compression is a scan of its own.  Then friction is found
from the first two compressions, the travel of the third from its central beads alone, and the distances of the outer
beads are predicted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar

from finger3d._types import Float
from finger3d.analyses.press import press

from ._press import block_tables
from ._rows import Result, Row, columns, given, listed

judged = listed(__file__)

SIZE, NU, NOMINAL = 80.0, 0.499, np.array([0.05, 0.125, 0.1825])
HEIGHTS = 10.0 * np.arange(1, 8)
"""Of the beads above the base, mm."""
BEADS = given(__file__)
AXIAL, ACROSS = (np.array([*BEADS[way].values()]) for way in ("axial", "across"))
"""(3, 7, 4) mm towards the base, beads on the left, at the centre, on the right, from the base up, at rest and pressed;
and (2, 7, 4) mm across the slice, of the outer beads."""

DEEPEST, INCREMENTS = 20.0, 20
MUS = (0.0, 0.05, 0.1, 0.125, 0.15, 0.175, 0.2, 0.25, 0.3, 0.5, 1.0)
FITS = 0.25
"""Root mean square of differences, mm: places come in steps of 0.19 mm, and the sides differ by up to 0.5 mm."""
NEAR = 1.25
"""Times the least root mean square up to which a coefficient of friction counts as possible."""
KEYS = ("centre", "outer", "distance")


@dataclass(frozen=True)
class Compression:
    """A computed compression and what is found with it.

    Attributes
    ----------
    travel : (n,) of the plate, mm
    changes : (n, 3, 7) mm: movement towards the base at the centre and outside, and of the distance of the outer beads
    """

    mu: float
    travel: Float
    changes: Float

    def at(self, travel: float) -> Float:
        """(3, 7) changes at a travel, mm."""
        return np.asarray(make_interp_spline(self.travel, self.changes, k=1)(travel))

    def fitted(self, measured: Float, which: slice = slice(None)) -> tuple[float, Float]:
        """Travel that fits changes (3, 7) best, by all or some kinds, and the differences, computed less measured."""

        def differences(travel: float) -> Float:
            found = self.at(travel) - measured
            shift = found[:2][which].mean()
            return found - np.array([shift, shift, 0.0])[:, None]

        best = minimize_scalar(lambda t: float((differences(t)[which] ** 2).sum()), bounds=(1.0, DEEPEST))
        return float(best.x), differences(float(best.x))

    def misfit(self, measured: Float) -> float:
        """Root mean square of the differences from compressions (n, 3, 7), mm."""
        return float(np.sqrt(np.mean([self.fitted(m)[1] ** 2 for m in measured])))


def measured() -> Float:
    """(3, 3, 7) mm: of each compression the changes since rest."""
    axial = AXIAL[:, :, 1:] - AXIAL[:, :, :1]
    distance = ACROSS[1] - ACROSS[0]
    kinds = axial[1], 0.5 * (axial[0] + axial[2]), distance[:, 1:] - distance[:, :1]
    return np.moveaxis(np.array(kinds), 2, 0)


def computed(mu: float, size: float, nu: float = NU) -> Compression:
    """The cube under the plate."""
    beads = [
        {"name": f"{name}{k}", "x_mm": x, "y_mm": float(y)}
        for name, x in (("centre", 0.0), ("outer", 30.0))
        for k, y in enumerate(HEIGHTS)
    ]
    more = {"press": {"depth_mm": DEEPEST, "steps": INCREMENTS}, "effects": {"large_deformation": {}}, "marker": beads}
    scene = block_tables((0.5 * SIZE, SIZE, SIZE), 0.02, nu, (size, 1.5 * size), friction={"mu": mu}, **more)
    result = press(scene, error=False)
    assert result.outcome.ok, result.outcome
    moved = np.array([[s.markers[b["name"]] for b in beads] for s in result.steps]).reshape(-1, 2, len(HEIGHTS), 3)
    changes = np.stack([-moved[:, 0, :, 1], -moved[:, 1, :, 1], 2.0 * moved[:, 1, :, 0]], axis=1)
    travel = np.array([0.0, *(s.depth_mm for s in result.steps)])
    return Compression(mu, travel, np.concatenate([np.zeros_like(changes[:1]), changes]))


def run(quick: bool) -> Result:
    """Quick: two coefficients of friction."""
    size, mus = (9.0, (0.0, 0.15)) if quick else (8.0, MUS)
    data = measured()
    models = [computed(mu, size) for mu in mus]
    best = min(models, key=lambda m: m.misfit(data))
    other = {"0.7 of the edge length": computed(best.mu, 0.7 * size), "nu = 0.49": computed(best.mu, size, 0.49)}
    rows = [*_rows(models, best, data), *_predicted(models, data)]
    rows += [
        judged("root-mean-square-of-all-differences", model.misfit(data), best.misfit(data), what=what, size=size)
        for what, model in other.items()
    ]
    lines = [
        (m.mu, 100.0 * NOMINAL[level], t, name, h, data[level, kind, j], d[kind, j])
        for m in models
        for level, (t, d) in enumerate(m.fitted(x) for x in data)
        for kind, name in enumerate(KEYS)
        for j, h in enumerate(HEIGHTS)
    ]
    table = columns("mu published_percent travel_mm kind height_mm measured_mm difference_mm", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, models, best, data))


def _rows(models: list[Compression], best: Compression, data: Float) -> list[Row]:
    misfits = {m.mu: m.misfit(data) for m in models}
    fine = np.linspace(models[0].mu, models[-1].mu, 2001)
    near = fine[np.interp(fine, list(misfits), list(misfits.values())) <= NEAR * misfits[best.mu]]
    over = np.array([best.fitted(x)[0] for x in data]) / (SIZE * NOMINAL)
    worst = max(misfits.values())
    return [
        judged(
            "root-mean-square-of-differences-mm", misfits[best.mu], FITS, size=data.size, count=len(models), mu=best.mu
        ),
        judged("the-same", worst / misfits[best.mu]),
        judged("mu-is-told-within-0-1", 0.5 * float(near[-1] - near[0]), coarsest=near[0], finest=near[-1]),
        judged("fitted-travel", float(over[np.argmax(np.abs(over - 1.0))])),
    ]


def _predicted(models: list[Compression], data: Float) -> list[Row]:
    """Distances of the outer beads at the third compression."""
    first = min(models, key=lambda m: m.misfit(data[:2]))
    travel, _ = first.fitted(data[2], slice(0, 1))
    wanted = data[2, 2]
    away = float(np.abs(first.at(travel)[2] - wanted).max())
    words = {"value": wanted.min(), "other_value": wanted.max(), "mu": first.mu}
    return [judged("changes-of-distance-at-18-25", away, **words)]


def _draw(figure: Any, models: list[Compression], best: Compression, data: Float) -> None:
    figure.set_size_inches(12.0, 4.4)
    left, middle, right = figure.subplots(1, 3)
    for level, share in enumerate(NOMINAL):
        travel, differences = best.fitted(data[level])
        at = data[level] + differences
        for axes, kind in ((left, 0), (middle, 2)):
            axes.plot(at[kind], HEIGHTS, color=f"C{level}", lw=1.4)
            axes.plot(data[level, kind], HEIGHTS, "o", color=f"C{level}", ms=5,
                      label=f"published {100 * share:g} %, fitted {100 * travel / SIZE:.1f} %")  # fmt: skip
    left.set(xlabel="movement of the central beads towards the base (mm)", ylabel="height above the base (mm)")
    left.set_title(f"beads: measured, lines: mu = {best.mu:g}")
    left.legend(frameon=False)
    middle.set(xlabel="change of the distance of the outer beads (mm)", ylabel="height above the base (mm)")
    right.plot([m.mu for m in models], [m.misfit(data) for m in models], "ko-", ms=4)
    right.set(xlabel="mu of the plate that is assumed", ylabel="root mean square of differences (mm)", ylim=(0.0, None))
