"""The camera of pictures of solids."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.plotting.camera import AXES, WINDOW, flat, framed, half_height, viewer_axes


@pytest.mark.parametrize("direction", [[0.0, 0.0, 1.0], [-0.45, 1.05, 1.0], [3.0, -1.0, 0.2]])
def test_a_viewer_sees_up_as_up(direction: list[float]) -> None:
    axes = viewer_axes(np.array(direction))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0, 1] == 0.0  # the vertical is drawn vertically
    assert axes[1, 1] > 0.0
    assert axes[2] == pytest.approx(np.array(direction) / np.linalg.norm(direction))


def test_points_behind_each_other_fall_on_one() -> None:
    assert flat(5.0 * AXES[2] + 2.0 * AXES[0] - 3.0 * AXES[1]) == pytest.approx([2.0, -3.0])


def test_the_crop_keeps_places_in_the_picture_plane() -> None:
    """A dark rectangle in a white window comes out alone, at the place of its pixels."""
    size, middle = np.array([40.0, 20.0]), np.array([1.0, 2.0, 3.0])
    image = np.full((1, WINDOW[1], WINDOW[0], 3), 255, dtype=np.uint8)
    image[0, 300:400, 200:500] = 0
    cropped, extent = framed(image, (middle, size))
    assert cropped.shape == (1, 100, 300, 3)
    assert (cropped == 0).all()
    pixel = 2.0 * half_height(size) / WINDOW[1]
    x, y = flat(middle)
    wanted = (x + pixel * (200 - 800), x + pixel * (500 - 800), y + pixel * (600 - 400), y + pixel * (600 - 300))
    assert extent == pytest.approx(wanted)
    # both sides fit
    assert pixel * WINDOW[0] >= size[0]
    assert pixel * WINDOW[1] >= size[1]
