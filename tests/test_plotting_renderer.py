"""PyVista renderer of surfaces, lines and arrows, and the camera of the pictures of a solid."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import MissingError
from finger3d.fem.mesh.simplex import Mesh
from finger3d.plotting import renderer
from finger3d.plotting.renderer import AXES, WINDOW, flat, framed, half_height, viewer_axes
from tests.pictures import OBJECT, assert_shows_the_zones, finger_picture, solid_finger


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


pytestmark = pytest.mark.usefixtures("fresh_renderer")


@pytest.fixture(scope="module")
def solid() -> tuple[Mesh, dict[str, Any]]:
    return solid_finger()


def test_pyvista_draws_a_solid_or_tells_that_opengl_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "pyvista")
    mesh, result = solid
    tiny = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Sphere()); p.screenshot()"
    if renderer.run_child([sys.executable, "-c", tiny]) is None:
        assert finger_picture(tmp_path / "f.png", mesh, **result, title="Fig. 9", thing=OBJECT) == "pyvista"
        assert_shows_the_zones(tmp_path / "f.png")
    else:
        with pytest.raises(MissingError, match="PyVista.*FINGER3D_RENDERER"):
            finger_picture(tmp_path / "f.png", mesh, **result)


def test_a_crash_of_the_renderer_is_survived_and_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    # Without an EGL driver and a display VTK ends its process by a segmentation fault; abort() is as hard.
    (tmp_path / "sitecustomize.py").write_text(
        f"import os, pathlib\npathlib.Path({str(tmp_path / 'tried')!r}).open('a').write('x')\nos.abort()\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    mesh, result = solid
    for name in ("one.png", "two.png"):
        assert finger_picture(tmp_path / name, mesh, **result) == "matplotlib"
        assert_shows_the_zones(tmp_path / name)
    assert (tmp_path / "tried").read_text() == "x"
    monkeypatch.setenv("FINGER3D_RENDERER", "pyvista")
    with pytest.raises(MissingError, match="signal 6.*FINGER3D_RENDERER"):
        finger_picture(tmp_path / "three.png", mesh, **result)


def test_a_missing_opengl_driver_is_survived(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(tmp_path / "no-such-driver.json"))
    monkeypatch.delenv("DISPLAY", raising=False)
    mesh, result = solid
    assert finger_picture(tmp_path / "f.png", mesh, **result) == "matplotlib"
    assert_shows_the_zones(tmp_path / "f.png")


def test_a_child_that_renders_ends_with_the_block_beside_which_it_runs(tmp_path: Path) -> None:
    said = tmp_path / "pid"
    child = f"import os, pathlib, time; pathlib.Path({str(said)!r}).write_text(str(os.getpid())); time.sleep(600)"

    def interrupted() -> None:
        with renderer.running_child([sys.executable, "-c", child]):
            while not (said.exists() and said.read_text()):
                time.sleep(0.01)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with pytest.raises(ProcessLookupError):
        os.kill(int(said.read_text()), 0)
