"""Bodies that relax, and the relaxation in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d.effects.viscosity import Effect
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Gauge, Leg, Model
from tests import models

TWO = ((0.5, 1.0), (0.2, 0.1))
RAMP = (Leg(0.3, steps=6, duration_s=1.0),)
RAMP_AND_HOLD = (*RAMP, Leg(0.3, steps=5, duration_s=3.0))
UP_AND_DOWN = (*RAMP_AND_HOLD, Leg(0.0, steps=4, duration_s=0.5), Leg(0.0, steps=2, duration_s=2.0))


def block(**changes: object) -> Model:
    """A block under a ball that comes and goes, with a gauge."""
    return models.block(**{"gauges": (Gauge("g", 0.0, 1.5, 0.0, 0.0, 2.0),), "legs": UP_AND_DOWN} | changes)


def viscous(problem: Problem, prony: tuple = TWO, bulk: bool = True, **changes: object) -> Problem:
    return replace(problem, model=Effect(prony, bulk).apply(replace(problem.model, **changes)))


def mean_relaxation(prony: tuple, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Mean of r from `low` to `high`."""
    total = (1.0 - sum(g for g, _ in prony)) * (high - low)
    total += sum(g * tau * (np.exp(-low / tau) - np.exp(-high / tau)) for g, tau in prony)
    return total / (high - low)


def scene_of(effect: dict, domain: str = "solid", legs: tuple = ({"depth_mm": 1.0, "duration_s": 1.0},)) -> dict:
    return {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
        "material": {"E_MPa": 1.0, "nu": 0.3}, "model": {"domain": domain}, "press": {"leg": legs},
        "effects": {"viscosity": effect},
    }  # fmt: skip
