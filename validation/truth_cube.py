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
from scipy.optimize import minimize_scalar

from finger3d._types import Float
from finger3d.analyses.press import press

from ._rows import Result, Row, at_least, at_most, columns

SOURCE = "Kerdok et al. 2003; REFERENCES.md, 9.2"
SIZE, NU, NOMINAL = 80.0, 0.499, np.array([0.05, 0.125, 0.1825])
HEIGHTS = 10.0 * np.arange(1, 8)
"""Of the beads above the base, mm."""
AXIAL = np.array([
    [[12.27, 12.57, 13.16, 13.73], [3.15, 3.90, 5.20, 6.40], [-6.87, -5.38, -3.35, -1.30],
     [-17.22, -14.84, -12.06, -9.24], [-26.94, -24.12, -20.36, -16.88], [-37.29, -33.92, -29.13, -25.05],
     [-47.50, -43.20, -37.67, -32.84]],
    [[12.46, 12.49, 12.95, 13.52], [3.19, 3.87, 4.94, 5.94], [-6.83, -5.55, -3.56, -2.01],
     [-16.88, -14.89, -11.95, -9.46], [-26.90, -24.27, -20.23, -16.61], [-37.26, -33.58, -28.76, -24.31],
     [-47.16, -42.86, -36.92, -32.10]],
    [[12.65, 13.02, 13.73, 14.25], [3.49, 4.31, 5.75, 6.90], [-6.49, -5.01, -2.63, -0.56],
     [-16.85, -14.32, -11.13, -8.38], [-26.87, -23.75, -19.48, -16.14], [-37.07, -33.21, -28.11, -23.95],
     [-46.94, -42.52, -36.59, -31.76]],
])  # fmt: skip
"""(3, 7, 4) mm towards the base: beads on the left, at the centre, on the right; from the base up; at rest, pressed."""
ACROSS = np.array([
    [[-30.05, -30.75, -31.66, -32.61], [-29.50, -30.62, -31.91, -33.39], [-29.50, -30.62, -32.28, -33.97],
     [-29.10, -30.25, -31.73, -33.54], [-29.10, -30.06, -31.53, -33.21], [-29.13, -30.22, -31.36, -32.84],
     [-28.87, -29.85, -30.62, -31.73]],
    [[32.88, 33.62, 34.70, 35.96], [31.32, 32.44, 33.96, 35.47], [32.10, 33.21, 35.40, 37.29],
     [31.33, 32.50, 34.58, 36.52], [31.34, 32.66, 34.70, 36.55], [31.69, 32.84, 34.88, 36.50],
     [30.99, 32.44, 33.98, 35.07]],
])  # fmt: skip
"""(2, 7, 4) mm: the outer beads across the slice."""
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
        k = int(np.clip(np.searchsorted(self.travel, travel), 1, len(self.travel) - 1))
        a = (travel - self.travel[k - 1]) / (self.travel[k] - self.travel[k - 1])
        return (1.0 - a) * self.changes[k - 1] + a * self.changes[k]

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
    scene = {
        "finger": {"geometry": "block", "half_length_mm": 0.5 * SIZE, "height_mm": SIZE, "width_mm": SIZE},
        "material": {"E_MPa": 0.02, "nu": nu},
        "mesh": {"mesher": "swept", "size_mm": size, "base_size_mm": 1.5 * size},
        "friction": {"mu": mu},
        "press": {"depth_mm": DEEPEST, "steps": INCREMENTS},
        "effects": {"large_deformation": {}},
        "marker": beads,
    }
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
        Row(f"root mean square of all differences with {what}, mm", f"edges of {size:g} mm, nu = {NU:g}",
            best.misfit(data), model.misfit(data), 0.1, "a small part of it", "sensitivity")
        for what, model in other.items()
    ]  # fmt: skip
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
        at_most(
            f"root mean square of {data.size} differences, mm, best of {len(models)} coefficients: mu = {best.mu:g}",
            SOURCE, FITS, misfits[best.mu], "steps of 0.19 mm, up to 0.5 mm between the sides",
            "validation"),
        at_least("the same of the worst coefficient over that of the best", SOURCE, 1.5, worst / misfits[best.mu],
            "if beads tell friction", "statement"),
        at_most(
            f"mu is told within 0.1: half its range, {near[0]:.2f} to {near[-1]:.2f}, of at most {NEAR:g} times that",
            SOURCE, 0.1, 0.5 * float(near[-1] - near[0]), "the resolution of a gauge", "statement"),
        Row("fitted travel of the plate over the published one, of three that furthest from 1", SOURCE, 1.0,
            float(over[np.argmax(np.abs(over - 1.0))]), 0.05, "if the published compression is that of the cube",
            "statement"),
    ]  # fmt: skip


def _predicted(models: list[Compression], data: Float) -> list[Row]:
    """Distances of the outer beads at the third compression."""
    first = min(models, key=lambda m: m.misfit(data[:2]))
    travel, _ = first.fitted(data[2], slice(0, 1))
    change = first.at(travel)[2]
    return [
        Row(f"changes of distance at 18.25 %, {data[2, 2].min():.1f} to {data[2, 2].max():.1f} mm, predicted with mu = "
            f"{first.mu:g}: largest difference, mm", SOURCE, 0.0, float(np.abs(change - data[2, 2]).max()), 1.0,
            "the beads of a pair differ by 1 mm in their movement", "validation", "absolute")
    ]  # fmt: skip


def _draw(figure: Any, models: list[Compression], best: Compression, data: Float) -> None:
    figure.set_size_inches(14.0, 4.6)
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
