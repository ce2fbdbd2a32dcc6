"""The search for the best places of several gauges."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d._types import Float
from finger3d.analyses.optimise.gauge_fields import GaugeFields
from finger3d.analyses.optimise.gauge_search import Candidates, Region, objectives, search
from finger3d.errors import Finger3dError
from finger3d.progress import QUIET
from finger3d.sensor.likelihood import ReadingEffects, prior
from tests.sensor_cases import scene

MUS = (0.1, 0.25, 0.4, 0.55, 0.7)


def test_the_first_gauge_is_the_best_of_all_candidates() -> None:
    fields = GaugeFields.of(scene().model(), MUS, 1.5e-4, {"depth_mm": 0.1}, QUIET)
    region = Region((10.0, 40.0), (10.0, 30.0), (0.0, 0.0), (0.0, math.pi))
    candidates = Candidates.of(fields, region.grid()[0], region.angles())
    base = prior(1, 0.2)
    values = objectives(base, candidates)
    # one by one, by the definition of the information
    for i in np.random.default_rng(0).integers(0, len(values), 20):
        one = base + candidates.effects.fisher[i]
        assert values[i] == pytest.approx(np.mean([np.sqrt(np.linalg.inv(f)[0, 0]) for f in one]))


def test_bounds_without_a_place_in_the_body_are_refused() -> None:
    def outside(points: Float, angles: Float) -> ReadingEffects:
        count = len(points) * len(angles)
        return ReadingEffects(np.full((count, 2, 1), np.nan), np.full((count, 2), np.nan))

    fields: Any = SimpleNamespace(mus=(0.1, 1.0), shared=(), effects=outside)
    with pytest.raises(Finger3dError, match="no gauge within these bounds"):
        search(fields, Region((49.0, 50.0), (48.0, 50.0), (0.0, 0.0), (0.0, 1.0)), 2, QUIET)
