"""Bodies from files: STL and STEP read, checked, put on their base, meshed, snapped, cached by content; in scenes."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.geometry.cad import labelled_faces
from finger3d.geometry.files import read_solid
from finger3d.geometry.imported import imported
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing import cache
from finger3d.scene import parse
from tests.bodies import box, channel, step_of, write_stl
from tests.designs import SMALL
from tests.scene_tables import HALF_CYLINDER, scene_with_object

BOTH = ("x", "z")


@pytest.mark.parametrize("name", ["finger.step", "inches.step", "finger.stl"])
def test_a_finger_drawn_elsewhere_comes_onto_its_base(drawn: Path, name: str) -> None:
    body = imported(drawn / name)
    unit = 25.4 if name == "inches.step" else 1.0  # a STEP file says its unit
    assert body.name == name
    assert body.height_mm == pytest.approx(unit * SMALL.height_mm, rel=1e-4)
    assert body.half_length_mm == pytest.approx(unit * 10.0, rel=1e-4)
    assert body.width_mm == pytest.approx(unit * 8.0, rel=1e-4)
    assert body.volume_mm3 == pytest.approx(unit**3 * SMALL.volume_mm3, rel=1e-3)
    x, z = np.linspace(-9.9, 9.9, 50), np.linspace(-3.9, 3.9, 50)
    np.testing.assert_allclose(body.top(unit * x, unit * z), unit * SMALL.top(x, z), atol=unit * 3e-3)
    assert np.isnan(body.top(np.array([unit * 10.5]), np.zeros(1)))[0]
    assert body.mirrors() == (() if name == "finger.stl" else BOTH)


def step_with_base(path: Path, solid: Any, *bases: Any) -> Path:
    """A STEP file in which these faces of the solid are named base, as CAD programs write it."""
    step_of(path, solid)
    written = read_solid(path).faces()  # in the order of the file
    numbers = {min(range(len(written)), key=lambda i: (written[i].center() - f.center()).length) for f in bases}
    text, count = path.read_text(encoding="utf-8"), iter(range(99))
    text = re.sub(r"ADVANCED_FACE\(''", lambda m: m[0][:-2] + ("'Base'" if next(count) in numbers else "''"), text)
    assert text.count("'Base'") == len(bases)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("turn", [(90.0, 0.0, 0.0), (0.0, 0.0, 90.0), (0.0, 0.0, 180.0), (31.0, 0.0, 17.0), (0, 0, 0)])
def test_the_face_named_base_is_turned_down(tmp_path: Path, turn: tuple[float, float, float]) -> None:
    from build123d import Axis, Rot

    solid = SMALL.solid()
    base = solid.faces().sort_by(Axis.Y)[0]
    body = imported(step_with_base(tmp_path / "finger.step", Rot(*turn) * solid, Rot(*turn) * base))
    assert body.height_mm == pytest.approx(SMALL.height_mm, abs=1e-9)
    assert body.surface.low[1] == 0.0
    if turn[0] != 31.0:  # the shortest way down leaves that one turned about y
        np.testing.assert_allclose([2.0 * body.half_length_mm, body.width_mm], [20.0, 8.0], atol=1e-9)
    assert [f.label for f in labelled_faces(body.solid())].count("base") == 1
    assert body.volume_mm3 == pytest.approx(SMALL.volume_mm3, rel=1e-3)


@pytest.mark.slow
def test_a_face_named_base_that_is_none_is_refused(tmp_path: Path) -> None:
    from build123d import Axis, Box, Pos

    solid = (Box(8.0, 8.0, 4.0) + Pos(4.0, 0.0, 0.0) * Box(4.0, 2.0, 4.0)).solids()[0]  # a ledge on one side
    side = next(f for f in solid.faces() if f.normal_at(f.center()).X > 0.99 and abs(f.center().X - 4.0) < 1e-6)
    with pytest.raises(Finger3dError, match="2 mm .*'base'"):
        imported(step_with_base(tmp_path / "ledge.step", solid, side))
    both = [solid.faces().sort_by(axis)[0] for axis in (Axis.X, Axis.Y)]
    with pytest.raises(Finger3dError, match="2 .*'base'"):
        imported(step_with_base(tmp_path / "two.step", solid, *both))
    dome = next(f for f in SMALL.solid().faces() if not f.is_planar)
    with pytest.raises(Finger3dError, match="'base'"):
        imported(step_with_base(tmp_path / "round.step", SMALL.solid(), dome))


def test_a_body_drawn_with_z_up_is_turned_about_x(tmp_path: Path) -> None:
    from build123d import Axis, Rot

    upright = imported(step_of(tmp_path / "y.step", SMALL.solid()))
    lying = Rot(90.0, 0.0, 0.0) * SMALL.solid()
    path = step_of(tmp_path / "z.step", lying)
    body = imported(path, up="z")
    np.testing.assert_allclose(body.surface.high, upright.surface.high, atol=1e-9)
    np.testing.assert_allclose(
        body.top(np.array([3.0]), np.zeros(1)), SMALL.top(np.array([3.0]), np.zeros(1)), atol=3e-3
    )
    assert body.mirrors() == BOTH
    assert body.solid().bounding_box().max.Y == pytest.approx(SMALL.height_mm, abs=1e-9)
    assert body != imported(path)
    where = (options(1.0, 2.0), (-1.0, 1.0, -1.0, 1.0), ())
    assert cache.key(body, *where) != cache.key(imported(path), *where)
    # a face named base agrees with it
    based = imported(step_with_base(tmp_path / "base.step", lying, lying.faces().sort_by(Axis.Z)[0]), up="z")
    np.testing.assert_allclose(based.surface.high, body.surface.high, atol=1e-9)


def test_z_up_turns_y_to_minus_z_as_a_rotation_does(tmp_path: Path) -> None:
    drawn = box(30.0, 12.0, 16.0)
    drawn = replace(drawn, points=drawn.points * np.where(drawn.points[:, [1]] < 0.0, [0.5, 1.0, 1.0], 1.0))
    body = imported(write_stl(tmp_path / "wedge.stl", drawn), up="z")
    assert body.extent.startswith("30 x 16 x 12 mm (x, y up, z), base 30 x 12 mm; unit of the file: mm, as STL ")
    assert body.extent.endswith(", its z turned up")
    narrow = body.surface.points[:, 2] > 0.0  # y < 0 in the file
    assert np.abs(body.surface.points[narrow, 0]).max() == pytest.approx(7.5)
    assert body.volume_mm3 == pytest.approx(0.75 * 30.0 * 12.0 * 16.0)


def test_the_unit_of_a_step_file_is_told(tmp_path: Path) -> None:
    path = step_of(tmp_path / "finger.step", SMALL.solid())
    assert imported(path).unit == "mm, as it says"
    path.write_text(path.read_text(encoding="utf-8").replace(".MILLI.,.METRE.", ".CENTI.,.METRE."), encoding="utf-8")
    body = imported(path)
    assert body.unit == "cm, as it says"
    assert body.extent.startswith("200 x 76.79 x 80 mm (x, y up, z), base 200 x 80 mm; ")


def options(size: float, base: float) -> Any:
    return MeshOptions(size, base, "ftetwild")


def test_meshes_are_kept_by_the_files_content(drawn: Path, tmp_path: Path) -> None:
    renamed = shutil.copy(drawn / "finger.stl", tmp_path / "another.stl")
    where = (options(1.0, 2.0), (-1.0, 1.0, -1.0, 1.0), ())
    first, again = (cache.key(imported(p), *where) for p in (drawn / "finger.stl", renamed))
    assert first == again
    assert first != cache.key(imported(drawn / "finger.step"), *where)
    assert first != cache.key(imported(drawn / "finger.stl", scale=2.0), *where)


def test_a_channel_may_lie_on_its_side(tmp_path: Path) -> None:
    upright = channel(6, 4, 2, 5)
    lying = replace(upright, points=upright.points[:, [1, 0, 2]] * [1, -1, 1])
    assert imported(write_stl(tmp_path / "body.stl", lying)).volume_mm3 == pytest.approx(lying.volume)


def test_press_takes_a_finger_and_an_object_from_files(drawn: Path, tmp_path: Path, capsys: Any) -> None:
    write_stl(tmp_path / "plate.stl", box(30.0, 1.0, 20.0))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'effects.auto = false\n[finger]\ngeometry = "{drawn}/finger.step"\n[material]\nE_MPa = 1.0\n'
        'nu = 0.3\n[press]\ndepth_mm = 0.6\nsteps = 2\n[object]\nshape = "mesh"\npath = "plate.stl"\n'
        "[mesh]\nsize_mm = 1.2\nbase_size_mm = 3.0\n",
        encoding="utf-8",
    )
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures"]) == 0, capsys.readouterr().err
    import json

    got = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert got["outcome"] == "converged"
    assert got["mesh"]["symmetry"] == ["x", "z"]
    design = {
        "geometry": "clipped_cylinder",
        "radius_mm": 20.0,
        "half_length_mm": 10.0,
        "edge_height_mm": 5.0,
        "width_mm": 8.0,
    }
    same = parse(
        {
            **HALF_CYLINDER,
            "finger": design,
            "press": {"depth_mm": 0.6, "steps": 2},
            "mesh": {"size_mm": 1.2, "base_size_mm": 3.0, "mesher": "swept"},
        }
    )
    from finger3d.mechanics.discretise.build import build
    from finger3d.mechanics.march.solve import march
    from finger3d.mechanics.results.history import measure

    problem = build(same.model())
    wanted = measure(problem.points, list(march(problem))[-1])["normal_force_N"]
    assert got["steps"][-1]["normal_force_N"] == pytest.approx(wanted, rel=0.02)


def test_a_bad_file_ends_the_command_with_one_line_and_code_2(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "object.stl").write_text("no mesh")
    scene = tmp_path / "scene.toml"
    import tomli_w

    scene.write_text(tomli_w.dumps(scene_with_object(Path("object.stl"))), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"{scene}: object.path: " in said
    assert "STL" in said
    assert not (tmp_path / "out").exists()


def test_solids_away_from_the_origin_are_scaled_together(tmp_path: Path) -> None:
    # build123d's `scale` enlarges every solid about its own location.
    from build123d import Box, Compound, Pos, export_step

    solids = [Pos(30.0, 1.0, 0.0) * Box(4.0, 2.0, 4.0), Pos(30.0, 2.5, 0.0) * Box(4.0, 1.0, 4.0)]
    solids[1].label = "skin"
    path = tmp_path / "two.step"
    export_step(Compound(children=solids), path)
    half = imported(path, scale=0.5)
    assert half.volume_mm3 == pytest.approx((2.0 + 1.0) * 16.0 / 8.0)
    skin = half.solids()["skin"].bounding_box()
    assert (skin.min.Y, skin.max.Y) == pytest.approx((1.0, 1.5))
    assert (skin.min.X, skin.max.X) == pytest.approx((-1.0, 1.0))
