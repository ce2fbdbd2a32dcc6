"""Does the friction that a finger reads tell how hard an object must be held, and is a held object still?

No source.  The finger of Maeno 2004, Fig. 9, in plane strain, is pressed 10 mm on a plane and reads mu from gauge g36,
with noise.  An object of weight W between two such fingers is one finger on a plane with half the weight.  The normal
force is then P = W/2 / (mu - 3 s), s being the standard deviation that the estimate states; the least one is W/2 / mu
(Coulomb).  The finger is pressed anew with P, and the weight applied as a tangential force; the object is lifted if all
increments converge.  Weights, mu and the noise are drawn; readings are those of the calibrated curve, so that noise
is the only error of mu.

A force that is held for 1000 increments must not move the object.  A flat contact slips as a whole at mu P (Coulomb),
and one under a ball at what the normal forces of its points allow (Goyal, Ruina and Papadopoulos 1991).  Cattaneo's and
Mindlin's problems by forces are compared with the same by the slides that the forces gave.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.contact.friction import Coulomb
from finger3d.errors import Outcome
from finger3d.fem.solids.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.results.slip_limit import slip_limit
from finger3d.objects import Cylinder, RigidObject, Sphere
from finger3d.sensor import estimate

from ._rows import Result, Row

WEIGHT, MU, NOISE = (10.0, 60.0), (0.2, 0.6), (1e-4, 6e-4)  # N, 1, strain
DEVIATIONS = 3.0
COULOMB, GOYAL = "Coulomb", "Goyal, Ruina and Papadopoulos 1991"
SAME = "the same increments"


@dataclass(frozen=True)
class Lift:
    """One object: weight (N), mu and its estimate, normal force (N), whether it was lifted."""

    weight: float
    mu: float
    estimate: float
    std: float
    normal: float
    lifted: bool

    @property
    def excess(self) -> float:
        """Normal force over the least one."""
        return self.normal * self.mu / (0.5 * self.weight)


def finger(size: float) -> Model:
    """The section of Fig. 9 with its gauge."""
    design = designs()["clipped_cylinder"](
        radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0
    )  # fmt: skip
    gauges = (Gauge("g36", 36.0, 40.0, 0.0, math.radians(30.0)),)
    mesh = MeshOptions(size, 8.0, "swept")
    return Model(design, Isotropic(1.0, 0.49), mesh, (Leg(10.0, steps=10),), gauges=gauges, domain="plane-strain")


def block(obj: RigidObject, domain: Any, size: float) -> Model:
    """A block under a cylinder (Cattaneo 1938) or a ball (Mindlin 1949)."""
    design = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=8.0)
    legs = (Leg(0.2, steps=4, force_N=0.4), Leg(0.2, slide_x_mm=0.1, steps=4, force_N=0.4, force_x_N=0.06))
    mesh = MeshOptions(size, 1.2, "swept")
    return Model(design, Isotropic(1.0, 0.3), mesh, legs, object=obj, friction=Coulomb(0.25), domain=domain)


def pressed(problem: Problem, legs: tuple[Leg, ...], mu: float) -> list[StepResult]:
    """All increments of a path."""
    return list(march(replace(problem, model=replace(problem.model, legs=legs, friction=Coulomb(mu)))))


def held(normal: float, tangential: float, steps: int = 4) -> tuple[Leg, Leg]:
    """Press by a normal force, then apply a tangential one."""
    press = Leg(10.0, steps=4, force_N=normal)
    return press, replace(press, steps=steps, force_x_N=tangential)


def run(quick: bool) -> Result:
    """Quick: 20 objects, coarse meshes, 100 increments of hold."""
    count, size = (10, 4.0) if quick else (200, 2.0)
    lifts = _lifts(finger(size), count)
    excess = np.array([lift.excess for lift in lifts])
    rows = [
        Row(f"share of {count} objects that are lifted", COULOMB, 0.99, float(np.mean([lift.lifted for lift in lifts])),
            0.0, f"{DEVIATIONS:g} standard deviations fail once in 741", measure="at least"),
        Row("largest normal force over the least", COULOMB, 1.3, float(excess.max()), 0.0,
            "twice 3 standard deviations of mu, of up to 0.03 mu", measure="at most"),
        *_whole_slip(build(replace(finger(size), legs=held(*WEIGHT))), quick),
        *_by_slides("Cattaneo, cylinder", block(Cylinder(radius_mm=4.0), "plane-strain", 0.4 if quick else 0.2)),
        *_by_slides("Mindlin, ball", block(Sphere(radius_mm=4.0), "solid", 0.8 if quick else 0.5)),
    ]  # fmt: skip
    table = {
        name: [getattr(lift, name) for lift in lifts]
        for name in ("weight", "mu", "estimate", "std", "normal", "excess", "lifted")
    }
    return Result(tuple(rows), table, lambda figure: _draw(figure, lifts))


def _lifts(model: Model, count: int) -> list[Lift]:
    random = np.random.default_rng(20261126)
    weight, mu, noise = (random.uniform(*bounds, count) for bounds in (WEIGHT, MU, NOISE))
    sensor, _ = calibrated(model, "g36", np.linspace(0.1, 0.8, 29), tolerances=dict.fromkeys(TOLERANCES, 0.0))
    problem = build(replace(model, legs=(*model.legs, *held(*WEIGHT))))  # not symmetric
    strain = sensor.readings[0].at(mu) + noise * random.normal(size=count)
    out = []
    for k, answer in enumerate(estimate(sensor, strain, noise, tolerances=False)):
        normal = 0.5 * weight[k] / (answer.mu - DEVIATIONS * answer.std)
        steps = pressed(problem, held(normal, 0.5 * weight[k], steps=1), mu[k])
        out.append(Lift(weight[k], mu[k], answer.mu, answer.std, normal, all(step.outcome.ok for step in steps)))
    return out


def _whole_slip(problem: Problem, quick: bool) -> list[Row]:
    """Force at which a flat contact slips as a whole, and creep below it."""
    mu, normal = 0.3, 40.0
    just = [pressed(problem, held(normal, share * mu * normal), mu) for share in (1.0 - 1e-6, 1.0 + 1e-6)]
    reached = measure(problem.points, just[0][-1])["force_x_N"] / (mu * normal)
    count = 50 if quick else 1000
    press, lift = held(normal, 0.7 * mu * normal)
    steps = pressed(problem, (press, lift, replace(lift, steps=count)), mu)
    creep = np.ptp([step.target.slide_x_mm for step in steps[7:]])
    return [
        Row("force held just below the limit, over mu P", COULOMB, 1.0 - 1e-6, reached, 1e-9, "the search's tolerance"),
        Row("just above it the whole contact slips", COULOMB, 1.0, float(just[1][-1].outcome is Outcome.SLIPS), 0.0,
            "yes or no"),
        Row(f"creep of the object in {count} increments of hold, mm", "equilibrium", 1e-12, float(creep), 0.0,
            "round-off of places", measure="at most"),
    ]  # fmt: skip


def _by_slides(name: str, model: Model) -> list[Row]:
    """Forces against the slides found, and the largest force held against the limit surface."""
    problem = build(model)
    steps = pressed(problem, model.legs, model.friction.mu)
    places = [step.target for step in steps]
    legs = tuple(Leg(at.depth_mm, at.slide_x_mm, at.slide_z_mm, steps=1) for at in places)
    again = [measure(problem.points, step) for step in pressed(problem, legs, model.friction.mu)]
    by_force = [measure(problem.points, step) for step in steps]
    keys = ("normal_force_N", "force_x_N", "friction_sum_N", "external_work_mJ")
    away = max(
        abs(a[key] - b[key]) / abs(by_force[-1][key]) for a, b in zip(by_force, again, strict=True) for key in keys
    )
    limit = slip_limit(problem.points, steps[-1].state, model.friction)
    assert limit is not None
    press, lift = model.legs
    shares = np.array([0.95, 1.05])
    ends = [
        pressed(problem, (press, replace(lift, force_x_N=share * limit.tangential_force_x_N)), model.friction.mu)[-1]
        for share in shares
    ]
    between = float(ends[0].outcome.ok and ends[1].outcome is Outcome.SLIPS)
    return [
        Row(f"largest difference of forces and work from the press by slides, {name}", SAME, 0.0, away, 1e-8,
            "the contact's residual", measure="absolute"),
        Row(f"95 % of the slip limit at 60 % of it is held and 105 % is not, {name}", GOYAL, 1.0, between, 0.0,
            "yes or no; normal forces on a curved object move with it, which changes the limit by up to 2.5 %"),
    ]  # fmt: skip


def _draw(figure: Any, lifts: list[Lift]) -> None:
    left, right = figure.subplots(1, 2)
    mu = np.array([lift.mu for lift in lifts])
    left.errorbar(mu, [lift.estimate for lift in lifts], [DEVIATIONS * lift.std for lift in lifts], fmt=".", lw=0.7)
    left.plot(MU, MU, "k--", lw=0.8, label="equal")
    left.set(xlabel="coefficient of friction", ylabel=f"estimate, bars of {DEVIATIONS:g} standard deviations")
    left.legend()
    for lifted, name in ((True, "lifted"), (False, "slipped")):
        some = [lift for lift in lifts if lift.lifted == lifted]
        right.plot([lift.mu for lift in some], [lift.excess for lift in some], ".", label=f"{len(some)} {name}")
    right.axhline(1.0, color="k", ls="--", lw=0.8)
    right.set(xlabel="coefficient of friction", ylabel="normal force / least")
    right.legend()
