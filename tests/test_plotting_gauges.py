"""Gauges are marked where they lie in the pressed finger."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from finger3d.mechanics.model import Gauge
from finger3d.plotting import solid
from finger3d.plotting.gauges import COLOUR, marks_of
from tests.meshes import mapped
from tests.pictures import finger, finger_picture, pixels, pressed, share

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
    skin = solid.skin_of(
        mesh, np.zeros_like(mesh.points), np.zeros(0), np.zeros((0, 3)), np.zeros(0, dtype=int),
        np.zeros(0, dtype=int), np.zeros(0, dtype=int),
    )  # fmt: skip
    middle, size = skin.frame
    wide, high = solid.WINDOW
    window = np.full((high, wide, 3), 255, dtype=np.uint8)
    pixel = 2.0 * solid.half_height(size) / high
    low = np.round(0.5 * np.array([wide, high]) - 0.5 * size / pixel).astype(int)
    window[low[1] : high - low[1], low[0] : wide - low[0]] = 0
    monkeypatch.setattr(solid, "rendering", lambda drawings: nullcontext(lambda: [window] * len(drawings)))
    with solid.rendering_solids([(skin, np.zeros((len(skin.contact), 3, 3)), False)]) as rendered:
        found = rendered()
    assert found is not None
    images, extent = found
    assert images[0].shape[:2] == (high - 2 * low[1], wide - 2 * low[0])
    seen = solid.flat(skin.points)
    ends = [seen[:, 0].min(), seen[:, 0].max(), seen[:, 1].min(), seen[:, 1].max()]
    assert np.allclose(extent, ends, atol=pixel)  # the body's ends rounded to whole pixels
    assert np.allclose(solid.flat(middle), 0.5 * (seen.min(axis=0) + seen.max(axis=0)))
