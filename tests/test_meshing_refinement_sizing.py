"""Edge lengths of an unstructured mesh."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, signed_volumes
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.refinement.sizing import count_cells, sizing
from tests.designs import FIG9


def test_sizing_is_fine_in_the_zone_and_grows_at_its_rate() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    options = MeshOptions(size_mm=1.0, base_size_mm=8.0)
    field = sizing(FIG9, options, (-30.0, 30.0, -10.0, 10.0), low, high)
    depth = np.array([0.0, 2.0, 12.4, 40.0])
    h = field.at(np.stack([np.zeros(4), FIG9.height_mm - depth, np.zeros(4)], axis=1))
    np.testing.assert_allclose(h, [1.0, 1.0, 1.0 + 0.5 * (12.4 - 2.0), 8.0], rtol=0.02)
    points, tets, values = field.background()
    volume = np.abs(signed_volumes(Mesh(points, tets, {}))).sum()
    assert volume == pytest.approx(np.prod(np.ptp(points, axis=0)), rel=1e-12)
    assert (points.min(axis=0) < low).all()
    assert (points.max(axis=0) > high).all()
    assert len(np.unique(points[:, 2])) == 2  # a zone over the full width: the field does not depend on z
    assert values.min() == 1.0
    assert values.max() == 8.0


def test_a_zone_narrower_than_the_finger_is_refined_along_z_too() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    options = MeshOptions(size_mm=0.5, base_size_mm=8.0)
    points, _, values = sizing(FIG9, options, (-3.0, 3.0, -3.0, 3.0), low, high).background()
    near = np.abs(points - [0.0, FIG9.height_mm, 0.0]).max(axis=1) < 2.0
    end = np.abs(points - [0.0, FIG9.height_mm, 10.0]).max(axis=1) < 2.0
    assert values[near].max() < values[end].min()


def test_the_forecast_of_tets_matches_what_was_measured() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    for size, measured in ((2.0, 7_837), (1.0, 27_369), (0.5, 112_517)):  # tets that pytetwild made
        field = sizing(FIG9, MeshOptions(size_mm=size, base_size_mm=10.0), (-44, 44, -10, 10), low, high)
        assert 0.85 < count_cells(FIG9, field) / measured < 1.15
