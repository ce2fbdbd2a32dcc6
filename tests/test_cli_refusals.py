"""A refused command says one line that helps, and leaves nothing behind; --json prints JSON alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.cli import main
from finger3d.io import claimed

SCENE = """
[finger]
geometry = "block"
half_length_mm = 10.0
height_mm = 8.0
width_mm = 6.0
[material]
E_MPa = 1.0
nu = 0.3
[press]
depth_mm = 0.5
steps = 2
[model]
domain = "plane-strain"
[mesh]
size_mm = 1.0
base_size_mm = 4.0
[[gauge]]
name = "g"
x_mm = 4.0
y_mm = 6.0
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ["press", "--set", "friction.mu=-1"],
        ["compare", "--widths", "3,-1"],
        ["calibrate", "--gauge", "no such"],
        ["calibrate", "--gauge", "g", "--mu", "3:1:2"],
        ["calibrate", "--gauge", "g", "--tolerance", "luck=1"],
        ["sweep", "--vary", "friction.mu=-1,2"],
        ["optimise", "--free", "gauge.g9.x_mm=1:2"],
        ["export", "--mold", "--wall-mm", "-3"],
        ["export", "--tolerance-mm", "-1"],
    ],
    ids=" ".join,
)
def test_a_refused_command_leaves_no_folder(
    arguments: list[str], scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *options = arguments
    assert main([command, str(scene), *options, "--out", str(tmp_path / "deep" / "out")]) == 2
    assert len([line for line in capsys.readouterr().err.splitlines() if line.startswith("finger3d: ")]) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["scene.toml"]


def test_a_folder_into_which_nothing_was_written_goes_with_those_made_for_it(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    with claimed(mine / "a" / "b") as folder:
        assert folder.is_dir()
    assert list(mine.iterdir()) == []
    # one that was there stays, and so does one that holds something
    with claimed(mine):
        pass
    with claimed(mine / "c") as folder:
        (folder / "result").touch()
    assert mine.is_dir()
    assert (mine / "c" / "result").exists()


@pytest.mark.parametrize("name", ["nosuch.step", "sub/nosuch.stl"])
def test_a_finger_from_a_file_that_is_not_there_is_told_before_the_keys_of_the_old_design(
    name: str, scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(scene), "--set", f"finger.geometry={name}"]) == 2
    err = capsys.readouterr().err
    assert (
        f"with --set finger.geometry: finger.geometry: {tmp_path / name}: there is no such file; give its path" in err
    )
    assert "half_length_mm" not in err
    assert len(err.splitlines()) == 1


def test_beside_a_file_that_is_there_the_keys_of_a_design_are_told(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "finger.stl").touch()
    assert main(["plan", str(scene), "--set", "finger.geometry=finger.stl"]) == 2
    err = capsys.readouterr().err
    for text in ("finger.half_length_mm = 10.0: no such key beside a file, take it out", "[finger] takes geometry)",
                 "and 2 more mistakes"):  # fmt: skip
        assert text in err


def test_an_object_from_a_file_that_is_not_there(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(scene), "--set", 'object={shape="mesh", path="nosuch.stl"}']) == 2
    told = f"object.path: {tmp_path / 'nosuch.stl'}: there is no such file; give its path from the scene's folder"
    assert told in capsys.readouterr().err


def test_export_prints_json_alone(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(scene), "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["results"] == str(tmp_path / "out")
    assert [Path(file).name for file in found["files"]] == ["finger.step", "finger.stl"]
    # a box: its triangles are the box
    assert found["volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0)
    assert found["stl_volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0, rel=1e-6)
    assert found["silicone_ml"] is None
    assert found["remarks"] == []


def test_design_prints_json_alone(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    few = ["--free", "gauge.g.angle_deg=0:90", "--budget", "3", "--mu", "0.1,0.5", "--json"]
    assert main(["optimise", str(scene), *few, "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert found["best"] >= found["start"]
    assert 0.0 <= found["values"]["gauge.g.angle_deg"] <= 90.0
