"""markers.png."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.plotting.markers import draw


def table(moved: np.ndarray) -> dict[str, np.ndarray]:
    """Three markers on a line along x after two increments; `moved` (3, 3) at the end."""
    at = np.array([[-10.0, 5.0, 0.0], [0.0, 5.0, 0.0], [10.0, 5.0, 0.0]])
    columns = {"step": np.array([1, 1, 1, 2, 2, 2]), "depth_mm": np.array([1.0] * 3 + [2.0] * 3)}
    columns |= {f"{a}_mm": np.tile(at[:, k], 2) for k, a in enumerate("xyz")}
    both = np.vstack([0.5 * moved, moved])
    return columns | {f"displacement_{a}_mm": both[:, k] for k, a in enumerate("xyz")}


@pytest.mark.parametrize(("longest", "factor"), [(0.3, 5.0), (0.011, 200.0), (1.0, 2.0), (10.0, 0.2)])
def test_arrows_are_magnified_by_a_round_number_to_a_visible_length(
    longest: float, factor: float, tmp_path: Path, figures: list[Any]
) -> None:
    moved = np.array([[longest, -0.4, 0.0], [0.0, -0.6, 0.0], [-0.5 * longest, -0.4, 0.0]])
    moved[:, 1] *= longest
    draw(tmp_path / "a.png", table(moved))
    axes = figures[0].axes[0]
    assert f"drawn {factor:g} times" in axes.get_title()
    assert "2 mm" in axes.get_title()
    arrows = axes.collections[0]
    assert arrows.U == pytest.approx(factor * moved[:, 0])
    assert np.asarray(arrows.get_array()) == pytest.approx(moved[:, 1])
    # at most 12 percent of the 20 mm that the markers extend over
    assert np.hypot(arrows.U, arrows.V).max() <= 2.4 * (1.0 + 1e-9)


def test_a_solid_is_seen_along_the_press_axis(tmp_path: Path, figures: list[Any]) -> None:
    draw(tmp_path / "a.png", table(np.array([[0.1, -0.4, 0.2]] * 3)))
    assert figures[0].axes[0].get_ylabel() == "z (mm)"


def test_markers_that_do_not_move_are_drawn(tmp_path: Path, figures: list[Any]) -> None:
    draw(tmp_path / "a.png", table(np.zeros((3, 3))))
    assert "drawn 1 times" in figures[0].axes[0].get_title()
