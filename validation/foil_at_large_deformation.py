"""What does the paper's sensor tell of mu in the model nearest to it: 20 mm wide, with its foil, at large deformation?

Source: Maeno 2004, Sec. IV, Fig. 14: a gauge of 30 degrees resolves mu = 0.5 to 0.1 with a strain noise of 1.5e-4, and
a second-order equation goes through the readings.  The Fig. 9 finger (nu = 0.49, foil of 4 mm, 0.02 x 3 mm, 3000 MPa at
x = 36, y = 40 mm, both of which the paper does not tell) is pressed 10 mm in ten increments with nine values of mu, in
small strain and at large deformation (neo-Hookean); the free strain is that of the same press without the foil.  The
error of mu is the noise over the slope of the second-order fit at mu = 0.5, as the paper's is, and over the change of
the reading between its neighbours: where a parabola does not describe the readings, its slope says little.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.analyses.pressed_body import presses
from finger3d.contact.friction import Coulomb
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model

from ._press import fig9_finger
from ._rows import Result, at_least, at_most, columns

NOISE, LIMIT, TURN = 1.5e-4, 0.1, math.radians(30.0)
MUS = (0.06, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 1.0, 1.2)
FOIL = EmbeddedGauge(3000.0, 0.02, 3.0)
SMALL, LARGE = "small strain", "large deformation"
FREE, READ = "free", "foil"


def model(quick: bool) -> Model:
    """The finger with the gauge and its mirror image, in small strain."""
    gauges = (Gauge("g", 36.0, 40.0, 0.0, TURN, 4.0), Gauge("m", -36.0, 40.0, 0.0, math.pi - TURN, 4.0))
    mesh = MeshOptions(5.0, 12.0, "swept") if quick else MeshOptions(2.0, 6.0, "swept")
    legs = (Leg(10.0, steps=5 if quick else 10),)
    return FOIL.apply(Model(fig9_finger(), Isotropic(1.0, 0.49), mesh, legs, friction=Coulomb(0.25), gauges=gauges))


def readings(model: Model, mus: tuple[float, ...]) -> dict[str, np.ndarray]:
    """Free strain and that of the foil, and the normal force (N), for every mu."""
    problem = build(model)
    found: dict[str, list[float]] = {FREE: [], READ: [], "force": []}
    for press in sorted(presses(problem, mus), key=lambda press: press.mu):
        if not press.frame.outcome.ok:
            raise AssertionError(f"mu = {press.mu:g}: {press.frame.outcome}")
        found[READ].append(press.frame.gauges["g"])
        found[FREE].append(press.frame.gauges["g_free"])
        state = replace(problem, model=replace(model, friction=model.friction.with_mu(press.mu)))
        found["force"].append(-float(state.world_force(press.frame.meshed_state.contact)[:, 1].sum()))
    return {key: np.array(values) for key, values in found.items()}


def run(quick: bool) -> Result:
    """Four curves; quick: a coarse mesh and three values of mu."""
    mus = MUS[::4] if quick else MUS
    small = model(quick)
    found = {SMALL: readings(small, mus), LARGE: readings(LargeDeformation().apply(small), mus)}
    rows, lines = [], []
    for name, curves in found.items():
        for kind in (FREE, READ):
            error = _error(mus, curves[kind])
            what = f"error of mu at .5 from a noise of 1.5e-4, second-order fit, {kind} strain, {name}"
            rows.append(at_most(what, "Maeno 2004, Sec. IV: 0.1", LIMIT, error, "the paper's claim", "statement"))
            for mu in (0.25, 0.5):
                what = f"error of mu at {mu:g} by the change between neighbours, {kind} strain, {name}"
                rows.append(at_most(what, "Maeno 2004, Sec. IV: 0.1", LIMIT, _local_error(mus, curves[kind], mu),
                                "the paper's claim", "statement"))  # fmt: skip
            lines += [(name, kind, mu, strain) for mu, strain in zip(mus, curves[kind], strict=True)]
    force = found[LARGE]["force"] / found[SMALL]["force"]
    rows.append(at_least("normal force at large deformation over that of small strain, least over all mu", "stiffening",
                    1.0, float(force.min()), "the contact grows faster", "sensitivity"))  # fmt: skip
    stiff = max(np.ptp(found[LARGE][READ]) / np.ptp(found[LARGE][FREE]), 0.0)
    rows.append(at_most("change of the strain over all mu, a foil's over free, large deformation",
                    "a stiffer gauge moves " "less", 1.0, float(stiff), kind="sensitivity"))  # fmt: skip
    return Result(tuple(rows), columns("model kind mu strain", lines), lambda figure: _draw(figure, mus, found))


def _error(mus: tuple[float, ...], strain: np.ndarray) -> float:
    """Noise over the slope at mu = 0.5 of the parabola through the readings."""
    fit = np.polynomial.Polynomial.fit(mus, strain, 2)
    return NOISE / abs(float(fit.deriv()(0.5)))


def _local_error(mus: tuple[float, ...], strain: np.ndarray, mu: float) -> float:
    """Noise over the difference quotient of the readings around mu."""
    k = min(max(int(np.searchsorted(mus, mu)), 1), len(mus) - 2)
    return NOISE * (mus[k + 1] - mus[k - 1]) / abs(float(strain[k + 1] - strain[k - 1]))


def _draw(figure: Any, mus: tuple[float, ...], found: dict[str, dict[str, np.ndarray]]) -> None:
    panels = figure.subplots(1, 2)
    grid = np.linspace(min(mus), max(mus), 100)
    for axes, kind in zip(panels, (FREE, READ), strict=True):
        for k, (name, curves) in enumerate(found.items()):
            fit = np.polynomial.Polynomial.fit(mus, curves[kind], 2)
            axes.plot(mus, 1e3 * curves[kind], f"C{k}o", label=f"{name}: mu to {_error(mus, curves[kind]):.2g} at .5")
            axes.plot(grid, 1e3 * fit(grid), f"C{k}-", lw=1.0)
        axes.set(xlabel="mu", ylabel="strain, 1e-3", title="free strain" if kind == FREE else "as the foil reads it")
