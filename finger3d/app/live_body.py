"""A condensed finger that is pressed again for every change of friction, depth or gauge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Array, Float, freeze_arrays
from finger3d.accuracy.changes import changing_numbers, two_digits
from finger3d.accuracy.model_error import Judgement, at_large_deformation
from finger3d.analyses.calibrate.tolerance_table import GAUGE_PLACES, TOLERANCES
from finger3d.analyses.calibrate.tolerances import displaced_gauges, tolerance_of
from finger3d.analyses.pressed_body import PressedBody, under
from finger3d.effects import LARGE_DEFORMATION
from finger3d.errors import Finger3dError
from finger3d.fem.recovery import displacement
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, contact_table, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.readings import Gauge, of_kind
from finger3d.plotting.figures import middle_line
from finger3d.progress import QUIET, Progress
from finger3d.sensor.curve import ReadingCurve
from finger3d.sensor.model import SensorModel

if TYPE_CHECKING:
    from finger3d.scene import Scene

STEPS = 10
"""Increments of every press of a scene that slides or turns the object; those of other scenes are the scene's own."""

MU_STEP = 0.02
"""Distance of the values of mu that the strain is calibrated at."""

_KEPT = 64  # presses; a slider that goes back finds them
_ALONG = ("x_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa", "status")
_NUMBERS = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")


@dataclass(frozen=True)
class LivePress:
    """End of a press.

    Attributes
    ----------
    numbers : normal force, friction sum, half the lengths of contact and stick, as in `steps` of summary.json
    z_mm : place of the line along x that the traction is given on, as in the picture of a press
    x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa : (p,) traction on the finger along that line, ascending in x
    status : (p,) "open", "stick" or "slip"
    displacement : (n, d) mm, of the meshed part
    """

    numbers: dict[str, float]
    z_mm: float
    x_mm: Float
    pressure_MPa: Float
    shear_x_MPa: Float
    shear_z_MPa: Float
    status: Array
    displacement: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class LiveReading:
    """Reading of a gauge, and the standard deviation of mu, as a calibration at three values of mu has them.

    Attributes
    ----------
    strain : of the gauge
    slope : d strain / d mu
    strain_sd : standard deviation of the strain by noise, and by the tolerances of place and direction
    mu_sd : standard deviation of mu, as in a calibration; infinite where the slope is zero
    """

    strain: float
    slope: float
    strain_sd: float
    mu_sd: float


@dataclass(frozen=True, eq=False)
class LiveBody:
    """A finger condensed to its contact points, pressed straight down.

    Attributes
    ----------
    title : of the scene
    problem : condensed for the largest depth
    largest_depth_mm : depth that the scene's own press ends at
    steps : increments of every press
    remark : that presses are in small strain, and what large deformation would change at the largest depth
    """

    title: str
    problem: Problem
    largest_depth_mm: float
    steps: int
    remark: str = ""

    @classmethod
    def of(cls, scene: Scene, report: Progress = QUIET) -> LiveBody:
        """Condense the finger of a scene.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time, or if there are two fingers.
        """
        model = scene.with_effects(scene.fixed_effects).model()
        if not model.is_linear_elastic or model.inclusions is not None:
            slots = dict(model.filled)
            name = next(slots[slot] for slot in ("hyperelastic_law", "relaxation", "inclusions") if slot in slots)
            raise Finger3dError(f"app: not with effects.{name}, which takes seconds to press; take the effect out")
        if model.centre_of_mass_mm is not None:
            raise Finger3dError("app: not with [grip]; press the scene, or give it [press] for one finger")
        if len(model.legs) > 1 or model.legs[0].moves_sideways:
            model = replace(model, legs=(Leg(model.largest_depth_mm, steps=STEPS),))
        body = PressedBody(model, report)
        steps = body.steps()
        steps[-1].check(f"app: mu = {scene.tables.friction.mu:g}")
        remark = _remark(body.problem, steps[-1])
        return cls(scene.title, body.problem, steps[-1].target.depth_mm, len(steps), remark)

    def press(self, mu: float, depth_mm: float) -> LivePress:
        """Press with a coefficient of friction to a depth; the last presses are kept.

        Raises
        ------
        Finger3dError
            If an increment does not converge.
        """
        return _pressed(self, float(f"{mu:.9g}"), float(f"{depth_mm:.9g}"))

    def read(self, gauge: Gauge, mu: float, depth_mm: float, noise: float) -> LiveReading:
        """Read a gauge.

        Parameters
        ----------
        noise : standard deviation of a reading of the strain

        Raises
        ------
        Finger3dError
            If the gauge is not inside the finger.
        """
        model, mesh, axes = self.problem.model, self.problem.mesh, self.problem.axes
        start = max(mu - MU_STEP, 0.0)
        at = np.array([start, mu, mu + MU_STEP] if start < mu else [0.0, MU_STEP, 2.0 * MU_STEP])
        displacements = np.stack([self.press(float(m), depth_mm).displacement.ravel() for m in at], axis=1)

        def strains(place: Gauge) -> Float:
            return np.asarray((place.row(mesh, axes) @ displacements)[0])

        own, tolerances = strains(gauge), []
        for name in GAUGE_PLACES.values():
            sd = TOLERANCES[name][0]
            if displaced := displaced_gauges(model, gauge, {name: sd}):
                tolerances.append(tolerance_of(name, sd, [(d.step, strains(d.gauge) - own) for d in displaced]))
        curve = ReadingCurve(gauge.name, at, own, noise, tuple(tolerances))
        return LiveReading(
            strain=float(curve.at(mu)),
            slope=float(curve.slope(mu)),
            strain_sd=float(curve.reading_sd([mu])[0]),
            mu_sd=float(SensorModel((curve,)).mu_sd(mu)[0]),
        )


@lru_cache(maxsize=_KEPT)
def _pressed(body: LiveBody, mu: float, depth_mm: float) -> LivePress:
    problem = body.problem
    pressed = under(problem, problem.model.friction.with_mu(mu), (Leg(depth_mm, steps=body.steps),))
    steps = list(march(pressed))
    steps[-1].check(f"app: mu = {mu:g}")
    measured = measure(problem.points, steps[-1])
    table = contact_table(problem.points, steps[-1])
    z_mm, on = middle_line(table, problem.points.band_mm, problem.points.half_width_mm if problem.dim == 3 else None)
    unknowns = next(formulation_of(problem.model).unknowns(problem, [steps[-1].meshed_state]))
    return LivePress(
        numbers={name: measured[name] for name in _NUMBERS},
        z_mm=z_mm,
        displacement=displacement(problem.mesh, unknowns),
        **{name: np.asarray(table[name])[on] for name in _ALONG},
    )


def _remark(problem: Problem, step: StepResult) -> str:
    """Return that presses are in small strain, and what large deformation would change at the end of one."""
    (found,) = Judgement(problem.model, {LARGE_DEFORMATION: at_large_deformation}).found(shortcut=False).values()
    changes = found.estimate.of_press(changing_numbers(problem, step)).changes
    names = [name for name in ("normal_force_N", "friction_sum_N", "stick_area_mm2") if name in changes]
    said = [
        f"{name} by {two_digits(changes[name].change)} ({two_digits(changes[name].low)} to "
        f"{two_digits(changes[name].high)})"
        for name in names + [column.key for column in of_kind(step.readings, "gauge")]
    ]
    told = ", ".join(said) or "every number by an unknown amount"
    return f"Presses are in small strain; at {step.target.depth_mm:.4g} mm large deformation would change {told}."
