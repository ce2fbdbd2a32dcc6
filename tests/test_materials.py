"""Silicones: moduli of sources and of hardnesses, elastic constants of a table, and the printed table."""

from __future__ import annotations

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.materials.modulus import (
    BATCH,
    NEO_HOOKEAN,
    NU,
    SHOULDERS,
    SOFTER_A,
    SPREAD_00,
    SPREAD_A,
    ElasticConstants,
    elastic_constants,
    modulus_of_shore_00,
    modulus_of_shore_A,
    of_shore,
    youngs_modulus,
)
from finger3d.materials.silicones import Silicone, silicone_named, silicones, sources

# --- young's modulus of a silicone from its sources and from Shore hardness ------------------------------------------


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


def made(**values) -> Silicone:
    return Silicone(name="mine", maker="me", scale="A", shore=20.0, sources=("me",), **values)


def test_a_neo_hookean_curve_has_this_modulus() -> None:
    stretch, shear = 2.0, 1.0
    stress = shear * (stretch - stretch**-2)
    assert pytest.approx(3.0 * shear / stress) == NEO_HOOKEAN


def test_the_shoulders_of_the_dumbbell() -> None:
    """ISO 37 type 1, as ASTM D412 die C: 33 mm of 6 mm, then arcs of 25 and 14 mm to tabs of 25 mm."""
    inner, outer, rise = 25.0, 14.0, 0.5 * (25.0 - 6.0)
    angle = math.acos(1.0 - rise / (inner + outer))
    length = (inner + outer) * math.sin(angle)
    x = np.linspace(0.0, length, 4001)
    first = inner - np.sqrt(inner**2 - np.minimum(x, inner * math.sin(angle)) ** 2)
    second = rise - outer + np.sqrt(outer**2 - np.minimum(length - x, outer * math.sin(angle)) ** 2)
    added = np.trapezoid(3.0 / (3.0 + np.where(x < inner * math.sin(angle), first, second)), x)
    assert (33.0 + 2.0 * added) / 33.0 == pytest.approx(SHOULDERS, abs=0.01)


def test_batches_scatter_about_their_data_sheets() -> None:
    families: dict[str, list[float]] = {}
    for name, one in silicones().items():
        if one.stress_100_tension_MPa and one.modulus_100_MPa:
            ratio = math.log(one.stress_100_tension_MPa / one.modulus_100_MPa)
            families.setdefault(name.split()[0], []).append(ratio)
    assert {name: len(ratios) for name, ratios in families.items()} == {"Ecoflex": 3, "Dragon": 3}
    variance = sum(np.var(r) * len(r) for r in families.values()) / sum(len(r) - 1 for r in families.values())
    assert math.sqrt(variance) == pytest.approx(BATCH, abs=0.01)


def test_one_estimate_is_the_middle_of_its_bounds() -> None:
    found = youngs_modulus(made(modulus_100_psi=100.0))
    low = 100.0 * 6.894757e-3
    assert found.E_MPa == pytest.approx(math.sqrt(low * 12.0 / 7.0 * low))
    assert found.spread == pytest.approx(math.hypot(BATCH, math.log(12.0 / 7.0) / math.sqrt(12.0)))
    assert found.origin.startswith("mine, 100 %")
    by_law = youngs_modulus(made(modulus_fit_MPa=0.5))
    assert (by_law.E_MPa, by_law.spread) == (pytest.approx(0.5), pytest.approx(BATCH))
    by_range = youngs_modulus(made(modulus_range_MPa=(1.0, 4.0)))
    assert by_range.E_MPa == pytest.approx(2.0)


def test_several_estimates_meet_in_their_geometric_mean() -> None:
    found = youngs_modulus(made(modulus_compression_MPa=0.1, modulus_fit_MPa=0.4))
    assert found.E_MPa == pytest.approx(0.2)
    # standard error of two logarithms that are log 4 apart: half of it
    assert found.spread == pytest.approx(math.hypot(BATCH, 0.5 * math.log(4.0)))
    assert all(source in found.origin for source in ("mine", "compression test", "hyperelastic law"))


