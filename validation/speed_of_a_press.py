"""Does the speed of a press change the friction coefficient that a gauge reads, in a rubber that relaxes?

Source: Maeno 2004, Sec. IV: "this experiment is performed by increasing the indentation slowly to avoid the effect of
viscosity of the sensor". No relaxation of a silicone was found with its numbers, so that the stress is assumed to relax
by 2, 5 or 10 % in each decade of time, by a Prony series from 1 ms to 1000 s. The finger of Fig. 9 (nu = 0.49 at once)
is calibrated by presses of 10 s and read in presses of 0.1 to 1000 s: at the same depth and at the same force; with all
moduli relaxing, and in the section with the shear modulus alone, where Poisson's ratio grows. The section has the
paper's gauge, the finger 20 mm wide the gauge that finger_search.py finds best, at x = 6 mm and 85 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Gauge, Leg

from ._paper import STRAIN, fig9, said
from ._press import PAPER_GAUGE, changed, under
from ._rows import Result, Row, columns

RATES = (0.02, 0.05, 0.1)
"""Share of the stress at once that relaxes in every decade."""
DECADES = tuple(10.0**k for k in range(-3, 4))
DURATIONS = (0.1, 1.0, 10.0, 100.0, 1000.0)
USUAL = 10.0
"""Duration of the presses of the calibration, s."""
MU = 0.25
MUS = (0.15, 0.2, 0.25, 0.3, 0.35)
WIDE = "20 mm wide"
GAUGES = {
    STRAIN: PAPER_GAUGE,
    WIDE: Gauge("g", 6.0, 46.5, angle=math.radians(85.0)),
}
DEPTH, FORCE = "same depth", "same force"
DEPTH_MM = 10.0


@dataclass(frozen=True)
class Read:
    """A press of some duration: error of the mu that is read, force (N) and depth (mm)."""

    mu_error: float
    force: float
    depth: float


Found = dict[tuple[str, str, bool, float], dict[float, Read]]
"""Presses by duration; by model, control, whether all moduli relax, and rate."""


def run(quick: bool) -> Result:
    """Quick: the section on a coarse mesh with one rate."""
    found, bodies = {}, {}
    for name in (STRAIN,) if quick else (STRAIN, WIDE):
        body = fig9(0.49, "solid" if name == WIDE else STRAIN, 3.0 if quick or name == WIDE else 1.0, [GAUGES[name]])
        bodies[name] = body
        for rate in RATES if name == STRAIN and not quick else RATES[1:2]:
            for bulk in (True, False) if name == STRAIN else (True,):
                for control in (DEPTH, FORCE):
                    found[name, control, bulk, rate] = _durations(body, control, bulk, rate, 10 if quick else 40)
    rows = [row for case, reads in found.items() for row in _rows(case, reads)]
    rows += [row for name, body in bodies.items() for row in _checks(name, body, found)]
    lines = [
        (name, control, "all moduli" if bulk else "shear modulus", rate, time, read.mu_error, read.force, read.depth)
        for (name, control, bulk, rate), reads in found.items()
        for time, read in reads.items()
    ]
    names = "model control relaxing share_per_decade duration_s mu_error force_N depth_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, found))


def _durations(body: Problem, control: str, bulk: bool, rate: float, steps: int) -> dict[float, Read]:
    """Presses of all durations, each with the mu that the calibration makes of its strain."""
    effect = Viscosity(tuple((rate, time) for time in DECADES), bulk)
    model = effect.apply(replace(body.model, legs=(Leg(DEPTH_MM, steps=steps, duration_s=USUAL),)))
    relaxing = build(model)
    force = _force(under(relaxing, MU)[-1]) if control == FORCE else None

    def pressed(mu: float, time: float) -> StepResult:
        leg = Leg(DEPTH_MM, steps=steps, duration_s=time, force_N=force)
        return under(changed(relaxing, legs=(leg,)), mu)[-1]

    strain = np.array([pressed(mu, USUAL).gauges["g"] for mu in MUS])
    order = np.argsort(strain)
    mu_of = make_interp_spline(strain[order], np.array(MUS)[order], k=1)  # goes on along the last piece outside
    reads = {}
    for time in DURATIONS:
        frame = pressed(MU, time)
        reads[time] = Read(float(mu_of(frame.gauges["g"])) - MU, _force(frame), frame.target.depth_mm)
    return reads


def _force(frame: StepResult) -> float:
    """Normal force, N."""
    return float(frame.state.force[:, 0].sum())


def _rows(case: tuple[str, str, bool, float], reads: dict[float, Read]) -> list[Row]:
    name, control, bulk, rate = case
    here = f"{control}, {100.0 * rate:g} % per decade of {'all moduli' if bulk else 'the shear modulus'}, {name}"
    return [
        said("error-by-speed", abs(reads[time].mu_error), time=time, here=here)
        for time in (DURATIONS[0], 100.0)
    ]  # fmt: skip


def _checks(name: str, body: Problem, found: Found) -> Iterator[Row]:
    """The force where all moduli relax, from that of an elastic press while contact grows."""
    steps = 80
    elastic = np.array([0.0, *(_force(frame) for frame in under(body, MU, steps))])
    age = 1.0 - (np.arange(steps) + 0.5) / steps  # of the forces of an increment, over the duration
    for (own, control, bulk, rate), reads in found.items():
        if own == name and control == DEPTH and bulk:
            left = [1.0 - sum(rate * (1.0 - np.exp(-age * time / tau)) for tau in DECADES) for time in DURATIONS]
            wanted, got = (float(f[-1] / f[0]) for f in (left @ np.diff(elastic), [r.force for r in reads.values()]))
            yield Row(f"force in 1000 s over that in 0.1 s, {100.0 * rate:g} % per decade, {name}",
                      "Lee and Radok 1960; REFERENCES.md, 4.3", wanted, got, 0.01, "increments", )  # fmt: skip


def _draw(figure: Any, found: Found) -> None:
    models = list(dict.fromkeys(key[0] for key in found))
    figure.set_size_inches(5.0 * len(models), 4.4)
    for axes, model in zip(figure.subplots(1, len(models), squeeze=False)[0], models, strict=True):
        for (name, control, bulk, rate), reads in found.items():
            if name == model:
                label = f"{control}, {'all moduli' if bulk else 'shear modulus'}" if rate == RATES[1] else None
                colour, style = "#2166ac" if control == DEPTH else "#b2182b", "o-" if bulk else "o--"
                errors = [read.mu_error for read in reads.values()]
                axes.semilogx(list(reads), errors, style, ms=3, label=label, color=colour, lw=0.5 + 12.0 * rate)
        axes.axhspan(-0.1, 0.1, color="#eeeeee", lw=0)
        axes.set(xlabel="duration of the press (s)", ylabel="error of mu = 0.25", title=model)
        shares = sorted({100.0 * key[3] for key in found if key[0] == model})
        title = f"{', '.join(f'{share:g}' for share in shares)} % per decade{', thin to thick' if shares[1:] else ''}"
        axes.legend(title=title, title_fontsize=8, frameon=False)
