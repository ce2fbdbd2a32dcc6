"""Files of the finger."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from finger3d.errors import Finger3dError
from finger3d.geometry.imported import imported
from finger3d.mold.export import export
from finger3d.mold.options import MoldOptions
from finger3d.scene import parse
from tests.mold_cases import BODIES, scene_of


@pytest.mark.parametrize(("name", "text"), [*((name, False) for name in sorted(BODIES)), ("half_cylinder", True)])
def test_every_design_becomes_a_closed_stl_in_mm(name, text, tmp_path: Path) -> None:
    scene = scene_of(name)
    done = export(scene, tmp_path, text=text)
    assert [f.name for f in done.files] == ["finger.step", "finger.stl"]
    assert (tmp_path / "finger.stl").read_bytes().startswith(b"solid") == text
    mesh = trimesh.load(tmp_path / "finger.stl")
    assert mesh.is_watertight
    assert mesh.body_count == 1
    # promised: within 1e-3 of the closed form
    assert mesh.volume == pytest.approx(scene.design.volume_mm3, rel=1e-3)
    assert done.volume_mm3 == scene.design.volume_mm3
    height, width = scene.design.height_mm, scene.design.width_mm
    np.testing.assert_allclose(mesh.extents[1:], [height, width], atol=2 * done.tolerance_mm)


def test_the_step_file_is_the_finger(paper_finger, tmp_path: Path) -> None:
    export(scene_of("clipped_cylinder"), tmp_path)
    again = imported(tmp_path / "finger.step")
    assert again.solid().volume == pytest.approx(paper_finger.volume_mm3, rel=1e-9)
    assert again.height_mm == pytest.approx(paper_finger.height_mm, abs=1e-3)


def test_an_imported_stl_is_written_as_it_is(tmp_path: Path) -> None:
    export(scene_of("block"), tmp_path / "first")
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "first" / "finger.stl")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
        }
    )
    done = export(scene, tmp_path / "second")
    assert [f.name for f in done.files] == ["finger.stl"]
    assert any("finger.step" in text for text in done.remarks)
    assert trimesh.load(tmp_path / "second" / "finger.stl").volume == pytest.approx(16000.0, rel=1e-6)
    before = (tmp_path / "first" / "finger.stl").read_bytes()
    with pytest.raises(Finger3dError, match="finger.stl"):
        export(scene, tmp_path / "first")
    assert (tmp_path / "first" / "finger.stl").read_bytes() == before
    with pytest.raises(Finger3dError, match="--parts"):
        export(scene, tmp_path / "third", MoldOptions(parts=True))
    assert not (tmp_path / "third").exists()


def test_a_step_file_away_from_the_origin_is_enlarged_about_its_base(tmp_path: Path) -> None:
    """A block drawn elsewhere: its cavity is larger by the shrinkage, and its base stays on y = 0."""
    from build123d import Box, Pos, export_step

    from finger3d.mold.parts import mold

    export_step(Pos(30.0, 50.0, 10.0) * Box(20.0, 8.0, 12.0), str(tmp_path / "away.step"))
    found = mold(imported(tmp_path / "away.step").solid(), (), MoldOptions(shrinkage=0.1))
    low, high = found.body.box
    np.testing.assert_allclose(low * 0.9, [-10.0, 0.0, -6.0], atol=1e-5)
    np.testing.assert_allclose(high * 0.9, [10.0, 8.0, 6.0], atol=1e-5)


@pytest.mark.slow
def test_a_step_file_with_splines_has_the_right_volume_and_a_mold(tmp_path: Path, monkeypatch) -> None:
    """CAD's own volume is more than 5 % wrong here; wanted is the integral of 8 + 2 sin 1.2 x over 54 mm, times 30."""
    from build123d import Polyline, Spline, export_step, extrude, make_face

    x = 0.3 * np.arange(181)
    top = [(float(a), float(8.0 + 2.0 * np.sin(1.2 * a))) for a in x]
    face = make_face([Spline(*top), Polyline(top[-1], (54.0, 0.0), (0.0, 0.0), top[0])])
    solid = extrude(face, 30.0)
    wanted = 30.0 * (8.0 * 54.0 + 2.0 / 1.2 * (1.0 - math.cos(1.2 * 54.0)))
    assert abs(solid.volume / wanted - 1.0) > 0.05
    export_step(solid, str(tmp_path / "wavy.step"))
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "wavy.step")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
        }
    )
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    done = export(scene, tmp_path / "out", MoldOptions(shrinkage=0.01))
    assert trimesh.load(tmp_path / "out" / "finger.stl").volume == pytest.approx(wanted, rel=1e-3)
    assert done.volume_mm3 == pytest.approx(wanted, rel=1e-4)
    assert done.silicone_ml == pytest.approx(wanted / 0.99**3 / 1e3, rel=1e-4)


@pytest.mark.parametrize("parts", [False, True])
def test_a_rigid_part_is_printed_and_its_volume_is_not_poured(parts, tmp_path: Path, monkeypatch) -> None:
    """A block of 20 x 8 x 12 mm with a core of 8 x 5 x 12 mm: 1.92 ml less .48 ml."""
    from build123d import Box, Compound, Pos, export_step

    core = Pos(0.0, 2.5, 0.0) * Box(8.0, 5.0, 12.0)
    body = Pos(0.0, 4.0, 0.0) * Box(20.0, 8.0, 12.0) - core
    core.label = "core"
    export_step(Compound(children=[body, core]), str(tmp_path / "two.step"))
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "two.step")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "parts": {"core": {"rigid": True}},
            "press": {"depth_mm": 1.0},
        }
    )
    monkeypatch.setattr("finger3d.mold.output.step_pictures", lambda pictures: None)  # drawn in tests of the page
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    done = export(scene, tmp_path / "out", MoldOptions(parts=parts))
    assert done.silicone_ml == pytest.approx(1.44, rel=1e-6)
    # two blind holes for the pegs, at most 4.4 mm wide and 2.7 mm deep
    insert = trimesh.load(tmp_path / "out" / "mold_insert_core.stl").volume
    assert 480.0 - 2.0 * math.pi * 2.2**2 * 2.7 < insert < 480.0
    assert any("core is rigid" in text for text in done.remarks)
    assert "1.44 ml" in (tmp_path / "out" / "sheet.txt").read_text()


def test_an_export_leaves_nothing_of_an_older_one(tmp_path: Path) -> None:
    for name in ("mold.3mf", "mold_bed_2.3mf", "mold_plug_1a.stl", "sheet.txt", "mine.txt"):
        (tmp_path / name).write_text("older")
    export(scene_of("block"), tmp_path)
    assert {f.name for f in tmp_path.glob("[!.]*")} == {"finger.step", "finger.stl", "mine.txt"}
