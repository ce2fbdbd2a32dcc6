"""Rendering of solids by VTK."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from finger3d.errors import MissingError
from finger3d.fem.mesh.simplex import Mesh
from finger3d.plotting import renderer
from tests.pictures import OBJECT, assert_shows_the_zones, finger_picture, solid_finger

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
