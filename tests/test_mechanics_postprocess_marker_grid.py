"""Markers on a grid of the contact face."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import MeshOptions
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid, grid_markers, marker_table
from finger3d.mechanics.readings.reading import Marker
from finger3d.meshing.generate import mesh_solid
from tests.models import block

COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("symmetry", [None, ()])
def test_markers_cover_the_face_of_the_whole_finger_and_follow_a_field(symmetry: tuple[str, ...] | None) -> None:
    problem = build(block(mesh=COARSE, symmetry=symmetry))
    markers = MarkerGrid.of(problem, 1.0)
    # the block is 8 mm by 4 mm and 3 mm high
    assert {tuple(np.round(p, 9)) for p in markers.places} == {
        (float(x), 3.0, float(z)) for x in range(-4, 5) for z in range(-2, 3)
    }
    slope = (
        np.array([[0.2, 0.1, 0.0], [0.0, -0.1, 0.0], [0.0, 0.3, 0.05]]) if symmetry == () else np.diag([0.2, -0.1, 0.3])
    )
    assert markers.displacements(problem.mesh.points @ slope.T) == pytest.approx(markers.places @ slope.T, abs=1e-12)


def test_the_table_has_every_marker_after_every_increment() -> None:
    problem = build(block(mesh=COARSE, markers=(Marker("m", 1.0, 3.0, -1.0),)))
    steps = list(march(problem))
    table = marker_table(problem, steps, MarkerGrid.of(problem, 2.0), {"marker_m_x_mm": 0.1, "marker_grid_1_y_mm": 0.2})
    count = 1 + 5 * 3
    assert [len(column) for column in table.values()] == [count * len(steps)] * len(table)
    assert list(table["marker"][:2]) == ["m", "grid_1"]
    assert table["depth_mm"][-1] == steps[-1].target.depth_mm
    # the marker of the scene is read by its own rows
    assert table["displacement_y_mm"][-count] == pytest.approx(steps[-1].markers["m"][1])
    # errors are known after the last increment only
    told = {name: np.flatnonzero(np.isfinite(table[f"error_{name}_mm"])).tolist() for name in "xyz"}
    assert told == {"x": [count * (len(steps) - 1)], "y": [count * (len(steps) - 1) + 1], "z": []}
    assert marker_table(problem, steps, None)["marker"] == ["m"] * len(steps)


def test_a_marker_beside_the_facets_of_a_rim_is_read_at_the_nearest() -> None:
    problem = build(block(mesh=COARSE))
    markers = [Marker("a", -3.0, 3.0, 1.0), Marker("b", 4.01, 3.0, -0.5), Marker("c", 0.3, 3.0, 0.2)]
    there = MarkerGrid.at(problem, markers).displacements(problem.mesh.points)
    assert there == pytest.approx(np.array([[-3.0, 3.0, 1.0], [4.0, 3.0, -0.5], [0.3, 3.0, 0.2]]), abs=1e-7)


def test_the_grid_follows_the_shape_whatever_the_mesh() -> None:
    """A round rim: chords of a coarse mesh leave out dots that those of a fine one cover."""
    design = designs()["hemisphere"](radius_mm=5.0)
    wanted = {(x, z) for x in range(-5, 6) for z in range(-5, 6) if x * x + z * z <= 25}
    markers = grid_markers(design, 1.0, 3)
    assert [(m.x_mm, m.z_mm) for m in markers] == sorted(wanted)
    assert [m.y_mm for m in markers] == pytest.approx([math.sqrt(25.0 - x * x - z * z) for x, z in sorted(wanted)])
    for size in (1.5, 3.0):
        mesh = mesh_solid(design, MeshOptions(size, 3.0), (-1.0, 1.0, -1.0, 1.0))[0]
        there = MarkerGrid.at(SimpleNamespace(mesh=mesh, dim=3, axes=()), markers).displacements(mesh.points)
        # steep at the rim, where a chord of 3 mm is .23 mm inside the circle
        assert np.abs(there - MarkerGrid(markers, *[None] * 2).places)[:, ::2].max() < 0.25
