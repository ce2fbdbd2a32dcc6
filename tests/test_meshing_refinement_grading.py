"""Edge lengths prescribed at points of a body."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.meshing.refinement.grading import Grading

GRADING = Grading(np.array([[1.0, 2.0, 0.5], [4.0, 0.0, 0.0]]), np.array([0.25, 1.0]))
"""Powers of two are size classes: they are looked up exactly."""


def test_lengths_grow_with_the_distance_from_the_nearest_and_are_mirrored() -> None:
    places = np.random.default_rng(0).uniform(0.0, 5.0, (30, 3))
    wanted = np.min(
        [h + 0.3 * np.linalg.norm(places - p, axis=1) for p, h in zip(GRADING.points, GRADING.sizes, strict=True)],
        axis=0,
    )
    assert GRADING.at(places, 0.3) == pytest.approx(wanted, rel=1e-12)
    assert GRADING.at(places * [-1.0, 1.0, -1.0], 0.3) == pytest.approx(wanted, rel=1e-12)


def test_a_size_between_two_classes_errs_by_less_than_half_a_class() -> None:
    sizes = np.geomspace(0.1, 10.0, 50)
    found = [Grading(np.zeros((1, 3)), np.array([size])).at(np.zeros((1, 3)), 0.3)[0] for size in sizes]
    assert np.abs(np.log2(np.array(found) / sizes)).max() <= 0.25 + 1e-12
