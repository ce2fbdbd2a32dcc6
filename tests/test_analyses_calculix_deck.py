"""CalculiX: the text of a deck, cards of the laws with the same energies, and runs, without CalculiX by a stand-in."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.analyses.calculix.deck import (
    OBJECT,
    Contact,
    Deck,
    DeckStep,
    ObjectElements,
    facet_lines,
    law_cards,
)
from finger3d.errors import MissingError
from finger3d.fem.laws import MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import FACETS, quadratic
from finger3d.fem.solids.hyperelastic import Hyperelastic
from tests.given_meshes import cube, refused
from validation._ccx import printed_forces, program, solve

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


PLATE = ObjectElements(
    np.array([[x, y, z] for y in (4.0, 5.0) for z, x in ((-9, -9), (9, -9), (9, 9), (-9, 9))]),
    "C3D8",
    np.arange(8)[None],
)
LINEAR = ("*ELASTIC", "1, 0.3")


def deck(**options: object) -> Deck:
    """A cube under a plate."""
    steps = (DeckStep(np.array([0.0, -1.0, 0.0]), 4), DeckStep(np.tile([0.5, -1.0, 0.0], (8, 1)), 1))
    made = Deck(quadratic(cube()), (LINEAR,), PLATE, steps, Contact(200.0, 80.0, 0.25), remarks=("a cube",))
    return replace(made, **options)  # type: ignore[arg-type]


def block(lines: list[str], card: str) -> list[str]:
    """The lines after a card, up to the next one."""
    first = lines.index(card) + 1
    return lines[first : next(i for i in range(first, len(lines)) if lines[i].startswith("*"))]


def test_a_deck_holds_the_mesh_the_object_and_the_path() -> None:
    made = deck()
    mesh, lines = made.mesh, made.text().splitlines()
    assert lines[0] == "** a cube"
    nodes = np.array([line.split(",") for line in block(lines, "*NODE, NSET=NALL")], dtype=float)
    np.testing.assert_allclose(nodes[:, 1:], mesh.points, rtol=1e-11)
    cells = np.array([line.split(",") for line in block(lines, "*ELEMENT, TYPE=C3D10, ELSET=BODY0")], dtype=int)
    np.testing.assert_array_equal(cells[:, 1:] - 1, mesh.cells)
    assert len(block(lines, "*SURFACE, NAME=FINGER, TYPE=ELEMENT")) == len(mesh.facets["contact"])
    held = {int(line.split(",")[0]) - 1 for line in block(lines, "*BOUNDARY")}
    assert held == set(np.unique(mesh.facets["base"]).tolist())
    steps = [i for i, line in enumerate(lines) if line.startswith("*STEP")]
    assert len(steps) == 2
    assert not any("NLGEOM" in lines[i] for i in steps)
    first, second = (block(lines[i:], "*BOUNDARY") for i in steps)
    assert first == ["NOBJECT, 1, 1, 0", "NOBJECT, 2, 2, -1", "NOBJECT, 3, 3, 0"]
    assert len(second) == 8 * 3
    assert second[0] == f"{len(mesh.points) + 1}, 1, 1, 0.5"
    assert block(lines[steps[0] :], "*STATIC") == ["0.25, 1., 1e-5, 0.25"]
    assert block(lines, "*FRICTION") == ["0.25, 80"]


def test_options_change_their_cards() -> None:
    text = deck(finite=True, contact=Contact(200.0, 80.0, 0.0), fields=True).text()
    assert text.count("NLGEOM") == 2
    assert "*FRICTION" not in text
    assert "*EL FILE" in text


def test_every_part_has_its_section() -> None:
    mesh = deck().mesh
    part = np.arange(len(mesh.cells)) % 2
    lines = (
        deck(mesh=replace(mesh, part=part, part_labels=("bone",)), laws=(LINEAR, ("*ELASTIC", "9, 0.2")))
        .text()
        .splitlines()
    )
    assert block(lines, "*MATERIAL, NAME=MATERIAL1") == []
    assert lines[lines.index("*MATERIAL, NAME=MATERIAL1") + 2] == "9, 0.2"
    assert "*SOLID SECTION, ELSET=BODY1, MATERIAL=MATERIAL1" in lines
    numbers = [int(line.split(",")[0]) - 1 for line in block(lines, "*ELEMENT, TYPE=C3D10, ELSET=BODY1")]
    assert numbers == np.flatnonzero(part == 1).tolist()


def test_faces_have_the_numbers_of_calculix() -> None:
    """S1 to S4 of C3D10 are the nodes 1-2-3, 1-4-2, 2-4-3, 3-4-1 (CalculiX user's manual 2.20, sec. 6.2.5)."""
    mesh = cube(1)
    corners = {1: {0, 1, 2}, 2: {0, 3, 1}, 3: {1, 3, 2}, 4: {2, 3, 0}}
    facets = {frozenset(f) for f in mesh.facets["contact"].tolist()}
    found = [line.split(", S") for line in facet_lines(mesh, ("contact", "ends"))]
    assert {frozenset(mesh.cells[int(e) - 1][list(corners[int(k)])].tolist()) for e, k in found} == facets
    assert len(FACETS[3]) == len(corners)


PRINTED = """
 total force (fx,fy,fz) for set NOBJECT and time  0.5000000E+00

        1.000000E-01 -2.500000E+00  3.000000E-12

 total force (fx,fy,fz) for set NOBJECT and time  0.1000000E+01

       -1.250000E-01 -5.000000E+00  0.000000E+00
"""


def test_forces_are_read_with_their_times(tmp_path: Path) -> None:
    (tmp_path / "press.dat").write_text(PRINTED, encoding="ascii")
    times, forces = printed_forces(tmp_path / "press.dat")
    np.testing.assert_array_equal(times, [0.5, 1.0])
    np.testing.assert_allclose(forces, [[0.1, -2.5, 3e-12], [-0.125, -5.0, 0.0]])


def test_a_run_that_does_not_finish_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ccx = tmp_path / "ccx"
    ccx.write_text("#!/bin/sh\necho $1 diverges\n", encoding="ascii")
    ccx.chmod(0o755)
    monkeypatch.setattr(shutil, "which", lambda name: str(ccx))
    with pytest.raises(RuntimeError, match="ccx .* 0: press diverges"):
        solve(tmp_path / "press.inp", 10.0)
    ccx.write_text("#!/bin/sh\necho Job finished\n", encoding="ascii")
    solve(tmp_path / "press.inp", 10.0)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MissingError, match="apt install calculix-ccx"):
        solve(tmp_path / "press.inp", 10.0)
