"""Can a finger of finite width tell friction, and with which readings?

Source of the claim: Maeno 2004, Sec. IV: one gauge of 30 degrees resolves mu = 0.5 to 0.1 in a section.  The finger of
Fig. 9 (nu = 0.49) is pressed 10 mm as a section in plane strain and as a solid 20 mm wide, in small strain and at large
deformation.  It is read by the paper's gauge (at x = 36, y = 40 mm, which the paper does not tell), by the one, two and
three gauges that `finger3d optimise --gauges` places, and by the displacements along x of seven markers on the contact
face, each 0.02 mm.  The gauges read the free strain, and the strain of foils of 4 mm, 0.02 x 3 mm and 3000 MPa.  The
standard deviation of mu is that of generalised least squares with the default tolerances of a calibration, but for mesh
and increments, which computing removes; mu is known to lie between 0.05 and 1, a standard deviation of 0.27.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.calibrate.tolerances import with_defaults
from finger3d.analyses.gauge_places import GaugeFields, Region, search
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.model import Gauge, Leg, Model
from finger3d.mechanics.readings import Marker
from finger3d.progress import QUIET
from finger3d.sensor import Calibration

from ._press import fig9_model
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

Domain = Literal["solid", "plane-strain"]

NOISE, LIMIT = 1.5e-4, 0.1
MUS = tuple(float(mu) for mu in np.linspace(0.05, 1.0, 11).round(4))
UNKNOWN = (MUS[-1] - MUS[0]) / 12.0**0.5
"""Standard deviation of mu if every value between the first and the last is as likely."""
SIZES: dict[Domain, tuple[float, float]] = {"plane-strain": (1.0, 4.0), "solid": (3.0, 9.0)}
QUICK: dict[Domain, tuple[float, float]] = {"plane-strain": (3.0, 10.0)}
SMALL, LARGE = "small strain", "large deformation"
NAMES = {"plane-strain": "section", "solid": "20 mm wide"}
FOIL = EmbeddedGauge(3000.0, 0.02, 3.0)
IDEAL = {"mesh": 0.0, "increments": 0.0}
PAPER, MARKERS = "paper's gauge", "7 markers"
PAPER_GAUGE = Gauge("p", 36.0, 40.0, angle=math.radians(30.0))
FREE, READ = "free", "foil"
MOST = 3
COLOURS = {PAPER: "#b2182b", MARKERS: "#1b7837"}
COLOURS |= {"1 best gauge": "#92c5de", "2 best gauges": "#4393c3", "3 best gauges": "#053061"}

Spread = dict[tuple[Domain, str, str, str], Float]
"""Standard deviation of mu by domain, strain measure, readings, and free or foil."""

Curve = tuple[str | None, Float, Mapping[str, Any]]
"""Label, standard deviation of mu for all coefficients, and how it is drawn."""


def model(domain: Domain, sizes: tuple[float, float], large: bool, steps: int) -> Model:
    """Return the finger without readings."""
    found = fig9_model(0.49, *sizes, domain, legs=(Leg(10.0, steps=steps),))
    return LargeDeformation().apply(found) if large else found


def run(quick: bool) -> Result:
    """Quick: the section in small strain, with one and two gauges."""
    spread, placed = {}, []
    for domain, sizes in (QUICK if quick else SIZES).items():
        for measure in (SMALL,) if quick else (SMALL, LARGE):
            large = measure == LARGE
            body = model(domain, sizes, large, 4 if quick else 10 if large else 20)
            sets = {PAPER: (PAPER_GAUGE,), **best_gauges(body, 2 if quick else MOST)}
            placed += [
                (domain, measure, name, g.x_mm, g.y_mm, math.degrees(g.angle)) for name, s in sets.items() for g in s
            ]
            off = {**IDEAL, "tilt_deg": 0.0} if quick else IDEAL
            for name, sd in spreads(body, sets, markers(body, 36.0), off).items():
                spread[domain, measure, name, FREE] = sd
            if not quick:
                name = list(sets)[-1]
                spread[domain, measure, name, READ] = with_foils(body, sets[name], FOIL, 4.0, IDEAL)
    lines = [(*key, mu, sd) for key, sds in spread.items() for mu, sd in zip(MUS, sds, strict=True)]
    lines += [(domain, measure, name, "place", x, y) for domain, measure, name, x, y, _ in placed]
    names = "domain strain_measure readings read mu_or_x_mm mu_sd_or_y_mm"
    return Result(tuple(_rows(spread)), columns(names, lines), lambda figure: _draw(figure, spread))


def best_gauges(body: Model, most: int, tolerances: Mapping[str, float] | None = None) -> dict[str, tuple[Gauge, ...]]:
    """Return the best gauge, the best two and so on, under the default tolerances and those given."""
    known = with_defaults({**(tolerances or {}), "increments": 0.0})
    fields = GaugeFields.of(body, MUS[::2], NOISE, known, QUIET)
    found = {}
    for count in range(1, most + 1):
        chosen, _ = search(fields, Region.of(body), count, QUIET)
        found[f"{count} best gauge{'s' if count > 1 else ''}"] = tuple(
            Gauge(f"g{count}{i}", float(g.place[0]), float(g.place[1]), float(g.place[2]), g.angle)
            for i, g in enumerate(chosen.gauges)
        )
    return found


def markers(body: Model, reach: float, below: float = 0.5) -> tuple[Marker, ...]:
    """Return seven markers `below` mm under the contact face at z = 0, up to `reach` mm from the middle."""
    x = np.linspace(-reach, reach, 7)
    top = body.design.top(x, np.zeros_like(x))
    return tuple(Marker(f"m{i}", float(a), float(b) - below) for i, (a, b) in enumerate(zip(x, top, strict=True)))


def spreads(
    body: Model, sets: Mapping[str, Sequence[Gauge]], marked: Sequence[Marker], tolerances: Mapping[str, float]
) -> dict[str, Float]:
    """Return the standard deviation of mu by every set of gauges, and by the markers, all in the same presses."""
    gauges = tuple(g for chosen in sets.values() for g in chosen)
    names = {name: [g.name for g in chosen] for name, chosen in sets.items()}
    names[MARKERS] = [f"{m.name}.x" for m in marked]
    whole = replace(body, gauges=gauges, markers=tuple(marked))
    joint, _ = calibrated(whole, [n for some in names.values() for n in some], MUS, tolerances=tolerances)
    return {name: _sd(joint.of(some)) for name, some in names.items()}


def with_foils(
    body: Model, gauges: Sequence[Gauge], foil: EmbeddedGauge, length: float, tolerances: Mapping[str, float]
) -> Float:
    """Return the standard deviation of mu by gauges that are foils of a length (mm)."""
    lowered = tuple(_inside(body, replace(g, length_mm=length)) for g in gauges)
    foils = foil.apply(replace(body, gauges=lowered))
    joint, _ = calibrated(foils, [g.name for g in lowered], MUS, tolerances=tolerances)
    return _sd(joint)


def _inside(body: Model, gauge: Gauge) -> Gauge:
    """Return the gauge, moved until both ends of its foil and what displaces them are in the body."""
    margin = max(0.02 * body.design.height_mm, 0.4)
    while True:
        ends = np.array(gauge.ends)
        top = body.design.top(ends[:, 0], ends[:, 2])
        low = ends[:, 1].min() <= margin
        if np.isfinite(top).all() and (ends[:, 1] < top - margin).all() and not low:
            return gauge
        gauge = replace(gauge, x_mm=0.98 * gauge.x_mm, y_mm=gauge.y_mm + (0.5 if low else -0.5) * margin)


def _sd(joint: Calibration) -> Float:
    """Return the standard deviation of mu, at most that of a mu that may lie anywhere from 0.05 to 1."""
    return np.asarray(1.0 / np.sqrt(joint.mu_sd(np.array(MUS)) ** -2 + UNKNOWN**-2))


def _rows(spread: Spread) -> Iterator[Row]:
    for (domain, measure, name, read), sd in spread.items():
        here = f"{NAMES[domain]}, {measure}, {name}, {read}"
        yield judged("standard-deviation-at-half", np.interp(0.5, MUS, sd), LIMIT, here=here)
        yield judged("share-within-a-tenth", np.mean(sd <= LIMIT), here=here)
    for domain, measure in dict.fromkeys((key[0], key[1]) for key in spread):
        mean = [float(sd.mean()) for key, sd in spread.items()
                if key[:2] == (domain, measure) and "best" in key[2] and key[3] == FREE]  # fmt: skip
        worst = max(b / a for a, b in zip(mean, mean[1:], strict=False))
        yield judged("a-gauge-more", worst, name=NAMES[domain], measure=measure)


def _draw(figure: Any, spread: Spread) -> None:
    panels: dict[str, list[Curve]] = {}
    for (domain, measure, name, read), sd in spread.items():
        label, style = (f"{name}, as foils", "--") if read == READ else (name, "-")
        curve = label, sd, {"ls": style, "color": COLOURS[name], "lw": 1.8}
        panels.setdefault(f"{NAMES[domain]}, {measure}", []).append(curve)
    draw_spread(figure, panels, 2)


def draw_spread(figure: Any, panels: Mapping[str, Sequence[Curve]], columns: int) -> None:
    """Draw standard deviations of mu, a panel for each title."""
    rows, columns = -(-len(panels) // columns), min(len(panels), columns)
    figure.set_size_inches(4.8 * columns, 4.2 * rows)
    every = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axes, (title, curves) in zip(every.flat, panels.items(), strict=True):
        for label, sd, style in curves:
            axes.semilogy(MUS, sd, label=label, **style)
        for level, text in ((LIMIT, "the paper's 0.1"), (UNKNOWN, "nothing known")):
            axes.axhline(level, color="#888888", lw=0.8, ls=":")
            axes.text(1.0, level * 1.08, text, fontsize=8, ha="right")
        axes.set(xlabel="friction coefficient mu", title=title, ylim=(2e-3, 0.4))
    for axes in every[:, 0]:
        axes.set_ylabel("standard deviation of mu")
    lines = {line.get_label(): line for axes in every.flat for line in axes.get_legend_handles_labels()[0]}
    figure.legend(lines.values(), lines, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
