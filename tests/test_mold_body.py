"""Bodies of CAD and of triangles, and triangulated solids."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.registry import designs
from finger3d.mold.body import Body, shell
from finger3d.mold.solids import between
from tests.bodies import box
from tests.mold_cases import BODIES


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


@pytest.mark.parametrize("cad", [True, False])
def test_a_body_is_scaled_and_turned(cad) -> None:
    solid = between((-1.0, 0.0, -3.0), (1.0, 4.0, 3.0))
    body = Body.of(solid if cad else box(2.0, 4.0, 6.0, (0.0, 2.0, 0.0)), 0.1)
    found = body.scaled(2.0).opening_along_z("x")
    np.testing.assert_allclose(found.box[0], [-6.0, 0.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(found.box[1], [6.0, 8.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(found.surface.low, found.box[0], atol=1e-6)
    assert found.volume_mm3 == pytest.approx(8.0 * 48.0)
    assert found.surface.volume == pytest.approx(8.0 * 48.0)
    # x of the body has become z, and not -z
    mark = Body.of(between((0.5, 0.0, 0.0), (1.0, 1.0, 1.0)), 0.1).opening_along_z("x")
    assert mark.box[0][2] == pytest.approx(0.5)
    assert mark.surface.low[2] == pytest.approx(0.5)


@pytest.mark.parametrize("cad", [True, False])
def test_shared_volumes(cad) -> None:
    body = Body.of(between((0, 0, 0), (2, 2, 2)) if cad else box(2.0, 2.0, 2.0, (1.0, 1.0, 1.0)), 0.1)
    assert body.shared(between((1, 1, 1), (3, 3, 3))) == pytest.approx(1.0)


def test_a_body_of_triangles_is_cut_from_a_part() -> None:
    ball = Body(shell(designs()["hemisphere"](**BODIES["hemisphere"]).solid(), 0.01, "ball").surface, None)
    block = shell(between((-10, 0, -10), (10, 10, 10)), 0.1, "block")
    assert ball.cut_from(block).surface.volume == pytest.approx(4000.0 - ball.volume_mm3, rel=1e-6)
