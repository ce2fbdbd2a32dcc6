"""How small may a finger be that still tells friction, and with which readings?

Source: Maeno 2004, Sec. V: "miniaturization of the sensor" is left for the future, and "the method is fundamentally
applicable even when the size ... changed". In small strain a finger of half the size has the same strains, but noise,
tolerances and foils do not shrink with it. Half cylinders of R = 5 and 10 mm, 1.2 R wide, are pressed by a fifth of R
(nu = 0.49), in small strain and, R = 5 mm, at large deformation (neo-Hookean). They are read by one and by two gauges
at the places that `finger3d optimise --gauges` finds in small strain, by two foils of 2 mm, 0.02 x 1.5 mm and 3000 MPa
(R = 5 mm), and by seven markers on the contact face, each 0.02 mm. The tolerances are the defaults of a calibration, of
a gauge laid by hand on a bench (depth 0.1 mm, place 0.3 mm, 2 degrees), and those of a gauge cast in a mold on a
precise bench (0.02 mm, 0.1 mm, 1 degree); mesh and increments are left out. The standard deviation of mu is that of
friction_in_3d.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.model import Leg, MeshOptions, Model

from ._paper import said
from ._rows import Result, Row, columns
from .friction_in_3d import IDEAL, LIMIT, MARKERS, MUS, Curve, best_gauges, draw_spread, markers, spreads, with_foils

RADII = (5.0, 10.0)
FOIL, FOIL_MM = EmbeddedGauge(3000.0, 0.02, 1.5), 2.0
HAND, CAST = "laid by hand", "cast in a mold"
TOLERANCES = {
    HAND: IDEAL,
    CAST: {**IDEAL, "depth_mm": 0.02, "gauge_x_mm": 0.1, "gauge_y_mm": 0.1, "gauge_angle_deg": 1.0},
}
SMALL, LARGE = "small strain", "large deformation"
CASES = ((SMALL, HAND), (SMALL, CAST), (LARGE, CAST))
JUDGED = (0.1, 0.25, 0.5)

Spread = dict[tuple[float, str, str, str], Float]
"""Standard deviation of mu by radius, strain measure, tolerances and readings."""


def model(radius: float, large: bool, quick: bool) -> Model:
    """The finger without readings."""
    design = designs()["half_cylinder"](radius_mm=radius, width_mm=1.2 * radius)
    mesh = MeshOptions(radius / (8.0 if quick else 12.0), radius / 4.0, "swept")
    legs = (Leg(0.2 * radius, steps=4 if quick else 10 if large else 20),)
    found = Model(design, Isotropic(1.0, 0.49), mesh, legs)
    return LargeDeformation().apply(found) if large else found


def run(quick: bool) -> Result:
    """Quick: the smallest finger in small strain, with one gauge and markers."""
    found: Spread = {}
    for radius in RADII[:1] if quick else RADII:
        for measure, name in CASES[:1] if quick else CASES if radius == RADII[0] else CASES[:2]:
            body = model(radius, measure == LARGE, quick)
            given = TOLERANCES[name]
            off = {**given, "tilt_deg": 0.0} if quick else given
            if measure == SMALL:
                sets = best_gauges(body, 1 if quick else 2, off)
            marked = markers(body, 0.55 * radius, 0.01 * radius)
            for readings, sd in spreads(body, sets, marked, off).items():
                found[radius, measure, name, readings] = sd
            if (radius, measure, name) == (RADII[0], SMALL, CAST):
                last = list(sets)[-1]
                found[radius, measure, name, "2 foils"] = with_foils(body, sets[last], FOIL, FOIL_MM, off)
    lines = [(*key, mu, sd) for key, sds in found.items() for mu, sd in zip(MUS, sds, strict=True)]
    table = columns("R_mm strain_measure tolerances readings mu mu_sd", lines)
    return Result(tuple(_rows(found)), table, lambda figure: _draw(figure, found))


def _rows(found: Spread) -> Iterator[Row]:
    for (radius, measure, name, readings), sd in found.items():
        for mu in JUDGED:
            here = f"{readings}, {name}, {measure}, R = {radius:g} mm"
            yield said("spread-of-mu", np.interp(mu, MUS, sd), LIMIT, mu=mu, here=here)
    for measure in dict.fromkeys(key[1] for key in found):
        ratios = [
            float(np.mean(found[RADII[0], m, name, readings]) / np.mean(found[RADII[-1], m, name, readings]))
            for radius, m, name, readings in found
            if m == measure and radius == RADII[-1]
        ]
        if ratios:
            what = f"mean standard deviation of mu, R = 5 over R = 10 mm, least of all readings, {measure}"
            yield Row(what, "tolerances do not shrink with the finger", 1.0, min(ratios), 0.1,
                      "places are searched for on a grid", "sensitivity", "at least")  # fmt: skip


def _draw(figure: Any, found: Spread) -> None:
    names = list(dict.fromkeys(key[3] for key in found))
    panels: dict[str, list[Curve]] = {}
    for (radius, measure, tolerances, readings), sd in found.items():
        colour = "#1b7837" if readings == MARKERS else f"C{names.index(readings)}"
        label, width = (readings, 2.2) if radius == RADII[0] else (None, 1.0)
        curve = label, sd, {"color": colour, "lw": width}
        panels.setdefault(f"{measure}, {tolerances}", []).append(curve)
    draw_spread(figure, panels, len(CASES))
    figure.suptitle("thick: R = 5 mm, thin: R = 10 mm")
