"""Which models of the sensor are compatible with the strains of the paper's Fig. 14, and what do these tell of mu?

Source: Maeno 2004, Sec. IV, Fig. 14: the strain falls as mu grows, a second-order equation goes through the readings,
and a strain noise of 1.5e-4 makes an error of 0.1 in mu = 0.5.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.pressed_body import presses
from finger3d.contact.friction import Coulomb
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Domain, Gauge, Leg, Model

from ._paper import STRAIN, STRESS, said
from ._press import fig9_model, paper_gauges
from ._rows import Result, Row, columns, listed, together

judged = listed(__file__)

NOISE, ERROR = 1.5e-4, 0.1
MUS = np.array([0.06, 0.125, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
FEW = MUS[[0, 2, 4, 5, 6, 8]]
NUS = (0.45, 0.49)
LEANING = {"30": 30.0, "-30": -30.0, "30 from the vertical": 60.0, "-30 from the vertical": -60.0}
HEIGHTS, OFFSETS = (36.0, 38.0, 40.0, 42.0), (0.0, 5.0, 9.5)  # y and z of the gauge, mm
WIDE, LARGE = "20 mm wide", ", large deformation"
DOMAINS: dict[str, Domain] = {STRESS: "plane-stress", STRAIN: "plane-strain", WIDE: "solid"}
FOIL = EmbeddedGauge(3000.0, 0.02, 3.0)
FOIL_MM = 4.0
PLACE = (40.0, 0.0)
"""y and z of the gauge in the other studies."""
FREE, READ = "free strain", "4 mm foil"


@dataclass(frozen=True)
class Curve:
    """Strain of a gauge over mu (m,) in one model; `model` has no Poisson's ratio, and `leaning` is a key."""

    model: str
    nu: float
    leaning: str
    y: float
    z: float
    kind: str
    mu: Float
    strain: Float

    @property
    def fall(self) -> float:
        """By how much the strain falls from the smallest mu to 0.5."""
        return float(self.strain[0] - self.at(0.5))

    @property
    def beyond(self) -> float:
        """Largest change from mu = 0.5 on."""
        return float(np.abs(self.strain[self.mu >= 0.5] - self.at(0.5)).max())

    @property
    def slope(self) -> float:
        """Change per mu at 0.5 of the second-order equation through the strains up to 0.6."""
        low = self.mu <= 0.6
        return float(np.polyval(np.polyder(np.polyfit(self.mu[low], self.strain[low], 2)), 0.5))

    @property
    def bend(self) -> float:
        """Largest distance from the second-order equation through all strains, over their range."""
        fit = np.polyval(np.polyfit(self.mu, self.strain, 2), self.mu)
        return float(np.abs(self.strain - fit).max() / np.ptp(self.strain))

    @property
    def error(self) -> float:
        """Error of mu = 0.5 from the noise, by the change of the strain between the neighbours of 0.5."""
        return _local_error(self.mu, self.strain, 0.5)

    @property
    def by_slope(self) -> bool:
        """Whether the curve is compatible with the first reading of the figure."""
        steps = np.diff(self.strain[self.mu <= 0.5])
        falls = steps[steps > 0.0].sum() <= 0.05 * np.abs(steps).sum()
        return bool(falls and NOISE / ERROR / 3.0 <= -self.slope <= 3.0 * NOISE / ERROR)

    @property
    def by_vertex(self) -> bool:
        """Whether the curve is compatible with the second reading of the figure."""
        wanted = NOISE / ERROR**2 * (0.5 - self.mu[0]) ** 2
        return bool(wanted / 2.0 <= self.fall <= 2.0 * wanted and self.beyond <= 2.0 * NOISE)

    def at(self, mu: float) -> float:
        """Strain at one of the values of mu."""
        return float(self.strain[np.argmin(np.abs(self.mu - mu))])


def _models(quick: bool) -> Result:
    """Which models of the sensor are compatible with the strains that the paper measured, and which are not?

    Source: Maeno 2004, Sec. IV, Fig. 14: the strain falls as mu grows; a second-order equation goes through seven
    points; with the largest standard deviation of the strain, 1.5e-4, the equation gives mu = 0.5 with an error of
    0.1. The text leaves open on which side the gauge of 30 degrees leans and from which axis the angle is measured,
    how deep and how far from the middle plane the gauge lies, Poisson's ratio, and how much a foil in silicone
    reads. All of these are swept, in sections and 20 mm wide, in small strain and at large deformation
    (neo-Hookean). The surface above the gauge is 43.3 mm high. A finger whose ends are held is the section in plane
    strain (plane_strain_limit.py). Foils are 4 mm long, at y = 40, z = 0 mm. Two readings of the sentence:

    - slope: at mu = 0.5 the strain changes by -1.5e-4/0.1 = -1.5e-3 per mu; a factor of 3 either way passes, and on
      the way from 0.06 to 0.5 at most a twentieth of the movement may rise;
    - vertex: the parabola ends in its vertex at 0.5, where 1.5e-4 = c 0.1^2, so that the strain falls by
      c 0.44^2 = 2.9e-3 from mu = 0.06 to 0.5, a factor of 2 either way, and changes by no more than 2 x 1.5e-4 beyond.

    Two gauges of one finger that lean to both sides, at 30 and -30 degrees, decide between the models: in plane
    strain the strain of the first falls and that of the second rises, 20 mm wide at large deformation it is the
    reverse, and 20 mm wide in small strain both rise.

    Quick: sections on a coarse mesh, and the solid at large deformation for three coefficients of friction.
    """
    curves = list(_curves(quick))
    rows = [*_compatible(curves), *_claims(curves)]
    lines = [
        (c.model, c.nu, c.leaning, c.y, c.z, c.kind, c.fall, c.beyond, c.slope, c.by_slope, c.by_vertex) for c in curves
    ]
    names = "model nu leaning y_mm z_mm kind fall_to_half change_beyond slope_at_half by_slope by_vertex"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_models(figure, curves))


