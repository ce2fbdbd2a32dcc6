"""The window."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from finger3d.plotting import renderer as opengl
from finger3d.plotting.window import values
from finger3d.results.states import load_states
from tests.pictures import marked, rgb


@pytest.mark.slow
def test_the_window_off_screen_answers_its_controls(solid: Path, section: Path, tmp_path: Path) -> None:
    for folder in (solid, section):
        picture = tmp_path / f"{folder.parent.name}.png"
        command = [sys.executable, "-P", "-m", "finger3d.plotting.window", str(folder), str(picture)]
        assert opengl.run_child(command) is None
        assert rgb(picture).std() > 10.0
        assert marked(rgb(picture)) > 30


def test_values_of_the_window(solid: Path) -> None:
    import pyvista

    states, end = load_states(solid / "steps.npz"), pyvista.read(solid / "fields.vtu")
    assert values(states, end, "displacement", 0).max() == pytest.approx(0.125, rel=0.2)
    assert np.array_equal(values(states, end, "status", 3), end["status"])
    assert np.isnan(values(states, end, "stress", 0)).all()
    # von Mises from its definition by the deviator
    tensor = np.asarray(end["stress"])[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    deviator = tensor - np.trace(tensor, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    wanted = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
    assert np.allclose(values(states, end, "stress", 3), wanted, rtol=1e-6)
    shear = values(states, end, "shear", 3)
    # friction is limited by mu times the pressure, in single precision
    assert (shear <= 0.25 * values(states, end, "pressure", 3) + 1e-6).all()
