"""The text of a deck: nodes, elements, sections of parts, surfaces, supports and steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d.analyses.calculix.deck import Contact, Deck, DeckStep, ObjectElements, facet_lines
from finger3d.fem.mesh.simplex import FACETS, quadratic
from tests.given_meshes import cube

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
