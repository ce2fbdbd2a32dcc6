"""Command ``export``: files of the finger, and the mold with its table."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from finger3d.cli import main
from finger3d.scene import load
from tests.scenes import BLOCK, written

STEPS = ("1_print", "2_prepare", "3_close", "4_pour", "5_open")


def test_the_command_writes_a_mold(scene, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    out = tmp_path / "Gießform, neu"
    assert main(["export", str(scene), "--out", str(out), "--mold", "--shrinkage=0.002"]) == 0
    printed, err = capsys.readouterr()
    assert err == ""
    names = {"finger.step", "finger.stl", "mold.3mf", "mold.step", "mold.png", "sheet.txt"}
    names |= {f"mold_{part}.stl" for part in ("half_a", "half_b", "lid")}
    names |= {"mold.html"} | {f"mold_step_{step}.png" for step in STEPS}
    names |= {"mold_exploded.step"}
    assert {f.name for f in out.glob("[!.]*")} == names
    text = (out / "sheet.txt").read_text(encoding="utf-8")
    volume = load(scene).design.volume_mm3 / 0.998**3 / 1e3
    assert f"cavity              {volume:.2f} ml" in text
    assert "g36" in text
    assert "remark" not in printed
    assert max(len(line) for line in text.splitlines()) <= 120
    from matplotlib.image import imread

    assert imread(out / "mold.png")[..., :3].std() > 0.05


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--wall-mm", "20"], "--mold"),
        (["--mold", "--mesh"], "--mold, --mesh"),
        (["--mold", "--riser", "0.04"], "--riser is gone: .*--pour-mm"),
        (["--mold", "--carrier"], "--carrier is gone: .*rigid = true"),
        (["--mold", "--no-plugs"], "--no-plugs is gone: .*tape"),
        (["--tolerance-mm", "0"], "--tolerance-mm 0.0"),
        (["--tolerance-mm", "nan"], "--tolerance-mm nan"),
        (["--mold", "--split", "y"], "y"),
        (["--mold", "--wall-mm", "4"], "--wall-mm 4.0"),
        (["--mold", "--set", "gauge=[]", "--split-mm", "11"], "split"),
    ],
)
def test_the_command_refuses_in_one_line(arguments, told, scene, tmp_path, capsys) -> None:
    assert main(["export", str(scene), "--out", str(tmp_path / "out"), *arguments]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert re.search(told, err)
    assert not list((tmp_path / "out").glob("*"))


def test_a_folder_that_cannot_be_written(scene, capsys) -> None:
    assert main(["export", str(scene), "--out", str(scene)]) == 2
    assert "is a file" in capsys.readouterr().err


def test_export_prints_json_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(written(tmp_path, BLOCK)), "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["results"] == str(tmp_path / "out")
    assert [Path(file).name for file in found["files"]] == ["finger.step", "finger.stl"]
    # a box: its triangles are the box
    assert found["volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0)
    assert found["stl_volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0, rel=1e-6)
    assert found["silicone_ml"] is None
    assert found["remarks"] == []
