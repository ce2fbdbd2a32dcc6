"""finger3d show: pictures and animations without a display, the window off-screen, and one line on what is missing."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from finger3d.cli import main
from finger3d.plotting.show import frames, mesh_of, write_gif
from finger3d.results.states import load_states


def test_frames_share_axes_and_scale_and_the_last_is_held(section: Path, tmp_path: Path) -> None:
    states = load_states(section / "steps.npz")
    figures = frames(states, [0, len(states.pressure) - 1], "a title")
    limits = [figure.axes[0].get_xlim() + figure.axes[0].get_ylim() for figure in figures]
    assert limits[0] == limits[1]
    scales = [figure.axes[2].get_xlim() for figure in figures]
    assert scales[0] == scales[1] == pytest.approx((0.0, float(states.pressure[-1].max())))
    write_gif(tmp_path / "a.gif", figures)
    image, durations = Image.open(tmp_path / "a.gif"), []
    for k in range(image.n_frames):
        image.seek(k)
        durations.append(image.info["duration"])
    assert durations[-1] > 2 * durations[0]
    assert image.info["loop"] == 0


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


@pytest.mark.slow
def test_a_display_that_cannot_be_opened_is_one_line(section: Path) -> None:
    command = [sys.executable, "-m", "finger3d", "show", str(section)]
    env = {**os.environ, "DISPLAY": ":4711"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1
    assert "--png FILE" in done.stderr
