"""finger3d show: pictures without a display, the window off-screen, and one line where there is nothing to show."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from finger3d.cli import main

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


@pytest.mark.slow
def test_a_display_that_cannot_be_opened_is_one_line(section: Path) -> None:
    command = [sys.executable, "-m", "finger3d", "show", str(section)]
    env = {**os.environ, "DISPLAY": ":4711"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1
    assert "--png FILE" in done.stderr
