"""Pictures of fingers and molds: sections, solids, gauges and renderers."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.contact.zones import Zone, border_shares
from finger3d.fem.mesh.simplex import CONTACT, Mesh, quadratic
from finger3d.mechanics.model import Gauge, MeshOptions
from finger3d.meshing.structured.swept import mesh_section
from finger3d.plotting import renderer
from finger3d.plotting import solid as render
from finger3d.plotting.deformed import draw_finger
from finger3d.plotting.gauges import COLOUR, marks_of
from finger3d.plotting.mold import scenery, scenery_on_the_bed, standing, taken_apart, write_pictures
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
from finger3d.plotting.renderer import AXES, WINDOW, flat, framed, half_height, viewer_axes
from finger3d.plotting.show import mesh_of
from finger3d.plotting.solid import COLOURS, DeformedFinger
from finger3d.results.states import load_states
from tests.bodies import ball, box
from tests.designs import FIG9
from tests.meshes import grid, mapped
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


def test_the_boundary_of_a_status_is_straight_across_a_facet() -> None:
    """One corner that slips has the triangle between it and the middles of its edges, a quarter of the facet."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    seven = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0)), corners.mean(axis=0)])
    sides = seven[render._SIX]
    area = 0.5 * np.abs(np.linalg.det(sides[:, 1:] - sides[:, :1]))
    assert area.sum() == pytest.approx(0.5)
    for one in range(3):
        status = np.full(3, STICK)
        status[one] = SLIP
        slips = render._status_on_six(status[None])[0] == SLIP
        assert slips.sum() == 1
        assert area[slips].sum() == pytest.approx(0.125)
        assert (sides[slips] == corners[one]).all(axis=2).any()
    shares = [area[render._status_on_six(np.array([[OPEN, STICK, SLIP]]))[0] == s].sum() for s in (OPEN, STICK, SLIP)]
    assert shares == pytest.approx([1.0 / 6.0] * 3)


@pytest.mark.parametrize("quadratic", [False, True])
def test_borders_cross_the_sides_of_a_facet_where_the_zones_have_them(quadratic: bool) -> None:
    """A corner that sticks to the share t of both sides has t^2 of the facet, one that is open leaves 1 - (1 - t)^2."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
    facets = np.arange(6 if quadratic else 3)[None]
    for t in (0.2, 0.5, 0.8):
        for status, zone_is_stick, part in (
            ([STICK, SLIP, SLIP], True, t**2),
            ([OPEN, SLIP, SLIP], False, 1.0 - (1.0 - t) ** 2),
        ):
            state = np.array(status)
            zones = tuple(
                Zone(inside, lambda last, beyond, t=t: np.full(len(last), t))
                for inside in (state != OPEN, state == STICK)
            )
            point = np.concatenate([np.arange(3), np.full(3, -1)])
            triangles, pressure, of = render._coloured(facets, points, point, np.arange(3.0), state, zones)
            arms = triangles[:, 1:] - triangles[:, :1]
            area = 0.5 * np.cross(arms[:, 0], arms[:, 1])[:, 2]
            assert area.min() > 0.0
            assert area.sum() == pytest.approx(0.5)
            inside = of == STICK if zone_is_stick else of != OPEN
            assert area[inside].sum() == pytest.approx(0.5 * part)
            assert pressure == pytest.approx(triangles @ [1.0, 2.0, 0.0])  # linear on the facet


def test_a_border_beside_a_place_without_contact_point_is_midway() -> None:
    zones = tuple(Zone(np.array([True, True]), lambda last, beyond: np.full(len(last), 0.9)) for _ in range(2))
    assert border_shares(np.array([[0, -1], [0, 1]]), np.array([STICK, STICK]), zones) == pytest.approx([0.5, 0.5])


# --- panels of pictures of a finger, and outlines of sections --------------------------------------------------------


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
    for place in boxes:
        assert place.height * high / (place.width * wide) == pytest.approx(aspect)
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


def test_the_render_and_the_marks_have_one_scale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the renderer crops is put back where the viewer sees it: the picture's ends are those of the body."""
    mesh = finger((12, 5, 4))
    skin = render.skin_of(deformed(mesh, **{**pressed(mesh), "displacement": np.zeros_like(mesh.points)}))
    seen = render.flat(skin.points)
    size = np.ptp(seen, axis=0)
    wide, high = render.WINDOW
    window = np.full((high, wide, 3), 255, dtype=np.uint8)
    pixel = 2.0 * render.half_height(size) / high
    low = np.round(0.5 * np.array([wide, high]) - 0.5 * size / pixel).astype(int)
    window[low[1] : high - low[1], low[0] : wide - low[0]] = 0
    monkeypatch.setattr(render, "rendering", lambda drawings: nullcontext(lambda: [window] * len(drawings)))
    with render.rendering_solid(skin, np.zeros((len(skin.contact), 3, 3))) as rendered:
        images, extent = rendered()
    assert images[0].shape[:2] == (high - 2 * low[1], wide - 2 * low[0])
    ends = [seen[:, 0].min(), seen[:, 0].max(), seen[:, 1].min(), seen[:, 1].max()]
    assert np.allclose(extent, ends, atol=pixel)  # the body's ends rounded to whole pixels


# --- pyVista renderer of surfaces, lines and arrows, and the camera of the pictures of a solid -----------------------


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


def test_a_missing_opengl_driver_is_survived(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(tmp_path / "no-such-driver.json"))
    monkeypatch.delenv("DISPLAY", raising=False)
    mesh, result = of_solid
    finger_picture(tmp_path / "f.png", mesh, **result)
    assert renderer.FAILURES
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


# --- finger3d show: pictures, and one line on what is missing


def test_the_mesh_of_the_steps_is_the_undeformed_whole_finger(section: Path) -> None:
    states = load_states(section / "steps.npz")
    mesh = mesh_of(states)
    scene = json.loads((section / "summary.json").read_text(encoding="utf-8"))["scene"]
    assert np.ptp(mesh.points[:, 0]) == pytest.approx(2.0 * scene["finger"]["radius_mm"], rel=1e-6)
    assert {"contact", "body"} <= set(mesh.facets)
    assert sum(len(f) for f in mesh.facets.values()) == len(states.facets)


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


def test_every_part_is_seen_in_its_colour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    write_pictures({tmp_path / "a.png": scenery(standing(taken_apart(PARTS)), "a mold", {"lid": "20 x 10 mm"})})
    for colour in ("#9db4c8", "#8d8a84"):  # half A and the lid, shaded
        assert share(tmp_path / "a.png", colour, within=0.2) > 0.01


def test_every_step_has_a_picture_of_its_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    pour = {name: part for name, part in PARTS.items() if name != "lid"}
    write_pictures({tmp_path / "1.png": scenery_on_the_bed(PARTS), tmp_path / "2.png": scenery(pour)})
    lid, sensor = "#8d8a84", "#f28e2b"
    assert share(tmp_path / "1.png", lid, within=0.2) > 0.01
    assert share(tmp_path / "2.png", lid, within=0.05) < 0.01
    assert share(tmp_path / "2.png", sensor, within=0.3) > 0.0
