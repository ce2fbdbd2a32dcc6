"""Stress of parts far stiffer than others."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d._types import Float
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.solids.hyperelastic import Hyperelastic, Relaxing


@pytest.mark.parametrize("law", [NeoHooke(1.0), MooneyRivlin(0.4, 0.3), Ogden(1.0, ((0.7, 2.0), (0.3, -2.0)))])
@pytest.mark.parametrize(("nu", "plane_stress"), [(0.3, False), (0.3, True), (0.5, False), (0.5, True)])
@pytest.mark.parametrize("relaxes", [False, True])
def test_a_stiff_part_has_the_stress_of_its_law_without_round_off(
    law: IsochoricLaw, nu: float, plane_stress: bool, relaxes: bool
) -> None:
    rng, points = np.random.default_rng(3), 6
    parts = Isotropic(1.0, nu), Isotropic(1e6, 0.3)
    material = Hyperelastic.of_parts(law, parts, np.repeat([0, 1], points // 2), plane_stress)
    slope, p = rng.normal(size=(points, 2, 2)), rng.normal(size=points)
    past = rng.normal(size=(points, 3, 3)) * (np.arange(points) >= points // 2)[:, None, None]
    past += np.swapaxes(past, 1, 2)

    def stress(size: float, exact: bool) -> Float:
        """Return the stress at the stiff points, over the size of the displacement gradients."""
        held = Relaxing(0.7, 0.8, 1e6 * size * past) if relaxes else None
        f = material.deformation(size * slope, held)
        pressure = 1e6 * size * p if material.mixed else None
        return material.stress(f, pressure, held, size * slope if exact else None)[points // 2 :] / size

    by_law, scale = stress(1e-5, False), np.abs(stress(1e-5, False)).max()
    assert np.abs(stress(1e-5, True) - by_law).max() < 1e-4 * scale  # both are linear but for some strains of 1e-5
    assert np.abs(stress(1e-15, True) - by_law).max() < 1e-4 * scale
    assert np.abs(stress(1e-15, False) - by_law).max() > 1e-4 * scale
