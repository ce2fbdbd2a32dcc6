"""Do the standard deviation and the 90 % interval of mu hold for readings of sensors within their tolerances?

No source; the readings are presses of the same finger on a mesh four times finer and with more increments than those of
the calibration.  Coefficient of friction, depth and Young's modulus are drawn, the last two with the standard
deviations that the calibration was given, and noise is added.  The finger of Fig. 9 is pressed 10 mm in plane strain
and as a solid 20 mm wide; it has two gauges and a taxel, of which one gauge, or all three, are read.  It is calibrated
on three meshes, the solid with 10 to 80 increments.  z is (estimated - true) / stated standard deviation of mu, where
an estimate is given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.run import calibrated
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Gauge, Leg, Model
from finger3d.mechanics.readings import Taxel
from finger3d.sensor import Estimate, estimate

from ._press import changed, converged, fig9_model
from ._rows import Result, Row, columns, listed, rms

judged = listed(__file__)

Domain = Literal["solid", "plane-strain"]

DEPTH_MM, MU = 10.0, (0.05, 1.0)
ON = {**dict.fromkeys(TOLERANCES, 0.0), "depth_mm": 0.1, "E_percent": 5.0, "mesh": 1.0, "increments": 1.0}
ONE, THREE = ("a",), ("a", "b", "t")
SIZES: dict[Domain, tuple[float, ...]] = {"plane-strain": (0.5, 0.6, 0.75), "solid": (3.0, 3.5, 4.0)}
GAUGES: dict[Domain, tuple[tuple[float, float, float], ...]] = {
    "plane-strain": ((39.2, 41.4, 150.5), (-42.9, 40.3, 45.0)),
    "solid": ((31.0, 39.2, 19.2), (20.0, 30.0, 90.0)),
}
FINER = 4.0
DRAWS: dict[Domain, int] = {"plane-strain": 48, "solid": 12}
JUDGES: dict[Domain, int] = {"plane-strain": 3, "solid": 10}
FEWEST, PLATEAU = 10, 0.8
READ_STEPS: dict[Domain, int] = {"plane-strain": 1, "solid": 120}
COUNTS: dict[Domain, tuple[int, ...]] = {"plane-strain": (1,), "solid": (10, 20, 40, 80)}


class Judged(NamedTuple):
    """A set of readings, and what was made of it."""

    domain: str
    steps: int
    readings: str
    mu: float
    depth_mm: float
    modulus: float
    status: str
    estimated: float
    std: float
    z: float
    inside: bool


def model(domain: Domain, size: float, steps: int) -> Model:
    """Return the finger with two gauges and a taxel."""
    gauges = tuple(
        Gauge(name, x, y, angle=math.radians(a)) for name, (x, y, a) in zip("ab", GAUGES[domain], strict=True)
    )
    legs, taxels = (Leg(DEPTH_MM, steps=steps),), (Taxel("t", 25.0, 0.0, 6.0, 6.0),)
    return fig9_model(0.45, size, 4.0 * size, domain, legs=legs, gauges=gauges, taxels=taxels)


def run(quick: bool) -> Result:
    """Quick: the section on a coarse mesh, whose wide bars hold more than 90 %."""
    random = np.random.default_rng(20261124)
    found: list[Judged] = []
    draws: dict[Domain, int] = {"plane-strain": 24} if quick else DRAWS
    for domain, count in draws.items():
        found += _judged(domain, count, COUNTS[domain], (2.0,) if quick else SIZES[domain], random)
    rows = tuple(_rows(found, "statement" if quick else "verification"))
    names = "domain steps readings mu depth_mm modulus status estimated std z in_90_percent_set"
    return Result(rows, columns(names, found), lambda figure: _draw(figure, found))


def _judged(
    domain: Domain, draws: int, counts: tuple[int, ...], sizes: tuple[float, ...], random: np.random.Generator
) -> Iterator[Judged]:
    """Calibrate on several meshes with several numbers of increments, and judge readings of drawn presses by some."""
    curve = np.linspace(*MU, 25).tolist()
    calibrations = [
        (n, calibrated(model(domain, size, n), THREE, curve, tolerances=ON)[0]) for n in counts for size in sizes
    ]
    body = build(model(domain, min(sizes) / FINER, READ_STEPS[domain]), margin=math.inf)
    for _ in range(draws):
        mu, depth = float(random.uniform(*MU)), DEPTH_MM + ON["depth_mm"] * float(random.normal())
        modulus = 1.0 + 0.01 * ON["E_percent"] * float(random.normal())
        legs = tuple(replace(leg, depth_mm=depth) for leg in body.model.legs)
        last = converged(changed(body, legs=legs, friction=body.model.friction.with_mu(mu)))[-1]
        true = dict(last.named_readings)
        true["t"] *= modulus  # strains under a prescribed depth do not depend on the modulus
        for i in random.choice(len(calibrations), min(JUDGES[domain], len(calibrations)), replace=False):
            steps, joint = calibrations[i]
            noisy = {c.name: true[c.name] + c.noise * float(random.normal()) for c in joint.readings}
            for names in (ONE, THREE):
                answer = estimate(joint, {name: noisy[name] for name in names})[0]
                yield _judgement(domain, steps, names, mu, depth, modulus, answer)


def _judgement(
    domain: str, steps: int, names: tuple[str, ...], mu: float, depth: float, modulus: float, answer: Estimate
) -> Judged:
    told = answer.status in ("ok", "coarse")
    inside = any(low <= mu <= high for low, high in answer.intervals)
    return Judged(
        domain, steps, f"{len(names)}", mu, depth, modulus, answer.status, answer.mu, answer.std,
        (answer.mu - mu) / answer.std if told else math.nan, inside,
    )  # fmt: skip


def _rows(found: list[Judged], kind_of_all: Literal["verification", "statement"]) -> Iterator[Row]:
    yield from _honest("all", found, kind_of_all)
    for domain in dict.fromkeys(one.domain for one in found):
        for readings in dict.fromkeys(one.readings for one in found):
            some = [one for one in found if (one.domain, one.readings) == (domain, readings)]
            name = f"{domain}, {readings} reading{'s' if readings != '1' else ''}"
            yield from _honest(name, some, "statement")
            for part, chosen, kind in (
                (f"mu up to {PLATEAU:g}", [one for one in some if one.mu <= PLATEAU], "verification"),
                (f"mu above {PLATEAU:g}", [one for one in some if one.mu > PLATEAU], "statement"),
            ):
                inside = float(np.mean([one.inside for one in chosen]))
                row = judged("share-of-sets-in-range", inside, name=name, part=part, count=len(chosen))
                yield replace(row, kind=kind)
            share = float(np.mean([one.status in ("ok", "coarse") for one in some]))
            yield judged("share-that-determines-mu", share, name=name)
            wrong = float(np.mean([one.status in ("outside", "contradiction") for one in some]))
            yield judged("share-out-of-range", wrong, name=name)


def _honest(name: str, some: list[Judged], kind: Literal["verification", "statement"]) -> Iterator[Row]:
    """Yield whether z and the 90 % sets are as stated; a group of 12 or 48 presses alone is too few to verify it."""
    z = np.array([one.z for one in some if math.isfinite(one.z)])
    inside = float(np.mean([one.inside for one in some]))
    words = {"name": name, "known": len(z), "count": len(some)}
    rows = [judged("share-of-sets-not-below", inside, **words), judged("share-of-sets-not-above", inside, **words)]
    if len(z) >= FEWEST:
        rows = [judged("z-not-above", rms(z), **words), judged("z-not-below", rms(z), **words), *rows]
    yield from (replace(row, kind=kind) for row in rows)


def _draw(figure: Any, found: list[Judged]) -> None:
    figure.set_size_inches(12.0, 4.8)
    left, right = figure.subplots(1, 2)
    colours = {("plane-strain", "1"): "#92c5de", ("plane-strain", "3"): "#2166ac", ("solid", "1"): "#f4a582",
               ("solid", "3"): "#b2182b"}  # fmt: skip
    for case, colour in colours.items():
        some = [one for one in found if (one.domain, one.readings) == case and math.isfinite(one.z)]
        if some:
            label = f"{case[0].replace('-', ' ')}, {case[1]} reading{'s' if case[1] != '1' else ''}"
            left.plot([one.mu for one in some], [one.z for one in some], ".", ms=5, color=colour, label=label)
            z = np.sort([one.z for one in some])
            right.plot(z, (np.arange(len(z)) + 0.5) / len(z), color=colour, lw=1.5, label=label)
    at = np.linspace(-3.5, 3.5, 200)
    right.plot(at, [0.5 * (1.0 + math.erf(v / math.sqrt(2.0))) for v in at], "--", color="#222222", lw=1.0,
               label="normal distribution")  # fmt: skip
    left.axhspan(-1.0, 1.0, color="#dddddd", lw=0, zorder=0, label="one standard deviation")
    left.set(xlabel="true mu", ylabel="z of mu", ylim=(-4.0, 4.0), title="Error of mu over its standard deviation")
    right.set(xlabel="z of mu", ylabel="share of readings below", xlim=(-3.5, 3.5), title="Distribution of z")
    for axes in (left, right):
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
