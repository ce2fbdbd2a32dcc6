"""Presses of a calibration: one for every coefficient of friction, all of one condensed body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calibrate.increments import Increments
from finger3d.analyses.pressed_body import PressAtMu
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult


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
