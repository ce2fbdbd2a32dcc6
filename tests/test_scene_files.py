"""Files that a scene names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.objects import MeshObject
from finger3d.scene import load, parse
from finger3d.scene.files import contents
from tests.bodies import box, channel, write_stl
from tests.given_meshes import cube, vtu_of
from tests.scene_tables import scene_with_object


@pytest.mark.parametrize(
    ("surface", "table", "text"),
    [
        (box(2, 2, 2), {"x_mm": 50.0}, "never"),
        (channel(12.0, 4.9), {}, "base"),
        (box(2e3, 2e3, 2e3), {}, "200 .* 10 mm"),
        (box(2e-3, 2e-3, 2e-3), {}, r"10 mm.* 1000 "),
        (box(2, 2, 2), {"scale": 0.0}, "object.scale = 0.0: .* 1e-6 to 1e6"),
        (box(2, 2, 2), {"scael": 2.0}, '"scale"'),
        (Triangles(box(2, 2, 2).points, box(2, 2, 2).faces[2:]), {}, "closed"),
    ],
    ids=["beside", "base", "huge", "tiny", "scale", "misspelt", "hole"],
)
def test_objects_that_a_scene_refuses(tmp_path: Path, surface: Triangles, table: dict[str, Any], text: str) -> None:
    surface = replace(surface, points=surface.points * 1.0001)
    with pytest.raises(Finger3dError, match=text) as refused:
        parse(scene_with_object(write_stl(tmp_path / "object.stl", surface), **table))
    assert "\n" not in str(refused.value)


def test_paths_are_relative_to_the_scene_and_survive_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    write_stl(tmp_path / "parts" / "plate.stl", box(6.0, 1.0, 6.0))
    text = parse(scene_with_object(tmp_path / "parts" / "plate.stl")).to_toml()
    (tmp_path / "a.toml").write_text(text.replace(str(tmp_path / "parts"), "parts"), encoding="utf-8")
    monkeypatch.chdir("/")
    scene = load(tmp_path / "a.toml")
    assert isinstance(scene.object, MeshObject)
    elsewhere = tmp_path / "results"
    elsewhere.mkdir()
    (elsewhere / "scene.toml").write_text(scene.to_toml(), encoding="utf-8")
    assert load(elsewhere / "scene.toml") == scene


def test_a_finger_with_z_up_stays_so_in_the_scene_as_run(tmp_path: Path) -> None:
    scene = scene_with_object(write_stl(tmp_path / "plate.stl", box(6.0, 1.0, 6.0)))
    scene["finger"] = {"geometry": str(write_stl(tmp_path / "finger.stl", box(30.0, 12.0, 16.0)))}
    lying = parse(scene)
    scene["finger"]["up"] = "z"
    upright = parse(scene)
    assert (lying.design.height_mm, upright.design.height_mm) == (12.0, 16.0)
    assert upright != lying
    again = tmp_path / "again.toml"
    again.write_text(upright.to_toml(), encoding="utf-8")
    assert load(again) == upright
    scene["finger"]["up"] = "x"
    with pytest.raises(Finger3dError, match='finger.up = "x": must be "y" or "z"'):
        parse(scene)


def test_a_finger_that_was_drawn_in_another_unit_has_a_scale(tmp_path: Path) -> None:
    scene = scene_with_object(write_stl(tmp_path / "plate.stl", box(6.0, 1.0, 6.0)))
    inches = write_stl(tmp_path / "inches.stl", box(2.0, 1.0, 0.5))
    metres = vtu_of(tmp_path / "metres.vtu", cube(2, edge_mm=4e-3))
    for path, scale, size in ((inches, 25.4, (25.4, 12.7)), (metres, 1e3, (4.0, 4.0))):
        scene["finger"] = {"geometry": str(path), "scale": scale}
        found = parse(scene)
        assert (found.design.height_mm, found.design.width_mm) == pytest.approx(size, rel=1e-9)
        (tmp_path / "again.toml").write_text(found.to_toml(), encoding="utf-8")
        assert load(tmp_path / "again.toml") == found
        other = parse({**scene, "finger": {"geometry": str(path), "scale": 1.01 * scale}})
        assert other.design.cache_fields != found.design.cache_fields
    with pytest.raises(Finger3dError, match=r"give its scale in \[finger\], such as 1000 for metres"):
        parse({**scene, "finger": {"geometry": str(metres)}})


def test_object_scale_changes_the_object(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "inches.stl", box(0.2, 0.1, 0.2))
    obj = parse(scene_with_object(path, scale=25.4)).object
    assert isinstance(obj, MeshObject)
    assert obj.surface.volume == pytest.approx(0.004 * 25.4**3)


def test_the_contents_of_all_files_of_bodies_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "finger.step").write_bytes(b"1")
    (tmp_path / "coin.stl").write_bytes(b"1")
    given = {"finger": {"geometry": "finger.step"}, "object": {"shape": "mesh", "path": "coin.stl"}}
    first = contents(given, tmp_path / "scene.toml")
    (tmp_path / "coin.stl").write_bytes(b"2")
    second = contents(given, tmp_path / "scene.toml")
    assert [*first] == [*second] == [str(tmp_path / "finger.step"), str(tmp_path / "coin.stl")]
    assert [name for name in first if first[name] != second[name]] == [str(tmp_path / "coin.stl")]
    assert contents({"finger": {"geometry": "block"}}) == {}


def test_a_file_that_is_a_circle_of_links_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.step").symlink_to("a.step")
    for table in ({"geometry": "a.step"}, None):
        scene = scene_with_object(tmp_path / "a.step")
        with pytest.raises(Finger3dError, match=r"a\.step"):
            parse(scene | ({"finger": table} if table else {}), tmp_path / "scene.toml")
