"""Displacements and strains as rows of the unknowns."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import quadratic
from finger3d.fem.surface.traces import displacement_row, strain_row, surface
from tests.meshes import grid


@pytest.mark.parametrize("dim", [2, 3])
def test_traces_and_strains_read_a_linear_field_exactly(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))
    slope = np.random.default_rng(1).normal(size=(dim, dim))
    u = mesh.points @ slope.T
    top = surface(mesh, "y+", thickness=2.0)
    assert top.area.sum() == pytest.approx(2.0, rel=1e-13)
    centre = top.average @ top.samples  # the hat's centre of gravity, where a weighted mean of a linear field is read
    assert np.abs(top.trace @ u - centre @ slope.T).max() < 1e-13
    direction = np.eye(dim)[0] * 0.6 + np.eye(dim)[1] * 0.8
    point = np.full(dim, 1 / 3)  # on a shared facet
    assert (strain_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ direction, abs=1e-12
    )
    assert (displacement_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ point, abs=1e-12
    )
