"""Is an object of unknown friction lifted without slip, and hardly harder than it must be, by a finger that reads mu?

No source but Coulomb's law: a flat contact holds the tangential force Q if mu N >= Q, so that Q / mu is the least
normal force.  The finger of docs/tutorials/hold.py, in plane strain, is calibrated once by the gauge g36 at a depth of
10 mm.  Then objects are drawn: a weight from 0.3 to 3 kg, mu in the range that the gauge resolves, and the noise of the
strain, of a standard deviation s from 0.00025 to 0.001.  Weight and s are uniform in their logarithms, mu is uniform.
For each the finger is pressed 10 mm, its strain is read 25 times with errors drawn from N(0, s^2), mu is estimated from
their mean with its standard deviation, and the object is lifted: normal force Q / (mu - 3 std), then the tangential
force Q, half of the weight.  Three standard deviations fail once in 741 objects. An estimate that says that mu is not
determined is not acted on; the hand then looks for another place, and the object counts apart.  Every tolerance but the
noise is left out, as in the tutorial, and the readings are those of the calibrated model on its exact path.

One reading is too few where mu is small, because the gauge tells little there.  The standard deviation of mu is the
noise over the slope of the strain against mu, to a few percent in the median; the slope is 0.055 below mu = 0.17 and
0.13 above 0.2, so that three deviations of one reading are up to half of mu at mu = 0.1.  The normal force that follows
from the first reading alone is counted as well.

Each object is also held by 0.999 of the least force, under which the whole contact must slip.  Last, a tangential force
is held for 1000 increments, by the section and by the solid 20 mm wide: nothing may move.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.calibrate.settings import MUS
from finger3d.contact.friction import Coulomb
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, largest_force, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Gauge, Leg, Model
from finger3d.sensor import Calibration, Estimate, estimate

from ._exact_path import exact_press
from ._press import changed, fig9_model
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

DEPTH, STEPS, DEVIATIONS, LIMIT = 10.0, 4, 3.0, 0.1
BELOW = 0.999  # of the least normal force: slips
READINGS = 25  # of each object, as in the tutorial; three standard deviations of their mean are small beside mu
HELD_N, HELD_MU = 50.0, 0.5  # of the long hold, under half of the largest tangential force
NOISE, WEIGHT = (2.5e-4, 1e-3), (0.3, 3.0)  # kg
G = 9.81
COLUMNS = "weight_kg mu noise mu_read mu_std status normal_N least_N slips used single_N"


class Lift(NamedTuple):
    """An object and its lift; forces in N; without a normal force if mu was not determined.

    `single` is the normal force after the first reading alone, without a lift.
    """

    weight_kg: float
    mu: float
    noise: float
    mu_read: float
    mu_std: float
    status: str
    normal: float
    least: float
    slips: bool
    used: float
    single: float

    @property
    def ratio(self) -> float:
        """Normal force over the least."""
        return self.normal / self.least


def model(domain: Domain, size: float) -> Model:
    """The finger of docs/tutorials/hold.py."""
    gauges = (Gauge("g36", 36.0, 40.0, 0.0, math.radians(30.0)),)
    return fig9_model(0.49, size, 4.0 * size, domain, gauges=gauges)


def held(domain: Domain, size: float) -> Problem:
    """The finger, meshed for a path that leaves the middle, so that no symmetry is used."""
    finger = model(domain, size)
    return build(replace(finger, legs=(*finger.legs, Leg(DEPTH, 1.0))))


def pressed(problem: Problem, mu: float, legs: tuple[Leg, ...]) -> list[StepResult]:
    """All increments of a path."""
    return list(march(changed(problem, friction=Coulomb(mu), legs=legs)))


def lifting(normal: float, load: float) -> tuple[Leg, Leg]:
    """Press by the normal force, then lift by the load."""
    press = Leg(DEPTH, steps=STEPS, force_N=normal)
    return press, replace(press, force_x_N=-load)


def lifted(problem: Problem, calibration: Calibration, weight: float, mu: float, noise: float, errors: Float) -> Lift:
    """Read mu, and lift; errors : (`READINGS`,) of the strain."""
    load, least = 0.5 * weight * G, 0.5 * weight * G / mu
    once = replace(problem.model, friction=Coulomb(mu), legs=(Leg(DEPTH, steps=1),))
    (press,) = exact_press(replace(problem, model=once))
    strain = measure(problem.points, press)["gauges"]["g36"]
    found, first = (
        estimate(calibration, strain + x.mean(), noise / math.sqrt(len(x)), tolerances=False)[0]
        for x in (errors, errors[:1])
    )
    normal, single = chosen_force(load, found), chosen_force(load, first)
    if math.isnan(normal):
        return Lift(weight, mu, noise, found.mu, found.std, found.status, normal, least, False, math.nan, single)
    (*_, last) = pressed(problem, mu, lifting(normal, load))
    if last.outcome is not Outcome.SLIPS:
        assert last.outcome.ok, last.detail
        np.testing.assert_allclose(measure(problem.points, last)["force_x_N"], -load, rtol=1e-9)
    most, _ = largest_force(problem.points, last.state, Coulomb(mu), np.array([1.0, 0.0, 0.0]))
    used = abs(measure(problem.points, last)["tangential_force_x_N"]) / most if last.outcome.ok else math.nan
    slips = not last.outcome.ok
    return Lift(weight, mu, noise, found.mu, found.std, found.status, normal, least, slips, used, single)


def chosen_force(load: float, found: Estimate) -> float:
    """Normal force (N) for a load, with a margin of `DEVIATIONS`; NaN if the reading does not determine mu."""
    known = found.status == "ok" and found.mu > DEVIATIONS * found.std
    return load / (found.mu - DEVIATIONS * found.std) if known else math.nan


def creep(problem: Problem, count: int) -> float:
    """Largest change in a hold of `count` increments, mm."""
    press, lift = lifting(HELD_N, 0.5 * HELD_MU * HELD_N)
    steps = pressed(problem, HELD_MU, (press, lift, replace(lift, steps=count)))
    assert len(steps) == 2 * STEPS + count
    assert all(step.outcome.ok for step in steps)
    return largest_change(problem, steps[2 * STEPS - 1 :])


def largest_change(problem: Problem, steps: list[StepResult]) -> float:
    """Largest change (mm) since the first of some increments, of depth, slides, and gaps, slips and displacements."""
    largest, first, start = 0.0, steps[0].target, steps[0].meshed_state.contact
    for step in steps[1:]:
        end = step.meshed_state.contact
        changes = [
            step.target.coordinates[:3] - first.coordinates[:3],
            end.gap - start.gap,
            end.tangential_displacement - start.tangential_displacement,
            end.accumulated_slip - start.accumulated_slip,
            np.einsum("idje,je->id", problem.delassus, end.force - start.force),
        ]
        largest = max(largest, *(float(np.abs(change).max()) for change in changes))
    return largest


def run(quick: bool) -> Result:
    """Quick: a coarse mesh, 10 objects, 20 increments of the hold."""
    size, count, hold = (4.0, 10, 20) if quick else (2.0, 200, 1000)
    off = dict.fromkeys(TOLERANCES, 0.0)
    mus = MUS[::2] if quick else MUS
    calibration, _ = calibrated(model("plane-strain", size), "g36", mus, {"gauge": NOISE[1]}, LIMIT, off)
    section, (low, high) = held("plane-strain", size), calibration.usable[0]
    random = np.random.default_rng(20261126)
    lifts = []
    for _ in range(count):
        weight, noise = (float(np.exp(random.uniform(*np.log(ends)))) for ends in (WEIGHT, NOISE))
        mu, errors = float(random.uniform(low, high)), random.normal(0.0, noise, READINGS)
        lifts.append(lifted(section, calibration, weight, mu, noise, errors))
    creeps = {"section": creep(section, hold)}
    if not quick:
        creeps["20 mm wide"] = creep(held("solid", 4.0), hold)
    rows = _rows(lifts, dropped(section, lifts))
    rows += [judged("largest-change-of-any-pose-gap", mm, count=hold, name=name) for name, mm in creeps.items()]
    return Result(tuple(rows), columns(COLUMNS, lifts), lambda figure: _draw(figure, lifts))


def dropped(problem: Problem, lifts: list[Lift]) -> Float:
    """Force that each object's press says can be held at `BELOW` of the least normal force, over mu N; NaN if held."""
    found = []
    for x in lifts:
        load, normal = x.mu * x.least, BELOW * x.least
        (*_, last) = pressed(problem, x.mu, lifting(normal, load))
        said = re.search(r"holds at most (\S+) N", last.detail) if last.outcome is Outcome.SLIPS else None
        found.append(float(said[1]) / (x.mu * normal) if said else math.nan)
    return np.array(found)


