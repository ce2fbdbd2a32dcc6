"""Edge lengths of a structured mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.swept import mesh_section
from tests.designs import FIG9, zone_of


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_edges_have_the_asked_length_in_the_zone_and_grow_away_from_it(size: float) -> None:
    options = MeshOptions(size_mm=size, base_size_mm=8.0, mesher="swept")
    mesh = mesh_section(FIG9, options, (-40.0, 40.0, 0.0, 0.0))[0]
    edges = mesh.points[mesh.facets["contact"][:, :2]]
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    inside = np.abs(edges[..., 0]).max(axis=1) < 40.0
    np.testing.assert_allclose(length[inside], size, rtol=0.05)
    assert length[inside].max() / length[inside].min() < 1.001
    base = mesh.points[mesh.facets["base"][:, :2]]
    assert np.linalg.norm(base[:, 1] - base[:, 0], axis=1).max() == pytest.approx(8.0, rel=0.2)
    assert np.diff(np.sort(mesh.points[mesh.points[:, 0] == 0.0][:, 1]))[-1] == pytest.approx(size / 2, rel=0.2)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"size_mm": 60.0, "base_size_mm": 60.0}, "mesh.size_mm = 60 .*width, 20 mm"),
        ({"size_mm": 3.0, "base_size_mm": 2.0}, "mesh.base_size_mm = 2 .*size_mm"),
        ({"size_mm": 0.0}, "mesh.size_mm = 0.0 "),
        ({"base_size_mm": math.nan}, "mesh.base_size_mm = nan "),
        pytest.param({"size_mm": 0.01, "base_size_mm": 0.02}, "mesh.size_mm = 0.01 .* GB", marks=pytest.mark.slow),
    ],
)
def test_sizes_that_cannot_work_are_refused_in_one_line(changes: dict[str, float], text: str) -> None:
    options = MeshOptions(**{"size_mm": 2.0, "base_size_mm": 8.0, "mesher": "swept", "layers": 2, **changes})
    with pytest.raises(Finger3dError, match=text) as refused:
        mesh_solid(FIG9, options, zone_of(FIG9))
    assert "\n" not in str(refused.value)


def test_a_wall_too_thin_for_the_size_is_refused() -> None:
    design = designs()["clipped_cylinder"](100.0, 100.0, 0.02, 20.0)
    with pytest.raises(Finger3dError, match="edge_height_mm = 0"):
        mesh_section(design, MeshOptions(size_mm=20.0, base_size_mm=50.0), (-20.0, 20.0, 0.0, 0.0))


@pytest.mark.parametrize("size", [5.6, 4.0, 2.8, 2.0])
def test_no_layer_along_z_is_thicker_than_the_edges_at_the_contact(size: float) -> None:
    options = MeshOptions(size_mm=size, base_size_mm=4.0 * size, mesher="swept", layers=2)
    mesh = mesh_solid(FIG9, options, zone_of(FIG9))[0]
    levels = np.unique(mesh.points[np.unique(mesh.facets["contact"][:, :3]), 2])
    assert np.diff(levels).max() <= size


def test_the_least_number_of_layers_is_kept() -> None:
    for layers in (1, 2, 4):
        options = MeshOptions(size_mm=12.0, base_size_mm=12.0, mesher="swept", layers=layers)
        mesh = mesh_solid(FIG9, options, zone_of(FIG9))[0]
        levels = np.unique(mesh.points[np.unique(mesh.facets["contact"][:, :3]), 2])
        assert len(levels) == 2 * layers + 1
