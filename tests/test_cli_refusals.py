"""A refused command says one line that helps, and leaves nothing behind; --json prints JSON alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.cli import main
from tests.scenes import BLOCK, written


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return written(tmp_path, BLOCK)


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


@pytest.mark.parametrize("name", ["nosuch.step", "sub/nosuch.stl"])
def test_a_finger_from_a_file_that_is_not_there_is_told_before_the_keys_of_the_old_design(
    name: str, scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(scene), "--set", f"finger.geometry={name}"]) == 2
    err = capsys.readouterr().err
    assert f"--set finger.geometry: finger.geometry: {tmp_path / name}: " in err
    assert "half_length_mm" not in err
    assert len(err.splitlines()) == 1


def test_beside_a_file_that_is_there_the_keys_of_a_design_are_told(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "finger.stl").touch()
    assert main(["plan", str(scene), "--set", "finger.geometry=finger.stl"]) == 2
    err = capsys.readouterr().err
    for text in ("finger.half_length_mm = 10.0: no such key beside this file, take it out",
                 "[finger] takes geometry, scale, up)", "and 2 more mistakes"):  # fmt: skip
        assert text in err


def test_an_object_from_a_file_that_is_not_there(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(scene), "--set", 'object={shape="mesh", path="nosuch.stl"}']) == 2
    told = f"object.path: {tmp_path / 'nosuch.stl'}: there is no such file; give its path from the scene's folder"
    assert told in capsys.readouterr().err
