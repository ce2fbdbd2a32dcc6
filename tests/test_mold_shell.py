"""Triangulated solids."""

from __future__ import annotations

import numpy as np

from finger3d.mold.shell import shell


def test_the_tolerance_is_absolute(paper_finger) -> None:
    """Sag of a chord on R = 100 at most what was asked: every edge's middle is that near to the arc."""
    for tolerance in (0.05, 0.005):
        surface = shell(paper_finger.solid(), tolerance, "finger").surface
        middle = 0.5 * (surface.corners + np.roll(surface.corners, -1, axis=1)).reshape(-1, 3)
        centre = paper_finger.height_mm - 100.0
        arc = middle[:, 1] > 36.6 + 1e-6
        top = np.abs(middle[arc, 0]) < 50.0 - 1e-6
        sag = 100.0 - np.hypot(middle[arc, 0], middle[arc, 1] - centre)[top & (np.abs(middle[arc, 2]) > 9.999)]
        assert 0.2 * tolerance < sag.max() <= tolerance