def test_without_a_measurement_the_hardness_decides() -> None:
    found = youngs_modulus(made())
    assert (found.E_MPa, found.spread) == (of_shore("A", 20.0).E_MPa, of_shore("A", 20.0).spread)
    assert found.origin.startswith("mine, Shore A 20 by Gent 1958")


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("Ecoflex 00-10", 0.022, 0.0946), ("Ecoflex 00-30", 0.0441, 0.1182), ("Dragon Skin 30", 0.4556, 1.02)],
)
def test_the_modulus_lies_between_its_bounds(name: str, low: float, high: float) -> None:
    """Bounds: the slope of the tensile test, and the neo-Hookean modulus of the data sheet."""
    assert low < youngs_modulus(silicone_named(name)).E_MPa < high


# --- the table of silicones ------------------------------------------------------------------------------------------


def test_every_number_is_possible_and_every_silicone_has_its_sources() -> None:
    used = set()
    for one in silicones().values():
        assert one.scale in ("A", "00")
        assert 5.0 <= one.shore <= 90.0
        assert one.density_g_ml is None or 0.95 < one.density_g_ml < 1.35
        assert one.viscosity_Pa_s is None or 1.0 <= one.viscosity_Pa_s <= 100.0
        assert one.shrinkage is None or 0.0 < one.shrinkage <= 0.01
        assert one.pot_life_min is None or one.cure_h is None or one.pot_life_min < 60.0 * one.cure_h
        assert one.sources
        assert set(one.sources) <= set(sources())
        used |= set(one.sources)
    assert used == set(sources())


def test_case_spaces_and_speed_do_not_matter() -> None:
    for name in ("Dragon Skin 20", "DragonSkin20", " dragon-  Skin 20A", "DRAGON SKIN 20 fast"):
        assert silicone_named(name).name == "Dragon Skin 20"


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(Finger3dError, match='"Ecoflex 00-30"'):
        silicone_named("Eco-flx 0030")
    with pytest.raises(Finger3dError, match="Ecoflex 00-10, .* Sylgard 184; .*shore_A"):
        silicone_named("butter")


# --- elastic constants from the keys of a table ----------------------------------------------------------------------


def test_a_modulus_that_is_given_is_exact() -> None:
    found = elastic_constants({"E_MPa": 2, "nu": 0.3, "shore_A": None})
    assert found == ElasticConstants(2.0, None, "given", 0.3)
    assert str(found) == "2 MPa, given"


def test_a_silicone_brings_modulus_spread_and_origin() -> None:
    found = elastic_constants({"silicone": "ecoflex 00-30"})
    wanted = youngs_modulus(silicone_named("Ecoflex 00-30"))
    assert (found.E_MPa, found.spread, found.origin, found.nu) == (wanted.E_MPa, wanted.spread, wanted.origin, NU)
    assert str(found).startswith(f"{wanted.E_MPa:.3g} MPa +- 28 %, Ecoflex 00-30, ")
    assert elastic_constants({"silicone": "ecoflex 00-30", "nu": 0.5}).nu == 0.5


def test_a_hardness_is_converted() -> None:
    found = elastic_constants({"shore_00": 30.0})
    assert (found.E_MPa, found.spread) == (modulus_of_shore_00(30.0), SPREAD_00)
    assert "1.7 times softer" in elastic_constants({"shore_A": 30}).origin


def test_no_silicone() -> None:
    with pytest.raises(Finger3dError, match="Dragon Skin 10"):
        elastic_constants({"silicone": "dragn skin 10"})


# --- the table of silicones in docs/materials.md ---------------------------------------------------------------------


def test_the_page_has_a_row_for_every_silicone_and_a_number_for_every_source(root: Path) -> None:
    quoted = runpy.run_path(str(root / "docs" / "_quoted.py"))
    table = quoted["silicone_table"]()
    assert quoted["parts"]("docs/materials.md")[1] == table
    lines = table.splitlines()
    rows = [line for line in lines if line.startswith("|")][2:]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows] == list(silicones())
    assert [line.split(". ")[0] for line in lines if line[:1].isdigit()] == [str(i + 1) for i in range(len(sources()))]
    row = next(r for r in rows if r.startswith("| Dragon Skin 20 "))
    assert "| 0.423 | 25 % | 49 |" in row
