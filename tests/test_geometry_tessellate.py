"""Triangulated CAD faces."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.tessellate import tessellate
from finger3d.meshing.structured.snap import check_closed
from tests.cad_cases import EXACT, body_of
from tests.designs import FIG9, HALF


@pytest.mark.parametrize(
    ("tolerance", "volume_error"), [(0.1, 1e-3), (0.01, 1e-4), (1e-3, 1e-5)]
)  # measured on this body: 7e-4, 7.5e-5, 7.6e-6
def test_tessellation_is_closed_and_as_fine_as_asked(tolerance: float, volume_error: float) -> None:
    solid = FIG9.solid()
    body = tessellate(solid, tolerance, exact=EXACT)
    check_closed(body.triangles)
    assert 0.2 * volume_error < 1.0 - body.volume_mm3 / FIG9.volume_mm3 < volume_error
    # The triangulation kept on the shape must not be handed out again.
    assert len(tessellate(solid, 10.0 * tolerance).triangles) < len(body.triangles)
    assert len(body.corners) == 8
    assert {len(f) for f in body.corner_faces} == {3}


def test_every_triangle_lies_on_its_labelled_face() -> None:
    body = body_of(HALF, ("x",), 1e-3)
    assert sorted(f.label for f in body.faces) == ["base", "contact", "ends", "ends", "symmetry_x"]
    middle = body.points[body.triangles].mean(axis=1)
    for i, face in enumerate(body.faces):
        assert np.abs(face.surface.distance(middle[body.face == i])[0]).max() < 2e-3
    assert set(body.labels) == {"base", "contact", "ends", "symmetry_x"}
    assert body.labels.count("base") == 2
