"""Cards of CalculiX for the laws: their constants give the same energies."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from finger3d.analyses.calculix.deck import OBJECT
from finger3d.analyses.calculix.laws import law_cards
from finger3d.analyses.calculix.run import printed_forces, program, solve
from finger3d.fem.laws import MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.solids.hyperelastic import Hyperelastic
from finger3d.fem.solids.material import Isotropic
from tests.given_meshes import refused

MATERIAL = Isotropic(3.0, 0.4)
SHEAR, BULK = 3.0 / 2.8, 3.0 / 0.6
STRETCHES = np.array([1.3, 0.9, 1.0 / (1.3 * 0.9)])  # isochoric


def constants(cards: tuple[str, ...]) -> list[float]:
    return [float(number) for line in cards[1:] for number in line.split(",")]


def test_linear_elasticity() -> None:
    assert law_cards(MATERIAL, None) == ("*ELASTIC", "3, 0.4")
    assert "nu = 0.5" in refused(lambda: law_cards(Isotropic(1.0, 0.5), None))


LAWS = {
    "NEO HOOKE": NeoHooke(1.0),
    "MOONEY-RIVLIN": MooneyRivlin(1.0, 0.3),
    "YEOH": Yeoh(1.0, 0.2, 0.1),
    "OGDEN, N=1": Ogden(1.0, ((1.0, 3.0),)),
    "OGDEN, N=2": Ogden(1.0, ((0.7, 2.0), (0.3, -3.0))),
    "OGDEN, N=3": Ogden(1.0, ((0.5, 2.0), (0.3, -3.0), (0.2, 4.0))),
}


@pytest.mark.parametrize("name", LAWS)
def test_energies_of_the_manual_are_those_of_the_laws(name: str) -> None:
    """CalculiX CrunchiX user's manual 2.20, *HYPERELASTIC."""
    law, j = LAWS[name], 1.2
    cards = law_cards(MATERIAL, law)
    assert cards[0] == f"*HYPERELASTIC, {name}"
    c = constants(cards)
    i1, i2 = (STRETCHES**2).sum(), (STRETCHES**-2.0).sum()
    match re.split(r"[ ,-]", name)[0]:
        case "NEO":
            energy, d = c[0] * (i1 - 3.0), c[1:]
        case "MOONEY":
            energy, d = c[0] * (i1 - 3.0) + c[1] * (i2 - 3.0), c[2:]
        case "YEOH":
            energy, d = sum(c[k] * (i1 - 3.0) ** (k + 1) for k in range(3)), c[3:]
            assert len(d) == 3
        case _:
            n = len(law.terms)
            pairs = zip(c[0 : 2 * n : 2], c[1 : 2 * n : 2], strict=True)
            energy, d = sum(2.0 * mu / a**2 * ((STRETCHES**a).sum() - 3.0) for mu, a in pairs), c[2 * n :]
            assert len(d) == n
    wanted = float(law.with_shear(SHEAR).energy(np.diag(STRETCHES)[None])[0])
    assert energy == pytest.approx(wanted, rel=1e-9)
    volumetric = sum((j - 1.0) ** (2 * k) / each for k, each in enumerate(d, 1))
    assert volumetric == pytest.approx(0.5 * BULK * (j - 1.0) ** 2, rel=1e-9)


@pytest.mark.skipif(program() is None, reason="ccx, CalculiX's solver, is not installed")
@pytest.mark.parametrize("name", LAWS)
def test_calculix_finds_the_stress_of_the_law(name: str, tmp_path: Path) -> None:
    """A cube whose corners are all prescribed: the forces of a face are the nominal stress on it."""
    law, f = LAWS[name], np.array([[1.25, 0.1, 0.0], [0.0, 0.9, 0.05], [0.0, 0.0, 0.92]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    moved = corners @ (f - np.eye(3)).T
    deck = [
        *("*NODE", *(f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(corners, 1))),
        *("*ELEMENT, TYPE=C3D8, ELSET=CUBE", "1, 1, 2, 3, 4, 5, 6, 7, 8", f"*NSET, NSET={OBJECT}", "2, 3, 6, 7"),
        *("*MATERIAL, NAME=GEL", *law_cards(MATERIAL, law), "*SOLID SECTION, ELSET=CUBE, MATERIAL=GEL"),
        *("*STEP, NLGEOM", "*STATIC", "0.1, 1.0", "*BOUNDARY"),
        *(f"{n}, {axis}, {axis}, {u:.14g}" for n, row in enumerate(moved, 1) for axis, u in enumerate(row, 1)),
        *(f"*NODE PRINT, NSET={OBJECT}, TOTALS=ONLY", "RF", "*END STEP", ""),
    ]
    path = tmp_path / "cube.inp"
    path.write_text("\n".join(deck), encoding="ascii")
    solve(path, 60.0)
    material = Hyperelastic(law.with_shear(SHEAR), BULK, mixed=False)
    nominal = material.stress(f[None], None)[0, :, 0]
    assert np.abs(printed_forces(path.with_suffix(".dat"))[1][-1] - nominal).max() < 1e-6 * BULK


def test_too_many_terms_are_refused() -> None:
    law = Ogden(1.0, ((0.25, 2.0), (0.25, 3.0), (0.25, 4.0), (0.25, -2.0)))
    line = refused(lambda: law_cards(MATERIAL, law))
    assert "effects.large_deformation.terms" in line
    assert re.search(r"\b3 terms\b.* 4$", line)
