"""Bodies of CAD and of triangles."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.registry import designs
from finger3d.mold.body import Body
from finger3d.mold.shell import shell
from finger3d.mold.solids import between
from tests.bodies import box
from tests.mold_cases import BODIES


@pytest.mark.parametrize("cad", [True, False])
def test_a_body_is_scaled_turned_and_moved(cad) -> None:
    solid = between((-1.0, 0.0, -3.0), (1.0, 4.0, 3.0))
    body = Body.of(solid if cad else box(2.0, 4.0, 6.0, (0.0, 2.0, 0.0)), 0.1)
    found = body.scaled(2.0).opening_along_z("x").at(5.0)
    np.testing.assert_allclose(found.box[0], [-6.0 + 5.0, 0.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(found.box[1], [6.0 + 5.0, 8.0, 2.0], atol=1e-6)
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
