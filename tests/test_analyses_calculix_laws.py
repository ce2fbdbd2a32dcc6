"""Cards of CalculiX for the laws: their constants give the same energies."""

from __future__ import annotations

import re

import numpy as np
import pytest

from finger3d.analyses.calculix.laws import law_cards
from finger3d.fem.laws import MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.material import Isotropic
from tests.given_meshes import refused

MATERIAL = Isotropic(3.0, 0.4)
SHEAR, BULK = 3.0 / 2.8, 3.0 / 0.6
STRETCHES = np.array([1.3, 0.9, 1.0 / (1.3 * 0.9)])  # isochoric


def constants(cards: tuple[str, ...]) -> list[float]:
    return [float(number) for line in cards[1:] for number in line.split(",")]


def test_linear_elasticity() -> None:
    assert law_cards(MATERIAL, None) == ("*ELASTIC", "3, 0.4")
    assert "nu = 0.5" in refused(lambda: law_cards(Isotropic(1.0, 0.5), None))


@pytest.mark.parametrize(
    ("law", "name"),
    [
        (NeoHooke(1.0), "NEO HOOKE"),
        (MooneyRivlin(1.0, 0.3), "MOONEY-RIVLIN"),
        (Yeoh(1.0, 0.2, 0.1), "YEOH"),
        (Ogden(1.0, ((0.7, 2.0), (0.3, -3.0))), "OGDEN, N=2"),
    ],
)
def test_energies_of_the_manual_are_those_of_the_laws(law, name: str) -> None:
    """CalculiX CrunchiX user's manual 2.20, *HYPERELASTIC."""
    cards = law_cards(MATERIAL, law)
    assert cards[0] == f"*HYPERELASTIC, {name}"
    c = constants(cards)
    i1, i2 = (STRETCHES**2).sum(), (STRETCHES**-2.0).sum()
    match re.split(r"[ ,-]", name)[0]:
        case "NEO":
            energy, d1 = c[0] * (i1 - 3.0), c[1]
        case "MOONEY":
            energy, d1 = c[0] * (i1 - 3.0) + c[1] * (i2 - 3.0), c[2]
        case "YEOH":
            energy, d1 = sum(c[k] * (i1 - 3.0) ** (k + 1) for k in range(3)), c[3]
        case _:
            energy, d1 = sum(2.0 * mu / a**2 * ((STRETCHES**a).sum() - 3.0) for mu, a in (c[:2], c[2:4])), c[4]
    wanted = float(law.with_shear(SHEAR).energy(np.diag(STRETCHES)[None])[0])
    assert energy == pytest.approx(wanted, rel=1e-9)
    assert d1 == pytest.approx(2.0 / BULK, rel=1e-9)


def test_too_many_terms_are_refused() -> None:
    law = Ogden(1.0, ((0.25, 2.0), (0.25, 3.0), (0.25, 4.0), (0.25, -2.0)))
    line = refused(lambda: law_cards(MATERIAL, law))
    assert "effects.large_deformation.terms" in line
    assert re.search(r"\b3 terms\b.* 4$", line)
