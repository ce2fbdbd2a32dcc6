"""Inner surfaces of hollow fingers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, boundary, quadratic
from finger3d.mechanics.results.cavity import CAVITY, cavity_warnings
from tests.meshes import grid


def hollow() -> Mesh:
    """A unit cube of 6 x 6 x 6 cells without the cells of a cube of half its size in its middle."""
    mesh = grid((6, 6, 6))
    centre = mesh.points[mesh.cells].mean(axis=1)
    cells = mesh.cells[(np.abs(centre - 0.5) > 1.0 / 3.0).any(axis=1)]
    facets = boundary(cells, 3)
    inner = (np.abs(mesh.points[facets] - 0.5) < 0.4).all(axis=(1, 2))
    return quadratic(replace(mesh, cells=cells, facets={"walls": facets[~inner], CAVITY: facets[inner]}))


@pytest.mark.parametrize(("share", "crosses"), [(0.0, False), (0.9, False), (1.1, True)])
def test_an_inner_surface_is_told_to_cross_itself_when_its_faces_pass_each_other(share: float, crosses: bool) -> None:
    # The top of the cavity bulges down by a share of the cavity's height, 2/3, and aside, so that no points coincide.
    mesh = hollow()
    x, y, z = mesh.points.T
    top = np.isclose(y, 5.0 / 6.0) & (np.abs(x - 0.5) < 0.3) & (np.abs(z - 0.5) < 0.3)
    move = np.zeros_like(mesh.points)
    move[top, 1] = -share * 2.0 / 3.0 * np.cos(np.pi * (x[top] - 0.5)) * np.cos(np.pi * (z[top] - 0.5))
    move[top, 0] = 0.05 * share
    assert bool(cavity_warnings(mesh, move)) == crosses


def test_a_body_without_an_inner_surface_has_no_warning() -> None:
    mesh = quadratic(grid((1, 1, 1)))
    assert cavity_warnings(mesh, np.zeros_like(mesh.points)) == []
