"""Panels of pictures of a finger, and outlines of sections."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.plotting.panels import (
    edges_of,
    highest_of,
    keys,
    outline_of,
    palette,
    patches,
    pressure_colours,
    sliced,
    two_panels,
)
from finger3d.plotting.solid import COLOURS
from tests.bodies import ball
from tests.meshes import grid


def test_a_ball_is_sliced_into_its_equator() -> None:
    surface = ball(2.0)
    segments = sliced(surface.points[surface.faces])
    radius = np.linalg.norm(segments, axis=2)
    # the rings of the ball are polygons with 80 corners
    assert radius == pytest.approx(np.full(radius.shape, 2.0), rel=1.0 - np.cos(np.pi / 80) + 1e-9)
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
    assert length == pytest.approx(4.0 * np.pi, rel=2e-3)


def test_no_pressure_has_the_colour_of_the_body_and_the_highest_the_end_of_the_scale() -> None:
    none, low, high = pressure_colours(np.array([0.0, 1e-9, 2.0]), 2.0, np.array([OPEN, SLIP, STICK]))
    assert none.max() - none.min() < 0.1  # grey
    assert not np.allclose(none, low)
    assert high == pytest.approx([0.993, 0.906, 0.144], abs=1e-3)  # viridis
    assert highest_of(np.array([0.1, 0.7])) == 0.7
    assert highest_of(np.zeros(3)) == 1.0


def test_states_have_one_colour_in_picture_and_legend() -> None:
    legend = patches(COLOURS, (OPEN, STICK, SLIP))
    assert np.array([patch.get_facecolor()[:3] for patch in legend]) == pytest.approx(palette())
    assert len({patch.get_label() for patch in legend}) == 3


@pytest.mark.parametrize("aspect", [0.5, 1.3])
def test_panels_have_the_aspect_of_their_content_and_one_scale(aspect: float) -> None:
    figure, panels = two_panels(aspect, "a title", ticks=True)
    wide, high = figure.get_size_inches()
    boxes = [axes.get_position(original=True) for axes in panels]
    for box in boxes:
        assert box.height * high / (box.width * wide) == pytest.approx(aspect)
    keys(figure, 0.3, {"object": "#ff0000"})
    bar = figure.axes[-1]
    assert bar.get_xlim() == pytest.approx((0.0, 0.3))
    assert len(figure.legends[0].get_texts()) == 4


def square(order: int, cells: int = 3) -> Mesh:
    mesh = grid((cells, cells))
    return mesh if order == 1 else quadratic(mesh)


@pytest.mark.parametrize("order", [1, 2])
def test_every_edge_is_drawn_once(order: int) -> None:
    mesh = square(order)
    path = edges_of(mesh, mesh.points)
    # Euler: vertices - edges + cells = 1
    edges = 16 + len(mesh.cells) - 1
    assert (path.codes == path.MOVETO).sum() == edges
    assert len(path.vertices) == edges * (order + 1)


@pytest.mark.parametrize("order", [1, 2])
def test_the_outline_encloses_the_area_of_the_moved_section(order: int) -> None:
    mesh = square(order)
    path = outline_of(mesh, mesh.points * [2.0, 3.0])
    x, y = path.vertices.T
    assert abs(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) == pytest.approx(6.0)
    assert path.contains_point((1.0, 1.5))
    assert len(path.vertices) == order * 12 + 1


def test_edges_that_would_merge_into_an_area_are_left_out() -> None:
    assert len(edges_of(square(1, 100), square(1, 100).points).vertices) == 0
    assert len(edges_of(square(1, 20), square(1, 20).points).vertices) > 0
