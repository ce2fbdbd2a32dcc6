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


def peaked(points: Float, angles: Float) -> ReadingEffects:
    """Effects of gauges that tell mu best at x = y = 20 mm, in any direction."""
    slope = np.exp(-0.01 * np.sum((points - [20.0, 20.0, 0.0]) ** 2, axis=1))
    effects = np.broadcast_to(slope[:, None, None, None], (len(points), len(angles), 3, 1)).reshape(-1, 3, 1)
    return ReadingEffects(effects.copy(), np.ones((len(effects), 3)))


@pytest.mark.parametrize(("spacing", "least", "largest"), [(0.0, 0.0, 0.1), (3.0, 3.0, 4.5)])
def test_gauges_do_not_overlap(spacing: float, least: float, largest: float) -> None:
    """Three of which each is best at one place keep their distance, and lie as close to it as that allows."""
    fields: Any = SimpleNamespace(mus=(0.1, 0.5, 1.0), shared=(), effects=peaked)
    found, _ = search(fields, Region((10.0, 30.0), (10.0, 30.0), (0.0, 0.0), (0.0, 1.0)), 3, QUIET, spacing)
    places = [gauge.place for gauge in found.gauges]
    apart = [float(np.linalg.norm(a - b)) for i, a in enumerate(places) for b in places[:i]]
    assert least * (1.0 - 1e-9) <= min(apart)
    assert max(apart) < largest


def test_gauges_without_room_are_refused() -> None:
    fields: Any = SimpleNamespace(mus=(0.1, 0.5, 1.0), shared=(), effects=peaked)
    with pytest.raises(Finger3dError, match="only 2 have room 3 mm apart"):
        search(fields, Region((20.0, 24.0), (20.0, 21.0), (0.0, 0.0), (0.0, 1.0)), 3, QUIET, 3.0)
