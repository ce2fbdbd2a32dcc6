"""Pictures are drawn, show what they should, and survive a machine without OpenGL."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.fem.mesh.simplex import CONTACT, FREE_FACES, Mesh
from finger3d.plotting import solid as render
from finger3d.plotting.figures import (
    contact_figure,
    force_figure,
    map_figure,
    marker_figure,
    middle_line,
    zones,
)
from tests.commands import loaded
from tests.pictures import MU, STEPS, finger, finger_picture, pixels, pressed, share, solid_finger

pytestmark = pytest.mark.usefixtures("fresh_renderer")


@pytest.fixture(scope="module")
def solid() -> tuple[Mesh, dict[str, Any]]:
    return solid_finger()


def test_a_section_is_drawn_without_vtk(tmp_path: Path) -> None:
    mesh = finger((50, 10))
    assert finger_picture(tmp_path / "f.png", mesh, **pressed(mesh), title="Fig. 9, plane strain") == "matplotlib"
    assert pixels(tmp_path / "f.png").std() > 0.1
    assert share(tmp_path / "f.png", render.COLOURS[STICK]) > 1e-3
    assert share(tmp_path / "f.png", render.COLOURS[SLIP]) > 1e-3


def test_what_draws_loads_neither_the_solver_nor_a_renderer() -> None:
    heavy = ("matplotlib", "vtkmodules", "scipy", "finger3d.mechanics.march")
    assert not loaded("import finger3d.plotting.figures, finger3d.plotting.deformed", *heavy)


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
    force_figure(tmp_path / "f.png", STEPS)
    assert share(tmp_path / "f.png", "#c0392b", within=0.05) > 1e-4
    assert share(tmp_path / "f.png", render.COLOURS[STICK], within=0.05) > 1e-4


def test_many_increments_are_a_curve_without_markers(tmp_path: Path) -> None:
    many = [{**STEPS[-1], "depth_mm": 0.01 * k, "friction_sum_N": 0.01 * k} for k in range(320)]
    force_figure(tmp_path / "many.png", many)
    force_figure(tmp_path / "few.png", many[::10])
    assert share(tmp_path / "many.png", "#c0392b", within=0.05) < share(tmp_path / "few.png", "#c0392b", within=0.05)


def test_forces_are_drawn_against_the_slides_that_there_are(tmp_path: Path) -> None:
    slid = [{**step, "slide_x_mm": 0.1 * k, "slide_z_mm": 0.0, "tangential_force_z_N": 1e-12 * k}
            for k, step in enumerate(STEPS)]  # fmt: skip
    force_figure(tmp_path / "slid.png", slid)
    force_figure(tmp_path / "pressed.png", STEPS)
    high, low = (pixels(tmp_path / name).shape[0] for name in ("slid.png", "pressed.png"))
    assert high == 2 * low
    assert share(tmp_path / "slid.png", "#3c8d4f", within=0.05) == 0.0  # round-off along z


def test_a_flat_map_shows_the_status_of_the_contact_face(tmp_path: Path) -> None:
    x, z = (v.ravel() for v in np.meshgrid(np.linspace(-3.0, 3.0, 13), np.linspace(-2.0, 2.0, 9)))
    near = np.hypot(x, z)
    top, wall = FREE_FACES[CONTACT], FREE_FACES[CONTACT + 1]
    shown = {}
    for name, largest in (("open", 0.0), ("touching", 0.2)):
        status = np.select([largest * (near < 0.8) > 0.0, largest * (near < 1.6) > 0.0], ["stick", "slip"], "open")
        pressure = largest * np.maximum(1.0 - (near / 1.6) ** 2, 0.0)
        table = {
            "face": [top] * len(x) + [wall], "x_mm": [*x, 9.0], "z_mm": [*z, 0.0], "pressure_MPa": [*pressure, 9.0],
            "shear_x_MPa": [*(0.3 * pressure), 0.0], "shear_z_MPa": [0.0] * (len(x) + 1), "status": [*status, "slip"],
        }  # fmt: skip
        map_figure(tmp_path / f"{name}.png", table)
        shown[name] = [share(tmp_path / f"{name}.png", render.COLOURS[s], within=0.05) for s in (STICK, SLIP)]
    legend, both = np.array(shown["open"]), np.array(shown["touching"])
    assert (both > 1.3 * legend).all()


@pytest.mark.parametrize(
    ("z", "expected"),
    [
        ([0.0] * 6 + [0.3] * 2, (0.0, [0, 1, 2, 3, 4, 5])),  # those beside the line have another traction
        ([0.0] * 2 + [0.3] * 3 + [0.6] * 3, (0.0, [0, 1, 2, 3, 4])),  # hardly any on the line
        ([0.9] * 4 + [1.5] * 4, (1.5, [4, 5, 6, 7])),  # none near it: where the pressure is largest
    ],
)
def test_the_line_that_is_drawn(z: list[float], expected: tuple[float, list[int]]) -> None:
    top, wall = FREE_FACES[CONTACT], FREE_FACES[CONTACT + 1]
    table = {
        "face": [top] * 8 + [wall], "x_mm": [0.1 * k for k in range(9)], "z_mm": [*z, 0.0],
        "pressure_MPa": [0.1 * k for k in range(9)],
    }  # fmt: skip
    at, points = middle_line(table, 0.4, 2.0)
    assert (at, points.tolist()) == expected
    assert middle_line(table, 0.4, None)[1].tolist() == list(range(8))


def table(moved: np.ndarray) -> dict[str, np.ndarray]:
    """Three markers on a line along x after two increments; `moved` (3, 3) at the end."""
    at = np.array([[-10.0, 5.0, 0.0], [0.0, 5.0, 0.0], [10.0, 5.0, 0.0]])
    columns = {"step": np.array([1, 1, 1, 2, 2, 2]), "depth_mm": np.array([1.0] * 3 + [2.0] * 3)}
    columns |= {f"{a}_mm": np.tile(at[:, k], 2) for k, a in enumerate("xyz")}
    both = np.vstack([0.5 * moved, moved])
    return columns | {f"displacement_{a}_mm": both[:, k] for k, a in enumerate("xyz")}


@pytest.mark.parametrize(("longest", "factor"), [(0.3, 5.0), (0.011, 200.0), (1.0, 2.0), (10.0, 0.2)])
def test_arrows_are_magnified_by_a_round_number_to_a_visible_length(
    longest: float, factor: float, tmp_path: Path, figures: list[Any]
) -> None:
    moved = np.array([[longest, -0.4, 0.0], [0.0, -0.6, 0.0], [-0.5 * longest, -0.4, 0.0]])
    moved[:, 1] *= longest
    marker_figure(tmp_path / "a.png", table(moved))
    axes = figures[0].axes[0]
    assert f"drawn {factor:g} times" in axes.get_title()
    assert "2 mm" in axes.get_title()
    arrows = axes.collections[0]
    assert arrows.U == pytest.approx(factor * moved[:, 0])
    assert np.asarray(arrows.get_array()) == pytest.approx(moved[:, 1])
    # at most 12 percent of the 20 mm that the markers extend over
    assert np.hypot(arrows.U, arrows.V).max() <= 2.4 * (1.0 + 1e-9)


def test_a_solid_is_seen_along_the_press_axis(tmp_path: Path, figures: list[Any]) -> None:
    marker_figure(tmp_path / "a.png", table(np.array([[0.1, -0.4, 0.2]] * 3)))
    assert figures[0].axes[0].get_ylabel() == "z (mm)"


def test_markers_that_do_not_move_are_drawn(tmp_path: Path, figures: list[Any]) -> None:
    marker_figure(tmp_path / "a.png", table(np.zeros((3, 3))))
    assert "drawn 1 times" in figures[0].axes[0].get_title()