def _curves(quick: bool) -> Iterator[Curve]:
    for name, domain in DOMAINS.items():
        for large in (False, True):
            mus = MUS[[0, 4, 5, 6]] if quick else MUS
            for nu in NUS[-1:] if quick else NUS:
                offsets = OFFSETS if domain == "solid" else (0.0,)
                places = [(lean, y, z) for lean in LEANING for y in HEIGHTS for z in offsets]
                gauges = [_gauge(f"{lean}:{y}:{z}", lean, y, z) for lean, y, z in places]
                read = _read(_model(domain, nu, large, gauges, quick), mus)
                for lean, y, z in places:
                    yield Curve(name + LARGE * large, nu, lean, y, z, FREE, mus, read[f"{lean}:{y}:{z}"])
            for lean in () if quick or domain == "plane-stress" else LEANING:
                foils = (_gauge("g", lean, *PLACE, FOIL_MM), _gauge("m", lean, *PLACE, FOIL_MM, side=-1))
                foiled = FOIL.apply(_model(domain, NUS[-1], large, foils, quick))
                yield Curve(name + LARGE * large, NUS[-1], lean, *PLACE, READ, FEW, _read(foiled, FEW)["g"])


def _gauge(name: str, leaning: str, y: float, z: float, length: float = 0.0, side: int = 1) -> Gauge:
    """A gauge at x = 36 mm, or its mirror image."""
    angle = math.radians(LEANING[leaning])
    return Gauge(name, side * 36.0, y, z, angle if side > 0 else math.pi - angle, length)


def _model(domain: Domain, nu: float, large: bool, gauges: Any, quick: bool) -> Model:
    size = (6.0 if quick else 2.5) if domain == "solid" else 3.0 if quick else 2.0 if large else 1.0
    legs = (Leg(10.0, steps=4 if quick else 10 if large else 80),)
    model = fig9_model(nu, size, 3.0 * size, domain, legs=legs, gauges=tuple(gauges))
    return LargeDeformation().apply(model) if large else model


def _read(model: Model, mus: Float) -> dict[str, Float]:
    """Strain (m,) over ascending mu by gauge, of converged presses."""
    frames = {press.mu: press.frame for press in presses(build(model), tuple(map(float, mus)))}
    for mu, frame in frames.items():
        if not frame.outcome.ok:
            raise AssertionError(f"mu = {mu:g}: {frame.outcome}")
    return {name: np.array([frames[mu].gauges[name] for mu in sorted(frames)]) for name in frame.gauges}


def _compatible(curves: list[Curve]) -> Iterator[Row]:
    """How many of the gauges in each model are compatible with each reading of the figure."""
    for model in dict.fromkeys(c.model for c in curves):
        own = [c for c in curves if c.model == model and c.kind == FREE]
        for reading, count in (("slope", sum(c.by_slope for c in own)), ("vertex", sum(c.by_vertex for c in own))):
            yield said("compatible-one-reading", count, reading=reading, count=len(own), here=model)
        foils = [c for c in curves if c.model == model and c.kind == READ]
        if foils:
            compatible = sum(c.by_slope or c.by_vertex for c in foils)
            yield said("compatible-either-reading", compatible, count=len(foils), here=model)


def _claims(curves: list[Curve]) -> Iterator[Row]:
    """What Sec. IV says, of the gauge as the other studies have it."""
    for c in curves:
        if (c.nu, c.leaning, (c.y, c.z)) == (NUS[-1], "30", PLACE):
            here = f"{c.kind}, {c.model}"
            yield said("error-between-neighbours", c.error, wanted=ERROR, here=here)  # fmt: skip
            yield said("second-order-range", c.bend, here=here)  # fmt: skip


