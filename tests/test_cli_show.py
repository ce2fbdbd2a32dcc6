"""Command ``show``: pictures, animations and the window."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.plotting import renderer as opengl
from tests.pictures import marked, orange, rgb


def frames(path: Path) -> list[np.ndarray]:
    from PIL import Image

    found = Image.open(path)
    out = []
    for k in range(found.n_frames):
        found.seek(k)
        out.append(np.asarray(found.convert("RGB"), dtype=float))
    return out


def test_a_section_as_picture_and_animation(section: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    png, gif = tmp_path / "with space" / "a.png", tmp_path / "a.gif"
    assert main(["show", str(section), "--png", str(png), "--gif", str(gif)]) == 0
    assert capsys.readouterr().out == f"{png} written\n{gif} written\n"
    assert orange(rgb(png)) > 5e-4  # two points at either edge slip, at 4e-4 each
    assert marked(rgb(png)) > 30
    first, *_, last = frames(gif)
    assert len(frames(gif)) == 4
    assert first.shape == last.shape
    assert min(orange(last), orange(first)) > 0.0
    assert np.abs(last - first).mean() > 0.5


@pytest.mark.parametrize("renderer", [pytest.param("", marks=pytest.mark.slow), "matplotlib"])
def test_a_solid_with_and_without_opengl(
    renderer: str, solid: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", renderer)
    monkeypatch.setattr(opengl, "FAILURES", [])
    assert main(["show", str(solid), "--png", str(tmp_path / "a.png"), "--step", "2"]) == 0
    image = rgb(tmp_path / "a.png")
    assert orange(image) > 1e-3
    assert marked(image) > 30
    # the left panel shows pressure, not status
    assert orange(image[:, ::-1]) < 0.5 * orange(image)
    assert main(["show", str(solid), "--png", str(tmp_path / "b.png")]) == 0
    assert np.abs(rgb(tmp_path / "b.png").mean() - image.mean()) > 0.01


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["nothing", "--png", "a.png"], 2, "nothing"),
        (["empty", "--png", "a.png"], 2, "empty"),
        (["cut", "--png", "a.png"], 3, "incomplete"),
        (["whole"], 3, "--png FILE"),
        (["whole", "--step", "1"], 2, "--step"),
        (["whole", "--png", "a.jpg"], 2, ".png"),
        (["whole", "--png", "a.png", "--step", "9"], 2, "increment 9 "),
        (["swept"], 2, "--png"),
        (["swept", "--png", "a.png", "--step", "1"], 2, "--png"),
        (["swept", "--png", "a.jpg"], 2, ".png"),
        (["swept", "--png", "a.png"], 2, "swept"),
        (["respelt", "--png", "a.png"], 2, "respelt"),
    ],
)
def test_nothing_to_show_is_one_line(
    arguments: list[str], code: int, said: str, section: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    (tmp_path / "empty").mkdir()
    (tmp_path / "cut").mkdir()
    cut = {"outcome": "incomplete", "scene": {"finger": {"geometry": "block"}}, "warnings": [], "advice": []}
    (tmp_path / "cut" / "summary.json").write_text(json.dumps(cut))
    (tmp_path / "swept").mkdir()
    (tmp_path / "swept" / "sweep.json").write_text(json.dumps({"vary": {"friction.mu": ["0.1", "0.2"]}}))
    (tmp_path / "respelt").mkdir()
    (tmp_path / "respelt" / "sweep.json").write_text(json.dumps({"vary": {"friction.mu": ["0.1", "0.2"]}}))
    (tmp_path / "respelt" / "results.csv").write_text("point;outcome\n0;converged\n")
    (tmp_path / "whole").symlink_to(section)
    assert main(["show", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.glob("a.*"))
