"""Inner surfaces of hollow fingers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.fem.simplex import Mesh, boundary, quadratic
from finger3d.mechanics.cavity import CAVITY, cavity_warnings
from tests.meshes import grid


def hollow() -> Mesh:
    """A unit cube of 3 x 3 x 3 cells without the cell in its middle."""
    mesh = grid((3, 3, 3))
    centre = mesh.points[mesh.cells].mean(axis=1)
    cells = mesh.cells[(np.abs(centre - 0.5) > 1.0 / 6.0).any(axis=1)]
    facets = boundary(cells, 3)
    inner = (np.abs(mesh.points[facets] - 0.5) < 0.2).all(axis=(1, 2))
    return quadratic(replace(mesh, cells=cells, facets={"walls": facets[~inner], CAVITY: facets[inner]}))


@pytest.mark.parametrize(("squeeze", "crosses"), [(0.0, False), (0.9, False), (1.2, True)])
def test_an_inner_surface_is_told_to_cross_itself_when_its_faces_pass_each_other(squeeze: float, crosses: bool) -> None:
    # The faces y = 1/3 and y = 2/3 move together by the share `squeeze` of their distance, one corner less than others.
    mesh = hollow()
    on_top = np.isclose(mesh.points[:, 1], 2.0 / 3.0) & (np.abs(mesh.points[:, [0, 2]] - 0.5) < 0.2).all(axis=1)
    move = np.zeros_like(mesh.points)
    move[on_top, 1] = -squeeze / 3.0 * (1.0 - 0.1 * mesh.points[on_top, 0])
    assert bool(cavity_warnings(mesh, move)) == crosses


def test_a_body_without_an_inner_surface_has_no_warning() -> None:
    mesh = quadratic(grid((1, 1, 1)))
    assert cavity_warnings(mesh, np.zeros_like(mesh.points)) == []
