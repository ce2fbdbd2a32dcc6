"""What keeps a surface from being a body."""

from __future__ import annotations

import re

import numpy as np
import pytest

from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import crossings, mistake
from tests.bodies import ball, box


@pytest.mark.parametrize(
    ("spoilt", "text"),
    [
        (lambda p, f: (p, f[1:]), "closed: 3"),
        (
            lambda p, f: (p, np.vstack([f[:1, ::-1], f[1:]])),
            "flipped",
        ),
        (lambda p, f: (p, f[:, ::-1]), "inside"),
        (lambda p, f: (p * [1, 0, 1], f), "flat"),
        (lambda p, f: (0 * p, f), "volume"),
        (lambda p, f: (np.where(np.arange(8)[:, None] == 3, np.nan, p), f), "number"),
        (lambda p, f: (np.where(np.arange(8)[:, None] == 3, np.inf, p), f), "number"),
        (lambda p, f: (np.vstack([p, p + 9]), np.vstack([f, f + 8])), "2 pieces"),
        (lambda p, f: (np.vstack([p, 0.5 * p]), np.vstack([f, f[:, ::-1] + 8])), "2 .*hollow"),
        (lambda p, f: (p, np.vstack([f, f[:2]])), "5 edges"),
        (lambda p, f: (p, f[:3]), "has 3 triangles"),
    ],
    ids=["hole", "flipped", "inward", "flat", "a point", "nan", "inf", "two", "hollow", "twice", "three"],
)
def test_what_keeps_a_surface_from_being_a_body(spoilt, text: str) -> None:
    cube = box(2, 2, 2)
    reason = mistake(Triangles(*spoilt(cube.points, cube.faces)))
    assert re.search(text, reason)
    assert "\n" not in reason


def test_a_surface_that_runs_through_itself_is_noticed() -> None:
    cube = box(2, 2, 2)
    assert not len(crossings(cube))
    assert not len(crossings(ball(3.0, 12, 16)))
    other = box(2, 2, 2, (1.0, 0.9, 1.1))
    both = Triangles(np.vstack([cube.points, other.points]), np.vstack([cube.faces, other.faces + 8]))
    assert len(crossings(both)) >= 4
