"""Animations of a press."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from finger3d.plotting.animation import frames, mesh_of, write_gif
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
