"""Strain maps read what a gauge at the same place reads."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.mechanics.discretise.build import build
from finger3d.sensor.maps import Reader, StrainMap
from tests.sensor_cases import SCENE, scene


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_the_map_reads_what_a_gauge_there_reads(domain: str) -> None:
    """The middles of squares at (35.5, 39.5) and, in the mirrored half, (-20.5, 30.5) mm."""
    places = [(35.5, 39.5), (-20.5, 30.5)]
    gauges = [{"name": f"{x}:{a}", "x_mm": x, "y_mm": y, "angle_deg": a} for x, y in places for a in (0.0, 40.0, 90.0)]
    size = {"size_mm": 8.0, "base_size_mm": 14.0, "mesher": "swept"} if domain == "solid" else SCENE["mesh"]
    model = scene(gauge=gauges, model={"domain": domain}, mesh=size).model()
    problem = build(model)
    frames = {mu: pressing.press(problem, mu).frame for mu in (0.2, 0.4)}
    found = StrainMap.of(problem, frames)
    for x, y in places:
        i, j = int(np.argmin(np.abs(found.y - y))), int(np.argmin(np.abs(found.x - x)))
        for a in (0.0, 40.0, 90.0):
            got = found.along(math.radians(a))[:, i, j]
            assert got == pytest.approx([frames[mu].gauges[f"{x}:{a}"] for mu in (0.2, 0.4)], abs=1e-10)
    slope = found.slope_at(0.0, 0.3)
    assert slope.shape == (len(found.y), len(found.x))
    assert np.isnan(slope[-1, 0])  # beside the dome
    assert np.isfinite(slope[0]).all()


def test_the_map_of_a_mirror_image_is_a_mirror_image() -> None:
    problem = build(scene().model())
    found = StrainMap.of(problem, {mu: pressing.press(problem, mu).frame for mu in (0.2, 0.6)})
    assert np.allclose(found.along(0.5), found.along(math.pi - 0.5)[:, :, ::-1], atol=1e-12, equal_nan=True)
    best, angle = found.best()
    assert np.nanmax(found.worst_slope(0.5) - best) <= np.nanmax(best) * 0.05  # the best of 5 degree steps
    assert np.nanmin(angle) >= 0.0


def test_a_reader_of_a_linear_field_is_exact() -> None:
    problem = build(scene().model())
    u = problem.mesh.points @ np.array([[0.1, 0.3], [-0.2, 0.05]])
    read = Reader.at(problem.mesh, np.array([[10.0, 20.0], [0.0, 200.0]]), ()).strain(u)
    assert read[0] == pytest.approx([0.1, 0.05, 0.05], abs=1e-12)
    assert np.isnan(read[1]).all()
