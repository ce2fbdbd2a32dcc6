"""Presses of a calibration: one for every coefficient of friction, all of one condensed body.

Readings in N and 2 N increments are compared, as in `finger3d.mechanics.march.step_halving`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from finger3d._cost import CALIBRATION_PRESSES, CALIBRATION_S
from finger3d._types import Float
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.analyses.pressed_body import PressAtMu
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import automatic, increment_error, with_scaled_steps, with_steps
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.mechanics.readings import ORDER
from finger3d.progress import Progress
from finger3d.sensor.calibration import Calibration

NOISE_SHARE = 0.1
"""Error of the increments, relative to the noise of a reading, at which no more increments are added."""

_LARGEST = {"solid": 160, "plane-strain": 320, "plane-stress": 320}
"""Largest number of increments of a leg; an increment of a solid takes ten times as long."""

_LARGEST_IF_FACTORED = 40
"""Largest number of increments of a leg in finite strain, where each factors the stiffness."""

Read = Callable[[Problem], Float]
"""Array of readings of a problem, of one sensor or several at some values of mu; NaN where a press failed."""


@dataclass(frozen=True)
class Increments:
    """Increments of a calibration.

    Attributes
    ----------
    legs : path with the number of increments of each leg
    chosen : whether the number was chosen by the error of the readings
    error : error of the readings relative to their noise, the largest over the values of mu that were tried; NaN if
        none was
    """

    legs: tuple[Leg, ...]
    chosen: bool
    error: float

    def as_dict(self) -> dict[str, object]:
        """Return the entry of calibration.json."""
        return {"steps": [leg.steps for leg in self.legs], "chosen": self.chosen}

    def __str__(self) -> str:
        """Return the number of increments and the error of the readings."""
        steps = ", ".join(str(leg.steps) for leg in self.legs)
        limit = "as asked" if self.error <= NOISE_SHARE else f"{NOISE_SHARE:g} was asked; more are not affordable"
        return f"{steps} increments leave an error of about {self.error:.2g} of the noise in the readings; {limit}"


def choose_increments(problem: Problem, read: Read) -> Increments:
    """Return the given increments of a path, or double automatic ones until their error is small relative to the noise.

    Automatic ones are kept, too, where the path depends on the increments.

    Parameters
    ----------
    problem : Problem
    read : callable
        Returns readings over the standard deviation of their noise.
    """
    model, steps = problem.model, AUTO_START
    if not automatic(model):
        return Increments(with_steps(problem, steps).model.legs, False, math.nan)
    largest = _LARGEST_IF_FACTORED if model.finite_strain else _LARGEST[model.domain]
    readings, error = read(with_steps(problem, steps)), math.inf
    while not error <= NOISE_SHARE and 2 * steps <= largest:
        steps *= 2
        before, readings = readings, read(with_steps(problem, steps))
        error = float(increment_error(readings, before, 0.5).max())
    return Increments(with_steps(problem, steps).model.legs, True, error)


def error_of_increments(problem: Problem, own: Float, chosen: bool, read: Read) -> Float:
    """Return the error of readings due to the increments, from presses in half or twice as many.

    Parameters
    ----------
    problem : Problem
    own : array
        Readings in the increments of the problem.
    chosen : bool
        Whether `choose_increments` chose their number; half as many then suffice.
    read : callable
    """
    other, ratio = with_scaled_steps(problem, 0.5 if chosen else 2.0)
    return increment_error(own, read(other), ratio)


@dataclass(frozen=True)
class CurvePoints:
    """Presses of one condensed body, one for every mu that is finished.

    Attributes
    ----------
    problem : the condensed body; its gauges include the displaced ones, which give the tolerances of position
    mus, increments : all values of mu of the calibration, ascending; the increments of every press
    presses : ascending in mu
    seconds : wall time of the build and of the presses
    factorizations_before : factorisations of an earlier attempt with too few candidate points
    """

    problem: Problem
    mus: tuple[float, ...]
    increments: Increments
    presses: tuple[PressAtMu, ...]
    seconds: Mapping[str, float]
    factorizations_before: int = 0

    @property
    def mu(self) -> Float:
        """Mu (n,) of the presses that converged."""
        return np.array(list(self.frames))

    @property
    def frames(self) -> dict[float, StepResult]:
        """Last increment of every press that converged, by mu."""
        return {p.mu: p.frame for p in self.presses if p.frame.outcome.ok}

    @property
    def failed(self) -> dict[float, str]:
        """Outcome of every press that did not converge, by mu."""
        return {p.mu: p.frame.failure for p in self.presses if not p.frame.outcome.ok}

    @property
    def factorizations(self) -> int:
        """Factorisations of the body, in its build and in the presses."""
        return self.factorizations_before + self.problem.factorizations + sum(p.factorizations for p in self.presses)

    def reading(self, name: str) -> Float:
        """Return a reading (n,) in the presses that converged."""
        return np.array([frame.named_readings[name] for frame in self.frames.values()])


SHARE = 0.1
"""Largest share of the mesh in the variance of mu."""

_FINER, _FINEST, _COARSEST = 0.9, 0.3, 0.8
"""Edge length of the next mesh relative to that from the order of convergence, and bounds relative to the last mesh."""


@dataclass(frozen=True)
class CalibratedMesh:
    """A calibration, its presses, and a note on its mesh, which is empty if the mesh is fine enough."""

    curve: CurvePoints
    calibration: Calibration
    note: str


def mesh_share(calibration: Calibration) -> float:
    """Return the largest share of the mesh in the variance of mu, over the calibrated mu that noise lets tell.

    Where all points stick, a reading hardly depends on mu, and any error outweighs its noise.
    """
    mu = calibration.mu
    told = np.array([any(low <= one <= high for low, high in calibration.usable) for one in mu])
    share = np.broadcast_to(calibration.reductions(mu).get("mesh", 0.0), mu.shape)
    return float(np.max(share, where=told, initial=0.0))


def choose_mesh(
    model: Model,
    automatic: bool,
    calibrated: Callable[[Model], tuple[CurvePoints, Calibration]],
    report: Progress,
    longest_s: float = CALIBRATION_S,
) -> CalibratedMesh:
    """Calibrate on finer and finer meshes, until the mesh matters little or the forecast of the next one is too long.

    Parameters
    ----------
    automatic : whether the mesh may be refined; otherwise a finer one is only named
    calibrated : calibrates a model
    longest_s : forecast time of a calibration, s, beyond which a finer mesh is only named
    """
    found: CalibratedMesh | None = None
    while True:
        try:
            curve, calibration = calibrated(model)
        except Finger3dError as error:
            if found is None:
                raise
            return replace(found, note=f"{found.note}; that mesh was tried: {error}")
        share = mesh_share(calibration)
        if share <= SHARE:
            return CalibratedMesh(curve, calibration, "")
        model = _finer(model, share)
        sizes = f"mesh.size_mm = {model.mesh.size_mm:.3g} and base_size_mm = {model.mesh.base_size_mm:.3g}"
        note = f"the mesh makes up to {100.0 * share:.0f} % of the variance of mu; {sizes} would make it less"
        try:
            seconds = CALIBRATION_PRESSES * without_output_s(forecast(model))
        except Finger3dError as error:  # for want of memory
            return CalibratedMesh(curve, calibration, f"{note}; {error}")
        found = CalibratedMesh(curve, calibration, f"{note}, in about {seconds:.2g} s")
        if not automatic or seconds > longest_s:
            return found
        report.say(f"{found.note}; calibrating again")


def _finer(model: Model, share: float) -> Model:
    """Return the model with edges for which the mesh error has its allowed share, by the order of convergence."""
    excess = share * (1.0 - SHARE) / (SHARE * max(1.0 - share, 1e-6))
    ratio = min(max(_FINER * excess ** (-0.5 / ORDER), _FINEST), _COARSEST)
    mesh = replace(model.mesh, size_mm=ratio * model.mesh.size_mm, base_size_mm=ratio * model.mesh.base_size_mm)
    return replace(model, mesh=mesh)
