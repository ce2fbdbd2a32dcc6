"""A condensed finger that is pressed again for every change of friction, depth or gauge."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Array, Float, freeze_arrays
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.errors import Finger3dError
from finger3d.fem.recover import displacement
from finger3d.fem.simplex import CONTACT, FREE_FACES
from finger3d.mechanics.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.history import contact_table, measure
from finger3d.mechanics.model import Leg
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march

if TYPE_CHECKING:
    from finger3d.scene import Scene

STEPS = 10
"""Increments of every press; their error in the friction sum is some per cent."""

MU_STEP = 0.02
"""Difference of mu over which the slope of the strain is taken, to both sides."""

_KEPT = 64  # presses; a slider that goes back finds them
_PLACES = ("gauge_x_mm", "gauge_y_mm", "gauge_angle_deg")
_LINE_MM = 1e-9
_NUMBERS = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")


@dataclass(frozen=True)
class LivePress:
    """End of a press.

    Attributes
    ----------
    numbers : normal force, friction sum, half the lengths of contact and stick, as in `steps` of summary.json
    x_mm, pressure_MPa, shear_MPa : (p,) traction along the middle of the contact face, ascending in x
    status : (p,) "open", "stick" or "slip"
    displacement : (n, d) mm, of the meshed part
    """

    numbers: dict[str, float]
    x_mm: Float
    pressure_MPa: Float
    shear_MPa: Float
    status: Array
    displacement: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class LiveReading:
    """Reading of a gauge, and the standard deviation of the friction coefficient inferred from it.

    Attributes
    ----------
    strain : of the gauge
    slope : d strain / d mu
    strain_sd : standard deviation of the strain by noise, and by the tolerances of place and direction
    mu_sd : standard deviation of mu, `strain_sd` over the magnitude of the slope; infinite where the slope is zero
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
    """

    title: str
    problem: Problem

    @classmethod
    def of(cls, scene: Scene, say: Callable[[str], None] = lambda text: None) -> LiveBody:
        """Condense the finger of a scene.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time.
        """
        model = scene.model()
        if not model.is_linear_elastic or model.inclusions is not None:
            slots = dict(model.filled)
            name = next(slots[slot] for slot in ("hyperelastic_law", "relaxation", "inclusions") if slot in slots)
            raise Finger3dError(f"app: not with effects.{name}, which takes seconds to press; take the effect out")
        straight = Leg(model.largest_depth_mm, steps=STEPS)
        return cls(scene.title, build(replace(model, legs=(straight,), gauges=(), markers=(), taxels=()), say))

    @property
    def largest_depth_mm(self) -> float:
        """Depth that the body is condensed for, that of the scene."""
        return self.problem.model.largest_depth_mm

    def press(self, mu: float, depth_mm: float) -> LivePress:
        """Press with a coefficient of friction to a depth; the last presses are kept.

        Raises
        ------
        Finger3dError
            If an increment does not converge.
        """
        return _pressed(self, round(mu, 6), round(depth_mm, 6))

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
        mesh, axes = self.problem.mesh, self.problem.axes
        low, middle, high = (self.press(m, depth_mm) for m in (max(mu - MU_STEP, 0.0), mu, mu + MU_STEP))

        def strain(place: Gauge, press: LivePress) -> float:
            return float((place.row(mesh, axes) @ press.displacement.ravel())[0])

        spread = [noise]
        for name in _PLACES:
            sd = TOLERANCES[name][0]
            key, step = ("angle", math.radians(sd)) if name == "gauge_angle_deg" else (name.removeprefix("gauge_"), sd)
            spread.append(strain(replace(gauge, **{key: getattr(gauge, key) + step}), middle) - strain(gauge, middle))
        slope = (strain(gauge, high) - strain(gauge, low)) / (mu + MU_STEP - max(mu - MU_STEP, 0.0))
        strain_sd = float(np.linalg.norm(spread))
        mu_sd = strain_sd / abs(slope) if slope else math.inf
        return LiveReading(strain(gauge, middle), slope, strain_sd, mu_sd)

    def outline(self) -> tuple[Float, Float]:
        """Return x and y (k,), mm, of the contact curve at z = 0 and the base: the outline of the middle section."""
        design = self.problem.model.design
        x = np.linspace(-design.half_length_mm, design.half_length_mm, 201)
        y = np.nan_to_num(design.top(x, np.zeros_like(x)))
        return np.concatenate([x, x[::-1], x[:1]]), np.concatenate([y, np.zeros_like(x), y[:1]])


@lru_cache(maxsize=_KEPT)
def _pressed(body: LiveBody, mu: float, depth_mm: float) -> LivePress:
    problem = body.problem
    friction = problem.model.friction.with_mu(mu)
    legs = (Leg(depth_mm, steps=STEPS),)
    steps = list(march(replace(problem, model=replace(problem.model, friction=friction, legs=legs))))
    if not steps[-1].outcome.ok:
        raise Finger3dError(f"app: mu = {mu:g} at a depth of {depth_mm:g} mm: {steps[-1].outcome}")
    measured = measure(problem.points, steps[-1])
    table = contact_table(problem.points, steps[-1].state)
    z, face = np.asarray(table["z_mm"]), np.asarray(table["face"])
    top = face == FREE_FACES[CONTACT]
    distance = np.abs(z)
    on = np.flatnonzero(top & (distance <= max(problem.points.band_mm, distance[top].min() + _LINE_MM)))
    on = on[np.argsort(np.asarray(table["x_mm"])[on], kind="stable")]
    shear = np.hypot(np.asarray(table["shear_x_MPa"]), np.asarray(table["shear_z_MPa"]))
    unknowns = next(formulation_of(problem.model).unknowns(problem, [steps[-1].meshed_state]))
    return LivePress(
        numbers={name: measured[name] for name in _NUMBERS},
        x_mm=np.asarray(table["x_mm"])[on],
        pressure_MPa=np.asarray(table["pressure_MPa"])[on],
        shear_MPa=shear[on],
        status=np.asarray(table["status"])[on],
        displacement=displacement(problem.mesh, unknowns),
    )
