"""Does the error that a calibration states for mesh and increments agree with the error of readings?

No source; the readings are presses of the same section with more increments than the calibration's, on its mesh and on
one of half the edge length, at coefficients of friction drawn between the calibrated ones, with noise added.  A half
cylinder of 5 mm in plane strain is pressed 1 mm by a cylinder of 25 mm, since increments leave no error under a flat
object; six gauges; 10, 20 and 40 increments, and as many as "auto" chooses.  Nothing else that is not known is drawn,
so all other tolerances are left out.  z is (reading - curve) / standard deviation of a reading, at the true mu; of mu
(estimated - true) / stated, where an estimate is given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.calibrate.tolerances import read
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.step_halving import increment_error
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import Cylinder
from finger3d.sensor import Calibration, estimate

from ._rows import Result, Row, columns, listed, rms

judged = listed(__file__)

Steps = int | Literal["auto"]

NOISE, RANGE = 1.5e-4, (0.05, 1.2)
ON = {**dict.fromkeys(TOLERANCES, 0.0), "mesh": 1.0, "increments": 1.0}
SAME, FINER = "same mesh", "finer mesh"
LEVELS = (10, 20, 40, 80, 160)


class Reading(NamedTuple):
    """One reading of a calibrated gauge, and what was made of it."""

    nu: float
    steps: Steps
    mesh: str
    read_steps: int
    gauge: str
    mu: float
    z: float
    z_without: float
    z_mu: float
    inside: bool


def gauges() -> tuple[Gauge, ...]:
    """On an arc 0.5 mm under the surface, each place along x and along 45 degrees."""
    places = [(4.5 * math.sin(t), 4.5 * math.cos(t), t) for t in np.radians((10.0, 25.0, 40.0))]
    return tuple(
        Gauge(f"{math.degrees(t):.0f}:{a:.0f}", float(x), float(y), 0.0, math.radians(a), 0.0)
        for x, y, t in places
        for a in (0.0, 45.0)
    )


def model(nu: float, size: float, steps: Steps) -> Model:
    """The section with all gauges."""
    body = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    return Model(
        body, Isotropic(1.0, nu), MeshOptions(size, 5.0 * size, "swept"), (Leg(1.0, steps=steps),),
        object=Cylinder(radius_mm=25.0), gauges=gauges(), domain="plane-strain",
    )  # fmt: skip


def run(quick: bool) -> Result:
    """Quick: one nu, three gauges, 10 increments."""
    random = np.random.default_rng(20261123)
    nus, counts, size = ((0.45,), (10,), 0.3) if quick else ((0.3, 0.49), (10, 20, 40, "auto"), 0.1)
    found, bare = [], {}
    for nu in nus:
        mus = np.sort(random.uniform(*RANGE, 5 if quick else 12))
        for steps in counts if nu == nus[-1] else counts[:3]:  # chosen increments take longest, and once is enough
            found += _readings(nu, size, steps, mus, random, bare, quick)
    rows = list(_rows(found))
    rows += [] if quick else [_compared(nus[-1], size)]
    names = "nu steps mesh read_steps gauge mu z z_without_increments z_mu in_set"
    return Result(tuple(rows), columns(names, found), lambda figure: _draw(figure, found))


def _readings(
    nu: float, size: float, steps: Any, mus: Float, random: np.random.Generator, bare: dict[Any, Float], quick: bool
) -> Iterator[Reading]:
    """Every gauge calibrated, and read at `mus` in presses with more increments, on its mesh and on a finer one."""
    curve = np.linspace(*RANGE, 17 if quick else 25)
    some = gauges()[1::3] if quick else gauges()
    found = {}
    for gauge in some:
        c, points = calibrated(model(nu, size, steps), gauge.name, curve, tolerances=ON)
        own = int(points.increments.legs[0].steps)
        found[gauge.name] = c, own
    for mesh, edge in ((SAME, size), (FINER, 0.5 * size)):
        for name, (c, own) in found.items():
            for times in (2, 8) if steps != "auto" else (2,):
                at = times * own
                key = (nu, edge, at)
                if key not in bare:
                    bare[key] = _pressed(nu, edge, at, mus)
                number = [g.name for g in gauges()].index(name)
                yield from _judged(nu, steps, mesh, at, c, mus, bare[key][number], random)


def _pressed(nu: float, size: float, steps: int, mus: Float) -> Float:
    """Strain (g, m) of all gauges at mus (m,)."""
    return read(build(model(nu, size, steps)), tuple(g.name for g in gauges()), mus)


def _judged(
    nu: float, steps: Steps, mesh: str, at: int, c: Calibration, mus: Float, strain: Float, random: np.random.Generator
) -> Iterator[Reading]:
    """Readings with noise against the curve; on the same mesh its tolerance is left out."""
    keep = ("increments",) if mesh == SAME else ("mesh", "increments")
    curve = c.readings[0]
    known = replace(curve, tolerances=tuple(t for t in curve.tolerances if t.name in keep))
    without = replace(curve, tolerances=tuple(t for t in known.tolerances if t.name != "increments"))
    noisy = strain + random.normal(0.0, NOISE, len(mus))
    for mu, reading, answer in zip(mus, noisy, estimate(replace(c, readings=(known,)), noisy), strict=True):
        away = reading - float(curve.at(mu))
        z_mu = (answer.mu - mu) / answer.std if answer.is_determined else math.nan
        inside = any(low <= mu <= high for low, high in answer.intervals)
        z, z_without = (away / float(one.reading_sd([mu])[0]) for one in (known, without))
        yield Reading(nu, steps, mesh, at, curve.name, float(mu), z, z_without, z_mu, inside)


def _rows(found: list[Reading]) -> Iterator[Row]:
    """Root mean square of z by increments and mesh, each near 1; and the largest there would be otherwise."""
    for steps in dict.fromkeys(r.steps for r in found):
        for mesh in (SAME, FINER):
            some = [r for r in found if r.steps == steps and r.mesh == mesh]
            what = f"calibrated with {steps} increments, read with more, {mesh}, {len(some)} readings"
            yield from _near_one(f"rms of z of the strain: {what}", np.array([r.z for r in some]))
            z_mu = np.array([r.z_mu for r in some if math.isfinite(r.z_mu)])
            if len(z_mu) > 10:
                yield from _near_one(f"rms of z of mu: {what}, {len(z_mu)} with an estimate of mu", z_mu)
            share = float(np.mean([r.inside for r in some]))
            yield judged("share-of-90-sets-that-contain", share, what=what)
            worst = float(np.abs([r.z_without for r in some]).max())
            yield judged("largest-z", worst, what=what)


def _near_one(what: str, z: Float) -> Iterator[Row]:
    """Yield two rows: the stated errors are not too small, and they are not much too large."""
    yield judged("not-above", rms(z), what=what)
    yield judged("not-less-than-half", rms(z), what=what)


def _compared(nu: float, size: float) -> Row:
    """How often the comparison with half as many increments is an upper bound; the true strain is that of 640."""
    mus = np.linspace(0.3, 1.2, 10)
    strains = {n: _pressed(nu, size, n, mus) for n in (*LEVELS, 640)}
    stated = np.array([increment_error(strains[b], strains[b // 2], 0.5) for b in LEVELS[1:]])
    off = np.array([np.abs(strains[b] - strains[640]) for b in LEVELS[1:]])
    big = off > 0.1 * NOISE
    return judged("share-of-strains-in-error-by", float(np.mean(off[big] <= 2.0 * stated[big])))


def _draw(figure: Any, found: list[Reading]) -> None:
    figure.set_size_inches(12.0, 4.8)
    left, right = figure.subplots(1, 2)
    cases = list(dict.fromkeys((r.steps, r.mesh) for r in found))
    for k, (steps, mesh) in enumerate(cases):
        some = [r for r in found if (r.steps, r.mesh) == (steps, mesh)]
        where = k + np.random.default_rng(k).uniform(-0.3, 0.3, len(some))
        for which, colour, label in (
            ("z_without", "#aaaaaa", "without the tolerance of the increments"),
            ("z", "#2166ac", "with all tolerances"),
        ):
            size = np.abs([getattr(r, which) for r in some])
            left.semilogy(where, size, ".", ms=3, color=colour, label=None if k else label)
    left.set(xticks=range(len(cases)), xlabel="increments of the calibration, mesh of the reading")
    left.set(ylabel="|z| of the strain", ylim=(1e-2, None), title="Error over its standard deviation")
    left.set_xticklabels([f"{s} {m}".replace(" ", "\n") for s, m in cases], fontsize=8)
    for mesh, color in ((SAME, "#2166ac"), (FINER, "#d95f02")):
        some = [r for r in found if r.mesh == mesh]
        right.plot([r.mu for r in some], [r.z for r in some], ".", ms=4, color=color, label=f"read on the {mesh}")
    right.axhspan(-1.0, 1.0, color="#dddddd", lw=0, zorder=0, label="one standard deviation")
    right.set(xlabel="true mu", ylabel="z of the strain", title="The same errors over mu")
    for axes in (left, right):
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, frameon=False)
