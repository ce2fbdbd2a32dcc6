"""Pictures are drawn, show what they should, and survive a machine without OpenGL."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK
from finger3d.errors import MissingError
from finger3d.fem.simplex import Mesh
from finger3d.objects import Plane
from finger3d.plotting import renderer
from finger3d.plotting import solid as render
from finger3d.plotting.figures import contact_figure, finger_picture, force_figure, zones
from tests.pictures import MU, STEPS, finger, pixels, pressed, share, top


@pytest.fixture(autouse=True)
def _fresh_renderer(monkeypatch: pytest.MonkeyPatch) -> None:
    """No renderer is forced, and no crash of another test is remembered."""
    monkeypatch.delenv("FINGER3D_RENDERER", raising=False)
    monkeypatch.setattr(renderer, "_failure", [])


@pytest.fixture(scope="module")
def solid() -> tuple[Mesh, dict[str, Any]]:
    mesh = finger((20, 5, 6))
    return mesh, pressed(mesh)


def assert_shows_the_zones(path: Path) -> None:
    """Both zones cover a visible part of the picture, and the pressure has the colours of a peak and of an edge."""
    assert pixels(path).std() > 0.1
    assert share(path, render.COLOURS[STICK]) > 0.01
    assert share(path, render.COLOURS[SLIP]) > 0.01
    assert share(path, "#dde318", within=0.2) > 0.01
    assert share(path, "#33638d", within=0.2) > 0.003


PLATE = Plane().drawing(60.0)
OBJECT = (PLATE.points + [0.0, 40.0, 0.0])[PLATE.faces]


def test_a_solid_is_drawn_by_matplotlib_when_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh, result = solid
    assert finger_picture(tmp_path / "f.png", mesh, **result, title="Fig. 9", thing=OBJECT) == "matplotlib"
    assert_shows_the_zones(tmp_path / "f.png")


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
        with pytest.raises(MissingError, match="PyVista cannot render here"):
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
    with pytest.raises(MissingError, match="crashed .signal 6.*unset FINGER3D_RENDERER"):
        finger_picture(tmp_path / "three.png", mesh, **result)


def test_a_missing_opengl_driver_is_survived(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(tmp_path / "no-such-driver.json"))
    monkeypatch.delenv("DISPLAY", raising=False)
    mesh, result = solid
    assert finger_picture(tmp_path / "f.png", mesh, **result) == "matplotlib"
    assert_shows_the_zones(tmp_path / "f.png")


def test_a_section_is_drawn_without_vtk(tmp_path: Path) -> None:
    mesh = finger((50, 10))
    assert finger_picture(tmp_path / "f.png", mesh, **pressed(mesh), title="Fig. 9, plane strain") == "matplotlib"
    assert pixels(tmp_path / "f.png").std() > 0.1
    assert share(tmp_path / "f.png", render.COLOURS[STICK]) > 1e-3
    assert share(tmp_path / "f.png", render.COLOURS[SLIP]) > 1e-3


def test_what_draws_loads_neither_the_solver_nor_a_renderer() -> None:
    code = (
        "import sys, finger3d.plotting.figures;"
        "print({'matplotlib', 'vtkmodules', 'scipy', 'finger3d.mechanics'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.parametrize("dim", [2, 3])
def test_a_finger_that_does_not_touch_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dim: int) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh = finger((10, 4, 3)[:dim])
    result = pressed(mesh)
    count = len(result["contact_nodes"])
    none = {name: np.zeros(count) for name in ("pressure_MPa", "shear_x_MPa", "shear_z_MPa")}
    table = {**result["table"], **none, "status": ["open"] * count}
    finger_picture(tmp_path / "f.png", mesh, np.zeros_like(mesh.points), table, result["contact_nodes"])
    assert pixels(tmp_path / "f.png").std() > 0.05
    assert share(tmp_path / "f.png", render.COLOURS[STICK]) < 5e-3  # the legend's patch only


def test_the_skin_is_the_whole_boundary_and_lies_on_the_curved_surface(solid: tuple[Mesh, dict[str, Any]]) -> None:
    mesh, result = solid
    table = result["table"]
    status = np.array([STATUS_NAMES.index(s) for s in table["status"]])
    shear = np.column_stack([table[f"shear_{axis}_MPa"] for axis in "xyz"])
    still = np.zeros_like(mesh.points)
    nodes = result["contact_nodes"]
    skin = render.skin_of(mesh, still, table["pressure_MPa"], shear, status, nodes, np.zeros(len(nodes), dtype=int))
    assert len(skin.contact) == 6 * len(mesh.facets["contact"])
    assert len(skin.body) == sum(len(f) for k, f in mesh.facets.items() if k != "contact")
    assert np.abs(skin.contact[..., 1] - top(skin.contact[..., 0])).max() < 0.2  # sagitta of a facet 5 mm long
    edges = skin.contact[:, 1:] - skin.contact[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    assert area.sum() == pytest.approx(20.0 * 200.0 * np.arcsin(0.5), rel=1e-3)
    # Every contact point owns as much of the picture as of the surface: slip's share of the touching area.
    touching = skin.status != OPEN
    assert 0.4 < area[skin.status == SLIP].sum() / area[touching].sum() < 0.9
    assert 20 < len(skin.arrow) < 150
    assert np.linalg.norm(skin.arrow, axis=1).max() <= 1.0 + 1e-12


def test_zones_meet_between_points_of_different_status() -> None:
    x = np.array([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
    status = np.array([OPEN, SLIP, STICK, STICK, SLIP, OPEN])
    assert zones(x, status) == [
        (-2.0, -1.5, OPEN),
        (-1.5, -0.5, SLIP),
        (-0.5, 1.5, STICK),
        (1.5, 2.5, SLIP),
        (2.5, 3.0, OPEN),
    ]
    assert zones(x[:1], status[:1]) == [(-2.0, -2.0, OPEN)]
    assert zones(x[:0], status[:0]) == []


@pytest.mark.parametrize("dim", [2, 3])
def test_contact_forces_are_drawn_with_their_zones(tmp_path: Path, dim: int) -> None:
    mesh = finger((40, 4, 6)[:dim])
    half_width = 10.0 if dim == 3 else None
    contact_figure(tmp_path / "c.png", pressed(mesh)["table"], MU, half_width_mm=half_width)
    assert share(tmp_path / "c.png", "#c9d9ee", within=0.02) > 0.05
    assert share(tmp_path / "c.png", "#fde3c4", within=0.02) > 0.05
    # The end line z = width/2 is a second panel below the middle one.
    ratio = pixels(tmp_path / "c.png").shape[0] / pixels(tmp_path / "c.png").shape[1]
    assert (ratio > 0.8) == (dim == 3)


def test_a_huge_mu_does_not_flatten_the_contact_forces(tmp_path: Path) -> None:
    mesh = finger((40, 4))
    pictures = []
    for mu in (2.0, 1e6):
        contact_figure(tmp_path / f"{mu}.png", pressed(mesh)["table"], mu)
        pictures.append(pixels(tmp_path / f"{mu}.png"))
    # The red curve of f_t is as tall in both.
    tall = [
        np.ptp(np.flatnonzero(np.any(np.abs(p - [0.753, 0.224, 0.169]).max(axis=2) < 0.05, axis=1))) for p in pictures
    ]
    assert tall[1] == pytest.approx(tall[0], rel=0.1)
    assert tall[0] > 50


def test_force_against_depth_is_drawn(tmp_path: Path) -> None:
    force_figure(tmp_path / "f.png", STEPS, "Fig. 9")
    assert share(tmp_path / "f.png", "#c0392b", within=0.05) > 1e-4
    assert share(tmp_path / "f.png", render.COLOURS[STICK], within=0.05) > 1e-4