def _rows(lifts: list[Lift], said: Float) -> list[Row]:
    acted = [x for x in lifts if math.isfinite(x.normal)]
    safe = np.mean([not x.slips for x in acted])
    wrong = sum(x.slips != (x.normal < x.least) for x in acted)
    ratios = np.array([x.ratio for x in acted])
    alone = np.array([x.single / x.least for x in lifts if math.isfinite(x.single)])
    here = f"{len(acted)} of {len(lifts)} objects whose mu the gauge determines"
    return [
        judged("share-lifted-without-slip", float(safe), here=here),
        judged("lifts-whose-outcome-is-not-coulomb", float(wrong), here=here),
        judged("normal-force-over-the-least-median", float(np.median(ratios)), here=here),
        judged("normal-force-over-the-least-largest", float(ratios.max()), here=here),
        judged("normal-force-over-the-least-by", float(alone.max()), count=len(alone)),
        judged("share-held", float(np.mean(alone <= 1.3)), count=len(alone)),
        judged("objects-held-at-0-999", float(np.isnan(said).sum()), count=len(lifts)),
        judged("largest-force-that-these-can-hold", float(said[np.argmax(np.abs(said - 1.0))])),
    ]


def _draw(figure: Any, lifts: list[Lift]) -> None:
    axes = figure.subplots()
    acted = [x for x in lifts if math.isfinite(x.normal)]
    slips = [x for x in acted if x.slips]
    drawn = axes.scatter([x.mu for x in acted], [x.ratio for x in acted], c=[1e3 * x.noise for x in acted], s=14)
    axes.plot([x.mu for x in slips], [x.ratio for x in slips], "rx", ms=10, label="slips")
    axes.axhline(1.0, color="k", lw=0.8, label="least, by Coulomb's law")
    axes.axhline(1.3, color="k", lw=0.8, ls=":", label="1.3 times the least")
    axes.set(xlabel="mu of the object", ylabel="normal force over the least")
    axes.set_title(f"{len(acted) - len(slips)} of {len(acted)} lifted without slip")
    figure.colorbar(drawn, ax=axes, pad=0.01).ax.set_title("noise,\n1e-3", fontsize=8)
