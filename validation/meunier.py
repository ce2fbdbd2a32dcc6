"""Does a law that is fitted to tension tests of a silicone predict its pure shear and equibiaxial tension?

Source: Meunier et al. 2008, validation/REFERENCES.md, 9.3: nominal stress against stretch of an unfilled silicone in
tension, compression, pure shear and equibiaxial tension (a bulge test), as digitised, stretches to 0.01.  `finger3d
identify` fits four laws, Ogden's with two terms, to tension alone, to tension and compression, and to all four tests.
The band of a prediction is two standard deviations of three errors together: those of the constants, to first order and
without their bounds, the scatter of the tension test about its fit, and half a hundredth in the stretch.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.identify.material_tests import MaterialTest, read_material_tests
from finger3d.analyses.identify.run import Identification, identify
from finger3d.fem.laws.base import nominal_stress, principal_stretches

from ._rows import Result, Row, columns, given, listed

judged = listed(__file__)

DATA = Path(__file__).with_suffix(".csv")
STRETCH_SD = 0.005 / np.sqrt(3.0)
"""Standard deviation of a stretch that is rounded to 0.01."""
_KEY = "effects.large_deformation."
GIVEN = given(__file__)
LAWS, FITS = GIVEN["law"], GIVEN["fits"]
"""Constants that are given and bounds of those that are free, by law; and the tests that it is fitted to."""
PREDICTED = ("shear", "equibiaxial")
MODES = {"shear": "pure shear", "equibiaxial": "equibiaxial tension"}
"""Names of tests that are not their own."""


@dataclass(frozen=True)
class Fit:
    """A law fitted to some of the tests."""

    law: str
    tests: str
    found: Identification

    def stress(self, mode: str, stretch: Float, values: Float | None = None) -> Float:
        """Return the nominal stress (n,) MPa at stretches (n,), by default with the values that were found."""
        law = self.found.tested.law((self.found.fitted.values if values is None else values).tolist())
        return nominal_stress(law, principal_stretches(mode, stretch))

    def slopes(self, mode: str, stretch: Float) -> Float:
        """Return the derivatives (n, k) of the stress by the values that were found."""
        values, steps = self.found.fitted.values, 1e-3 * np.diag(self.found.fitted.stds)
        ends = [[self.stress(mode, stretch, values + sign * step) for step in steps] for sign in (-1.0, 1.0)]
        return (np.array(ends[1]) - ends[0]).T / (2.0 * np.diag(steps))

    @cached_property
    def covariance(self) -> Float:
        """Covariance (k, k) of the values by the scatter of the tests about the fit."""
        tests = self.found.tested.tests.items()
        scaled = [self.slopes(test.mode, test.stretch) / self.found.stds[name][:, None] for name, test in tests]
        every = np.concatenate(scaled)
        return np.linalg.inv(every.T @ every)

    def band(self, mode: str, stretch: Float) -> Float:
        """Return two standard deviations (n,) of a measured stress from its prediction."""
        slopes = self.slopes(mode, stretch)
        rise = np.gradient(self.stress(mode, stretch), stretch) * STRETCH_SD
        noise = self.found.stds["tension_stress_MPa"][0]
        return np.asarray(2.0 * np.sqrt(np.sum(slopes @ self.covariance * slopes, axis=1) + noise**2 + rise**2))

    def off(self, test: MaterialTest) -> Float:
        """Return the distances (n,) of the measured stresses from the law, MPa."""
        return np.asarray(test.stress - self.stress(test.mode, test.stretch))

    def misfit(self, test: MaterialTest) -> float:
        """Return the root mean square of these distances over the largest stress of the test."""
        return float(np.sqrt(np.mean(self.off(test) ** 2)) / np.abs(test.stress).max())

    def beyond(self, test: MaterialTest) -> float:
        """Return the largest distance over its band."""
        return float(np.max(np.abs(self.off(test)) / self.band(test.mode, test.stretch)))


def run(quick: bool) -> Result:
    """Quick: two of the laws."""
    tests = {test.mode: test for test in read_material_tests(DATA)}
    with tempfile.TemporaryDirectory() as folder:
        fits = [_fitted(law, own, Path(folder)) for own in FITS for law in list(LAWS)[: 2 if quick else None]]
    lines = [
        (f.law, f.tests, mode, f.found.fitted.values[0], f.misfit(test), f.beyond(test))
        for f in fits
        for mode, test in tests.items()
    ]
    table = columns("law fitted_to test E_MPa misfit distance_over_band", lines)
    return Result(tuple(_rows(fits, tests)), table, lambda figure: _draw(figure, fits, tests))


def _fitted(law: str, own: str, folder: Path) -> Fit:
    scene = GIVEN["scene"] | {"effects": {"large_deformation": {"law": law, **LAWS[law]["given"]}}}
    rows = [line for line in DATA.read_text("utf-8").splitlines() if line.split(",")[-1] in ("mode", *FITS[own])]
    measured = folder / f"{own}.csv"
    measured.write_text("\n".join(rows) + "\n", "utf-8")
    bounds = {"material.E_MPa": (0.2, 5.0), **{_KEY + key: tuple(ends) for key, ends in LAWS[law]["free"].items()}}
    return Fit(law, own, identify(scene, measured, bounds, folder / f"{own} {law}"))


def _rows(fits: list[Fit], tests: dict[str, MaterialTest]) -> Iterator[Row]:
    """What fits, and how far off the predictions are."""
    for fit in fits:
        own = FITS[fit.tests]
        yield judged("fit", max(fit.misfit(tests[mode]) for mode in own), law=fit.law, tests=fit.tests)
        for mode in PREDICTED if "shear" not in own else ():
            words = {"law": fit.law, "tests": fit.tests, "mode": MODES[mode], "rms": 100.0 * fit.misfit(tests[mode])}
            yield judged("prediction", fit.beyond(tests[mode]), **words)
    yield judged("incompressible", _compression_as_equibiaxial(tests))
    stable = [fit.found.tested.stable(fit.found.fitted.values) for fit in fits]
    yield judged("stable", sum(one["over_measured_range"] for one in stable), len(fits), count=len(fits))


def _compression_as_equibiaxial(tests: dict[str, MaterialTest]) -> float:
    """Return the largest distance of the equibiaxial stress from that of compression, over the largest of both.

    A pressure that adds to the equibiaxial Cauchy stress ``P l`` makes it the compression to a stretch of 1/l^2.
    """
    press, pull = tests["compression"], tests["equibiaxial"]
    at = press.stretch**-0.5
    from_compression = -press.stress * press.stretch / at
    both = pull.stretch <= at.max()
    off = np.interp(pull.stretch[both], at[::-1], from_compression[::-1]) - pull.stress[both]
    return float(np.abs(off).max() / pull.stress[both].max())


def _draw(figure: Any, fits: list[Fit], tests: dict[str, MaterialTest]) -> None:
    """Draw the tests by column, and what the laws are fitted to by row; only predictions have bands."""
    figure.set_size_inches(12.5, 7.5)
    rows = list(FITS)[:2]
    for line, own in zip(figure.subplots(2, 4), rows, strict=True):
        for axes, (mode, test) in zip(line, tests.items(), strict=True):
            end = test.stretch.min() if mode == "compression" else test.stretch.max()
            at = np.linspace(1.0, end, 100)
            for i, fit in enumerate(f for f in fits if f.tests == own):
                curve, band = fit.stress(mode, at), fit.band(mode, at)
                axes.plot(at, curve, color=f"C{i}", lw=1.4, label=fit.law.title())
                if mode not in FITS[own]:
                    axes.fill_between(at, curve - band, curve + band, color=f"C{i}", alpha=0.15, lw=0)
            axes.plot(test.stretch, test.stress, "ko", ms=3.5, label="measured")
            axes.set(xlabel="stretch", ylabel="nominal stress (MPa)")
            kind = "fitted" if mode in FITS[own] else "predicted"
            axes.set_title(f"{MODES.get(mode, mode)}, {kind}\nlaws fitted to {own}", fontsize=9)
        line[0].legend(frameon=False, fontsize=8)