def _draw_models(figure: Any, curves: list[Curve]) -> None:
    panels = figure.subplots(1, 2)
    models = list(dict.fromkeys(c.model for c in curves))
    for axes, leaning in zip(panels, ("30", "-30"), strict=True):
        mu = np.linspace(0.06, 0.5, 50)
        c = NOISE / ERROR**2
        axes.plot(mu, 1e3 * c * ((mu - 0.5) ** 2 - 0.44**2), "k--", lw=1.5, label="measured, read by the vertex")
        axes.plot([0.4, 0.6], 1e3 * (-c * 0.44**2 + np.array([0.1, -0.1]) * NOISE / ERROR), "k", lw=3.0,
                  label="measured, read by the slope")  # fmt: skip
        for curve in curves:
            if (curve.nu, curve.leaning, (curve.y, curve.z)) == (NUS[-1], leaning, PLACE):
                style = "-" if curve.kind == FREE else ":"
                change = 1e3 * (curve.strain - curve.strain[0])
                label = curve.model if curve.kind == FREE else None
                axes.plot(curve.mu, change, style, color=f"C{models.index(curve.model)}", lw=1.5, label=label)
        axes.axhline(0.0, color="#999999", lw=0.7)
        axes.set(xlabel="friction coefficient mu", ylabel="strain less that at mu = 0.06, 1e-3", ylim=(-9.0, 9.0))
        axes.set_title(f"gauge at {leaning}°, y = 40 mm, z = 0, nu = 0.49")
    figure.legend(*panels[0].get_legend_handles_labels(), title="solid: free strain, dotted: foil of 4 mm",
                  loc="outside lower left", ncols=4, frameon=False)  # fmt: skip


MUS_FOIL = (0.06, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 1.0, 1.2)


def _foil(quick: bool) -> Result:
    """What does the paper's sensor tell of mu in the model nearest to it: 20 mm wide, with its foil, at large
    deformation?

    Source: Maeno 2004, Sec. IV, Fig. 14: a gauge of 30 degrees resolves mu = 0.5 to 0.1 with a strain noise of
    1.5e-4, and a second-order equation goes through the readings. The Fig. 9 finger (nu = 0.49, foil of 4 mm, 0.02
    x 3 mm, 3000 MPa at x = 36, y = 40 mm, both of which the paper does not tell) is pressed 10 mm in ten increments
    with nine values of mu at large deformation (neo-Hookean), in strain_to_friction.py in small strain; the free
    strain is that of the same press without the foil. The error of mu is the noise over the slope of the second-order
    fit at mu = 0.5, as the paper's is, and over the change of the reading between its neighbours: where a parabola
    does not describe the readings, its slope says little.

    Two curves; quick: a coarse mesh and three values of mu.
    """
    mus = np.array(MUS_FOIL[::4] if quick else MUS_FOIL)
    sizes, legs = (5.0, 12.0) if quick else (2.0, 6.0), (Leg(10.0, steps=5 if quick else 10),)
    small = FOIL.apply(fig9_model(0.49, *sizes, legs=legs, friction=Coulomb(0.25), gauges=paper_gauges(FOIL_MM)))
    read = _read(LargeDeformation().apply(small), mus)
    found = {"free": read["g_free"], "foil": read["g"]}
    rows, lines = [], []
    for kind, strain in found.items():
        errors = {"at .5 from a noise of 1.5e-4, second-order fit": _error(mus, strain)}
        errors |= {f"at {mu:g} by the change between neighbours": _local_error(mus, strain, mu) for mu in (0.25, 0.5)}
        for what, error in errors.items():
            rows.append(judged("error-of-mu", error, ERROR, what=what, kind=kind))
        lines += [(kind, mu, value) for mu, value in zip(mus.tolist(), strain, strict=True)]
    rows.append(judged("change-of-the-strain", np.ptp(found["foil"]) / np.ptp(found["free"])))
    return Result(tuple(rows), columns("kind mu strain", lines), lambda figure: _draw_foil(figure, mus, found))


def _error(mus: Float, strain: Float) -> float:
    """Noise over the slope at mu = 0.5 of the parabola through the readings."""
    fit = np.polynomial.Polynomial.fit(mus, strain, 2)
    return NOISE / abs(float(fit.deriv()(0.5)))


def _local_error(mus: Float, strain: Float, mu: float) -> float:
    """Noise over the difference quotient of the readings around mu."""
    k = min(max(int(np.searchsorted(mus, mu)), 1), len(mus) - 2)
    return float(NOISE * (mus[k + 1] - mus[k - 1]) / max(abs(strain[k + 1] - strain[k - 1]), 1e-12))


def _draw_foil(figure: Any, mus: Float, found: dict[str, Float]) -> None:
    grid = np.linspace(min(mus), max(mus), 100)
    for axes, (kind, strain) in zip(figure.subplots(1, 2), found.items(), strict=True):
        fit = np.polynomial.Polynomial.fit(mus, strain, 2)
        axes.plot(mus, 1e3 * strain, "o", label=f"large deformation: mu to {_error(mus, strain):.2g} at .5")
        axes.plot(grid, 1e3 * fit(grid), "C0-", lw=1.0)
        axes.set(xlabel="mu", ylabel="strain, 1e-3", title="free strain" if kind == "free" else "as the foil reads it")


def run(quick: bool) -> Result:
    """All models, then the one nearest to the sensor."""
    return together((12.5, 10.5), models=_models(quick), foil=_foil(quick))
