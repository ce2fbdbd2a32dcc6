"""Pictures of fingers and molds: sections, solids, gauges and renderers."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.fem.mesh import CONTACT, Mesh
from finger3d.mechanics.model import Gauge, MeshOptions
from finger3d.meshing.swept import mesh_section
from finger3d.plotting import renderer
from finger3d.plotting import solid as render
from finger3d.plotting.deformed import draw_finger
from finger3d.plotting.gauges import COLOUR, marks_of
from finger3d.plotting.mold import scenery, scenery_on_the_bed, standing, taken_apart, write_pictures
from finger3d.plotting.panels import palette, sliced
from finger3d.plotting.solid import DeformedFinger
from tests.bodies import ball, box
from tests.designs import FIG9
from tests.meshes import mapped
from tests.pictures import (
    OBJECT,
    assert_shows_the_zones,
    deformed,
    finger,
    finger_picture,
    pixels,
    pressed,
    share,
    solid_finger,
    top,
)

pytestmark = pytest.mark.usefixtures("fresh_renderer")

# --- pictures of deformed fingers at one step and at several ---------------------------------------------------------


@pytest.fixture(scope="module")
def of_section() -> DeformedFinger:
    mesh, _ = mesh_section(FIG9, MeshOptions(5.0, 20.0, "swept"), (-44.0, 44.0, -10.0, 10.0), ())
    nodes = np.unique(mesh.facets["contact"][:, :2])
    nodes = nodes[np.argsort(mesh.points[nodes, 0])]
    middle = np.abs(mesh.points[nodes, 0]) < 10.0
    return DeformedFinger(
        mesh=mesh,
        displacement=np.zeros_like(mesh.points),
        pressure=np.where(middle, 2.0, 0.0),
        shear=np.zeros((len(nodes), 3)),
        status=np.where(middle, np.where(mesh.points[nodes, 0] < 0.0, SLIP, STICK), OPEN),
        nodes=nodes,
        faces=np.full(len(nodes), CONTACT),
        thing=None,
    )


def test_a_section_that_moves_is_in_the_frame_and_the_scale_ends_at_the_highest_pressure(
    of_section: DeformedFinger,
) -> None:
    figure = draw_finger(replace(of_section, displacement=of_section.displacement + [0.0, 30.0]))
    assert figure.axes[0].get_ylim()[1] > FIG9.height_mm + 30.0
    assert figure.axes[2].get_xlim() == (0.0, 2.0)


def test_each_half_of_a_facet_has_the_status_of_its_end(of_section: DeformedFinger) -> None:
    figure = draw_finger(of_section)
    halves = max(figure.axes[1].collections, key=lambda lines: len(lines.get_segments()))
    drawn = np.asarray(halves.get_colors())[:, :3]
    known = {int(node): int(state) for node, state in zip(of_section.nodes, of_section.status, strict=True)}
    ends = of_section.mesh.facets["contact"][:, :2].ravel()
    assert drawn == pytest.approx(palette()[[known[int(node)] for node in ends]])


# --- pictures of solids ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def of_solid() -> tuple[Mesh, dict[str, Any]]:
    return solid_finger()


def test_a_solid_is_drawn_by_matplotlib_when_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh, result = of_solid
    monkeypatch.setattr(renderer, "running_child", lambda command: pytest.fail("PyVista was tried"))
    finger_picture(tmp_path / "f.png", mesh, **result, title="Fig. 9", thing=OBJECT)
    assert_shows_the_zones(tmp_path / "f.png")


def test_the_skin_is_the_whole_boundary_and_lies_on_the_curved_surface(of_solid: tuple[Mesh, dict[str, Any]]) -> None:
    mesh, result = of_solid
    skin = render.skin_of(deformed(mesh, **{**result, "displacement": np.zeros_like(mesh.points)}))
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


# --- panels of pictures of a finger, and outlines of sections --------------------------------------------------------


def test_a_ball_is_sliced_into_its_equator() -> None:
    surface = ball(2.0)
    segments = sliced(surface.points[surface.faces])
    radius = np.linalg.norm(segments, axis=2)
    # the rings of the ball are polygons with 80 corners
    assert radius == pytest.approx(np.full(radius.shape, 2.0), rel=1.0 - np.cos(np.pi / 80) + 1e-9)
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
    assert length == pytest.approx(4.0 * np.pi, rel=2e-3)


# --- gauges are marked where they lie in the pressed finger ----------------------------------------------------------


POINT = Gauge("g36", 36.0, 38.0, 2.5, np.radians(30.0))
LONG = Gauge("long", -10.0, 30.0, 0.0, 0.0, 12.0)
OUTSIDE = Gauge("nowhere", 36.0, 60.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_mark_is_the_gauge_and_moves_with_the_body(dim: int) -> None:
    mesh = finger((12, 5, 4)[:dim])
    point, long = marks_of(mesh, [POINT, OUTSIDE, LONG])
    assert (point.label, long.label) == ("g36, 30°", "long, 0°")
    at = long.of(mesh.points)
    # quadratic shape functions carry the coordinates themselves, up to Newton's last step in a curved cell
    assert np.allclose(at[:, :2], [[-16.0, 30.0], [-10.0, 30.0], [-4.0, 30.0]], atol=1e-9)
    start, middle, end = point.of(mesh.points)
    assert np.allclose(middle, [36.0, 38.0, 2.5][:dim], atol=1e-9)
    assert np.arctan2(*(end - start)[1::-1]) == pytest.approx(POINT.angle)
    stretched = mesh.points + mesh.points * np.array([0.1, -0.2, 0.3])[:dim]
    assert np.allclose(point.of(stretched)[1], [39.6, 30.4, 3.25][:dim], atol=1e-9)


def test_in_a_solid_the_mark_is_on_the_face_in_front() -> None:
    mesh = finger((12, 5, 4))
    assert [mark.label for mark in marks_of(mesh, [POINT], near=True)] == ["g36, 30°, z = 2.5"]
    assert np.allclose(marks_of(mesh, [POINT], near=True)[0].of(mesh.points)[1], [36.0, 38.0, 10.0], atol=1e-9)
    # narrower towards the top, as a dome is
    mesh = mapped(mesh, lambda p: p * np.column_stack([np.ones((len(p), 2)), 1.0 - 0.4 * p[:, 1] / 50.0]))
    face = 10.0 * (1.0 - 0.4 * 38.0 / 50.0)
    found = marks_of(mesh, [POINT], near=True)[0].of(mesh.points)[1]
    assert np.allclose(found[:2], [36.0, 38.0], atol=1e-9)
    # eight halvings of the 7.5 mm to the highest z
    assert face - 7.5 / 2**8 <= found[2] <= face + 1e-6


@pytest.mark.parametrize("dim", [2, 3])
def test_the_picture_shows_the_gauge_beside_the_pressure_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dim: int
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh = finger((12, 5, 4)[:dim])
    result = pressed(mesh)
    finger_picture(tmp_path / "with.png", mesh, **result, marks=marks_of(mesh, [POINT, LONG], near=dim == 3))
    finger_picture(tmp_path / "without.png", mesh, **result)
    assert share(tmp_path / "without.png", COLOUR, within=0.02) == 0.0
    image = pixels(tmp_path / "with.png")
    marked = np.all(np.abs(image - [0xB0 / 255, 0.0, 0x6A / 255]) < 0.02, axis=-1)
    half = image.shape[1] // 2
    assert marked[:, :half].sum() > 100
    assert not marked[:, half:].any()


@pytest.mark.slow
def test_pyvista_draws_a_solid_where_opengl_works(tmp_path: Path, of_solid: tuple[Mesh, dict[str, Any]]) -> None:
    mesh, result = of_solid
    tiny = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Sphere()); p.screenshot()"
    with renderer.running_child([sys.executable, "-c", tiny]) as outcome:
        works = outcome() is None
    finger_picture(tmp_path / "f.png", mesh, **result, title="Fig. 9", thing=OBJECT)
    assert_shows_the_zones(tmp_path / "f.png")
    assert works is not bool(renderer.FAILURES)


def test_a_crash_of_the_renderer_is_survived_and_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_solid: tuple[Mesh, dict[str, Any]]
) -> None:
    # Without an EGL driver and a display VTK ends its process by a segmentation fault; abort() is as hard.
    (tmp_path / "sitecustomize.py").write_text(
        f"import os, pathlib\npathlib.Path({str(tmp_path / 'tried')!r}).open('a').write('x')\nos.abort()\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    mesh, result = of_solid
    for name in ("one.png", "two.png"):
        finger_picture(tmp_path / name, mesh, **result)
        assert_shows_the_zones(tmp_path / name)
    assert (tmp_path / "tried").read_text() == "x"
    assert "signal 6" in renderer.FAILURES[0]


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


# --- finger3d show: pictures, and one line on what is missing


GAUGE = {"name": "g", "x_mm": 0.0, "y_mm": 1.0, "z_mm": 0.0, "angle_deg": 0.0, "length_mm": 0.0}
NAN = math.nan
SCENES: list[object] = [
    None, 5, [], {"title": 5}, {"gauge": 5}, {"gauge": [1]}, {"gauge": [{}]},
    *({"gauge": [{**GAUGE, key: value}]} for key in ("x_mm", "angle_deg") for value in (None, "a", [1], 10**400, NAN)),
]  # fmt: skip


def test_a_damaged_summary_is_one_line_that_names_the_file(
    section: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "steps.npz").symlink_to(section / "steps.npz")
    path = tmp_path / "summary.json"
    texts = ["", "{", "[]", "5", "null", "[" * 100_000, "{}", *(json.dumps({"scene": s}) for s in SCENES)]
    for data in [*(text.encode() for text in texts), b'{"scene": "\xe9"}']:
        path.write_bytes(data)
        assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 2, data
        err = capsys.readouterr().err
        assert len(err.splitlines()) == 1
        assert str(path) in err
        assert "again" in err  # the cure
    assert not (tmp_path / "a.png").exists()


# --- exploded views of molds, and pictures of the steps of casting ---------------------------------------------------


PARTS = {
    "half_a": box(20.0, 10.0, 5.0, (0.0, 5.0, -2.5)),
    "half_b": box(20.0, 10.0, 5.0, (0.0, 5.0, 2.5)),
    "lid": box(20.0, 2.0, 10.0, (0.0, -1.0, 0.0)),
    "sensor": box(8.0, 6.0, 4.0, (0.0, 3.0, 0.0)),
}


def test_parts_are_moved_apart_and_fit_into_the_picture() -> None:
    view = scenery(standing(taken_apart(PARTS)))
    ends = {name: (part.points.min(axis=0), part.points.max(axis=0)) for name, part in view.parts.items()}
    # poured with the lid on top, and the halves apart along z
    assert ends["lid"][0][1] > max(ends[name][1][1] for name in PARTS if name != "lid") - 1e-9
    gap = ends["half_b"][0][2] - ends["half_a"][1][2]
    assert abs(gap) > 5.0
    assert np.allclose(view.parts["sensor"].points, PARTS["sensor"].points * [1.0, -1.0, -1.0])
    seen = np.vstack([view.camera.flat(part.points) for part in view.parts.values()])
    assert (np.abs(seen) <= view.half).all()
    assert np.abs(seen).max(axis=0) == pytest.approx(view.half / 1.08)


def test_every_step_has_a_picture_of_its_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    pour = {name: part for name, part in PARTS.items() if name != "lid"}
    write_pictures({tmp_path / "1.png": scenery_on_the_bed(PARTS), tmp_path / "2.png": scenery(pour)})
    lid, sensor = "#8d8a84", "#f28e2b"
    assert share(tmp_path / "1.png", lid, within=0.2) > 0.01
    assert share(tmp_path / "2.png", lid, within=0.05) < 0.01
    assert share(tmp_path / "2.png", sensor, within=0.3) > 0.0
