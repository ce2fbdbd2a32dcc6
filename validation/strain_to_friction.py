"""Does the 30 degree gauge of the Fig. 9 finger resolve mu = 0.5 to 0.1, as the paper measured?

Source: Maeno 2004, Sec. IV, Fig. 14: the strain falls as mu grows, a second-order equation goes through seven points,
the largest standard deviation of the strain, 1.5e-4, makes an error of 0.1 in mu, up to mu = 0.5.  Neither Poisson's
ratio nor the gauge's depth and make are told: nu = 0.49, x = 36, y = 40 mm, and a foil of 4 mm, 0.02 x 3 mm, 3000 MPa
are taken.  Four calibrations, in small strain: the section in plane strain and the finger 20 mm wide, each with the
free strain at the point and with what the foil reads; pressed 10 mm, in as many increments as the error of the strain
asks for (up to 320 in the section, 160 in the solid): in ten, the strain of the wide finger moves with mu by about
twice as much.  The slope at one mu of the wide finger's flat curve still follows the mesh, point by point, so the error
of mu is taken by the second-order fit, as the paper's is, and by the change of the strain over mu = .4 to .6, told with
what the increments may change in it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.curve_points import CurvePoints
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.calibrate.settings import MUS
from finger3d.analyses.reduced import ReducedModel
from finger3d.effects.embedded_gauge import Effect
from finger3d.mechanics.model import Domain, Leg, Model
from finger3d.sensor import Calibration, ReadingCurve, estimate
from finger3d.sensor.likelihood import CREDIBLE

from ._paper import said
from ._press import fig9_model, paper_gauges
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

NU, NOISE, LIMIT = 0.49, 1.5e-4, 0.1
FOIL = Effect(3000.0, 0.02, 3.0)
SIZES: dict[Domain, tuple[float, float]] = {"plane-strain": (0.8, 3.0), "solid": (1.4, 5.0)}
QUICK: dict[Domain, tuple[float, float]] = {"plane-strain": (3.0, 10.0), "solid": (5.0, 12.0)}
NAMES = {"plane-strain": "plane strain", "solid": "20 mm wide"}
FREE, READ = "free strain", "as a foil reads it"
LINES = "model kind mu strain fit strain_per_mu resolution resolution_fit mu_sd_with_tolerances"
OFF = dict.fromkeys(TOLERANCES, 0.0)
STEPS_ALONE = {**OFF, "increments": 1.0}

Found = dict[tuple[Domain, str], Calibration]


def model(domain: Domain, sizes: tuple[float, float], length: float, quick: bool = False) -> Model:
    """The finger with its gauge, and the mirror image of it."""
    leg = Leg(10.0, steps=4 if quick else "auto")
    return fig9_model(NU, *sizes, domain, legs=(leg,), gauges=paper_gauges(length))


def run(quick: bool) -> Result:
    """Quick: coarse meshes, five values of mu, tolerances of one kind only."""
    mus = (0.02, 0.4, 0.5, 0.6, 1.2) if quick else MUS
    wanted = {**STEPS_ALONE, "gauge_angle_deg": 2.0} if quick else None
    found, rows = {}, []
    for domain, sizes in (QUICK if quick else SIZES).items():
        free, points = calibrated(model(domain, sizes, 0.0, quick), "g", mus, {"gauge": NOISE}, LIMIT, wanted)
        found[domain, FREE] = free
        foil = FOIL.apply(model(domain, sizes, 4.0, quick))
        found[domain, READ] = calibrated(foil, "g", mus, {"gauge": NOISE}, LIMIT, OFF if quick else STEPS_ALONE)[0]
        rows += _checks(domain, free, points)
    for (domain, kind), calibration in found.items():
        rows += _statements(f"{kind}, {NAMES[domain]}", calibration)
    rows += _widths(found)
    lines: list[tuple[Any, ...]] = []
    for (domain, kind), calibration in found.items():
        c = calibration.readings[0]
        spread = calibration.mu_sd(c.mu) if c.tolerances else np.full(len(c.mu), np.nan)
        from_curve = (c.reading, c.fit.at(c.mu), c.slope(c.mu), c.resolution(c.mu), _resolution_of_fit(c, c.mu))
        lines += [(domain, kind, *map(float, line)) for line in zip(c.mu, *from_curve, spread, strict=True)]
    return Result(tuple(rows), columns(LINES, lines), lambda figure: _draw(figure, found))


def _checks(domain: Domain, calibration: Calibration, points: CurvePoints) -> list[Row]:
    """What must hold whatever the answer: the reduced model, and the coverage of the intervals."""
    here, (first, *_, last) = NAMES[domain], points.mus
    reduced = ReducedModel.of(points.problem).press(last).steps[-1].gauges["g"]
    random = np.random.default_rng(20261121)
    count = 4000
    mu = random.uniform(first, last, count)
    quiet = calibration.without_tolerances
    c = quiet.readings[0]
    # what the set allows for, drawn whole
    answers = estimate(quiet, c.at(mu) + random.normal(0.0, 1.0, count) * c.reading_sd(mu))
    hit = np.mean([any(low <= m <= high for low, high in e.intervals) for m, e in zip(mu, answers, strict=True)])
    scatter = math.sqrt(CREDIBLE * (1.0 - CREDIBLE) / count)
    return [
        judged("strain-from-the-reduced-model-mu", reduced, float(c.reading[-1]), last=last, here=here),
        judged("90-sets-that-contain-the-true", float(hit), CREDIBLE, tolerance=3.0 * scatter, count=count, here=here),
    ]


def _statements(what: str, calibration: Calibration) -> list[Row]:
    """What Sec. IV says of the measured sensor."""
    c = calibration.readings[0]
    steps = np.diff(c.reading)
    usable = max((high for low, high in calibration.usable if low <= 0.3), default=0.0)
    return [
        said("strain-falls", steps[steps > 0.0].sum() / np.abs(steps).sum(), what=what),
        said("error-by-fit", math.log10(float(_resolution_of_fit(c, np.array(0.5))) / LIMIT), what=what),
        said("error-by-change", math.log10(0.2 * c.noise / abs(float(c.at(0.6) - c.at(0.4))) / LIMIT), what=what),
        *_left(what, c),
        said("measured-to-half", usable, what=what),
        said("second-order-residual", c.fit.rms, wanted=NOISE, what=what),
    ]


def _resolution_of_fit(c: ReadingCurve, mu: Float) -> Float:
    """The standard deviation of mu that the noise leaves on the second-order fit."""
    _, c1, c2 = c.fit.coefficients
    return np.asarray(c.noise / np.abs(c1 + 2.0 * c2 * mu))


def _left(what: str, c: ReadingCurve) -> list[Row]:
    """What the increments leave open of the change of the strain; none where that was not looked for."""
    names, mus = [t.name for t in c.tolerances], np.array([0.4, 0.6])
    if "increments" not in names:
        return []
    error = float(c.tolerance_sd(mus)[names.index("increments")].max())
    share = error / abs(float(np.diff(c.at(mus))[0]))
    return [judged("error-of-that-change-by-the", share, what=what)]


def _widths(found: Found) -> list[Row]:
    """What the plane strain section promises, held against the finger 20 mm wide."""
    moved = {k: float(np.ptp(c.readings[0].reading)) for k, c in found.items()}
    return [
        judged("change", moved["solid", kind] / moved["plane-strain", kind], kind=kind) for kind in (FREE, READ)
    ] + [judged("change-by-foil", moved[domain, READ] / moved[domain, FREE], value=NAMES[domain]) for domain in NAMES]


def _draw(figure: Any, found: Found) -> None:
    figure.set_size_inches(12.0, 5.0)
    *panels, right = figure.subplots(1, 3)
    colours = {"plane-strain": "#2166ac", "solid": "#b2182b"}
    for axes, kind in zip(panels, (FREE, READ), strict=True):
        for domain, name in NAMES.items():
            c = found[domain, kind].readings[0]
            axes.plot(c.grid, 1e3 * c.at(c.grid), color=colours[domain], lw=1.5, label=name)
            axes.plot(c.mu, 1e3 * c.reading, "o", ms=3, color=colours[domain])
            axes.plot(c.grid, 1e3 * c.fit.at(c.grid), "--", color=colours[domain], lw=1.0, label="its second order")
        axes.set(xlabel="mu", ylabel="strain, 1e-3", title=f"gauge at 30°: {kind}")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.legend(frameon=False)
    for (domain, kind), calibration in found.items():
        c = calibration.readings[0]
        style = "-" if kind == FREE else ":"
        shown = np.minimum(c.resolution(c.grid), 1e3)
        right.semilogy(c.grid, shown, style, color=colours[domain], lw=1.5, label=f"{NAMES[domain]}, {kind}")
    right.plot(0.5, 0.1, "k*", ms=11, label="the paper, measured")
    right.set(xlabel="mu", ylabel="standard deviation of mu", title="from a strain noise of 1.5e-4", ylim=(5e-4, 50.0))
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), frameon=False)
