"""Young's modulus from Shore hardness."""

from __future__ import annotations

import math

import pytest

from finger3d.materials.modulus import of_shore, youngs_modulus
from finger3d.materials.shore import (
    SOFTER_A,
    SPREAD_00,
    SPREAD_A,
    modulus_of_shore_00,
    modulus_of_shore_A,
)
from finger3d.materials.silicones import silicones


def test_the_formula_of_gent_is_that_of_a_rigid_punch() -> None:
    """F = 2 E a h / (1 - nu^2) with nu = 0.5; the radius a is the mean of 0.395 mm at the tip of the truncated cone and
    0.635 mm at its shaft, the spring force F = 0.55 + 0.075 S in N (ASTM D2240)."""
    for shore in (10.0, 20.0, 50.0, 80.0):
        force, depth = 0.55 + 0.075 * shore, 2.54 * (1.0 - shore / 100.0)
        punch = force * (1.0 - 0.25) / (2.0 * 0.515 * depth)
        assert modulus_of_shore_A(shore) == pytest.approx(punch, rel=0.01)


@pytest.mark.parametrize("shore", [20.0, 30.0, 40.0])
def test_gent_agrees_with_simulated_tests_to_a_fifth(shore: float) -> None:
    """Qi, Joyce and Boyce 2003: log10 E = 0.0235 S - 0.6403."""
    assert modulus_of_shore_A(shore) == pytest.approx(10.0 ** (0.0235 * shore - 0.6403), rel=0.2)


def test_the_sphere_at_the_depth_of_its_reading() -> None:
    """Hertz's force of a sphere, 16/9 E sqrt(R) h^1.5 for nu = 0.5, is the spring's."""
    for shore in (10.0, 30.0, 60.0):
        depth = 2.54 * (1.0 - shore / 100.0)
        force = 16.0 / 9.0 * modulus_of_shore_00(shore) * math.sqrt(1.19) * depth**1.5
        assert force == pytest.approx(0.203 + 0.00908 * shore, rel=1e-12)


@pytest.mark.parametrize(("scale", "spread"), [("A", SPREAD_A), ("00", SPREAD_00)])
def test_the_spread_is_the_scatter_about_measured_silicones(scale: str, spread: float) -> None:
    """Root mean square of the logarithm of the ratio, with 5 points of hardness (uniform) as the standard tolerance."""
    errors, slopes = [], []
    for one in silicones().values():
        found, converted = youngs_modulus(one), of_shore(scale, one.shore)
        if one.scale == scale and "Shore" not in found.origin:
            errors.append(math.log(converted.E_MPa / found.E_MPa))
            slopes.append(math.log(of_shore(scale, one.shore + 1.0).E_MPa / converted.E_MPa))
    assert len(errors) >= 4
    scatter = math.sqrt(sum(e * e for e in errors) / len(errors))
    points = 5.0 / math.sqrt(3.0) * sum(slopes) / len(slopes)
    assert math.hypot(scatter, points) == pytest.approx(spread, abs=0.05)
    if scale == "A":
        assert math.exp(sum(errors) / len(errors)) == pytest.approx(SOFTER_A, rel=0.05)


@pytest.mark.parametrize("convert", [modulus_of_shore_A, modulus_of_shore_00])
def test_harder_is_stiffer_and_the_ends_of_the_scale_are_refused(convert) -> None:
    moduli = [convert(float(s)) for s in range(5, 91)]
    assert all(a < b for a, b in zip(moduli, moduli[1:], strict=False))
    for shore in (4.9, 90.1, math.nan):
        with pytest.raises(ValueError, match="from 5 to 90"):
            convert(shore)
