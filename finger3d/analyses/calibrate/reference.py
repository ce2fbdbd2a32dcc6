"""Bodies that a calibration presses: readings at several coefficients of friction, and how they change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.pressed_body import presses
from finger3d.mechanics.discretise.companions import built_like
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Model


@dataclass(frozen=True)
class ReferenceBody:
    """Body that others are compared with: readings (k, m) by names (k) at mu (m,)."""

    problem: Problem
    names: tuple[str, ...]
    mu: Float
    readings: Float

    @classmethod
    def of(cls, problem: Problem, names: tuple[str, ...], mu: Float) -> ReferenceBody:
        """Press a problem at mu (m,)."""
        return cls(problem, names, mu, read(problem, names, mu))

    def change(self, problem: Problem) -> Float:
        """Return the changes (k, m) of the readings in another body or path."""
        return np.asarray(read(problem, self.names, self.mu) - self.readings)

    def rebuilt(self, margin: float = MARGIN, **changes: Any) -> Problem:
        """Build the body with a changed model; other readings are omitted, except gauges that stiffen the body."""
        model = replace(reading_only(self.problem.model, self.names), **changes)
        return built_like(self.problem, model, margin=margin)


def reading_only(model: Model, names: Sequence[str]) -> Model:
    """Return the model without readings of other names; gauges that stiffen the body are kept."""
    dim = 3 if model.domain == "solid" else 2
    wanted = set(names)
    return replace(
        model,
        gauges=model.gauges if model.inclusions else tuple(g for g in model.gauges if g.name in wanted),
        markers=tuple(m for m in model.markers if wanted & {column.name for column in m.columns(dim)}),
        taxels=tuple(t for t in model.taxels if t.name in wanted),
    )


def read(problem: Problem, names: Sequence[str], mu: Float) -> Float:
    """Return readings (k, m) by names (k) at mu (m,), NaN where a press failed."""
    frames = [p.frame for p in sorted(presses(problem, mu.tolist()), key=lambda p: p.mu)]
    every = [frame.named_readings if frame.outcome.ok else {} for frame in frames]
    return np.array([[one.get(name, math.nan) for one in every] for name in names])
