"""Contact that goes beyond the candidate points is noticed."""

from __future__ import annotations

import math

import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg
from finger3d.mechanics.postprocess.penetration import beyond_candidates, check_surface
from tests.models import fig9


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_too_few_candidate_points_are_noticed(domain: Domain) -> None:
    model = fig9(domain=domain, gauges=(), legs=(Leg(3.0, steps=10),))
    narrow, usual, whole = (build(model, margin=margin) for margin in (-0.6, 0.3, math.inf))
    assert len(narrow.surface.nodes) < len(usual.surface.nodes) < len(whole.surface.nodes)
    steps = [list(march(problem)) for problem in (narrow, usual, whole)]
    checks = [check_surface(p, s) for p, s in zip((narrow, usual, whole), steps, strict=True)]
    assert [every[-1].within_candidates for every in checks] == [False, True, True]
    assert 0 not in beyond_candidates(whole).face
    assert 0 in beyond_candidates(usual).face
    # the first increments stay within the few points
    assert checks[0][0].within_candidates


def test_penetration_is_compared_to_the_depth_that_was_reached() -> None:
    problem = build(fig9(domain="plane-strain", gauges=(), legs=(Leg(3.0, steps=10), Leg(1.0, steps=2))))
    steps = list(march(problem))
    for count, depth in ((2, 0.6), (12, 3.0)):  # as of a press that ended early, and of the whole one
        assert [check.depth_mm for check in check_surface(problem, steps[:count])] == pytest.approx([depth] * count)
