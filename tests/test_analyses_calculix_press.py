"""A scene as a deck: legs, symmetry, materials; effects that CalculiX lacks are refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calculix.press import press_deck
from finger3d.scene import parse
from tests.given_meshes import GMSH, refused

SCENE: dict[str, Any] = {
    "title": "Würfel",
    "finger": {"geometry": "block", "half_length_mm": 10.0, "height_mm": 8.0, "width_mm": 6.0},
    "material": {"E_MPa": 2.0, "nu": 0.4},
    "friction": {"mu": 0.25},
    "press": {"depth_mm": 1.0, "steps": 4},
    "mesh": {"size_mm": 3.0, "base_size_mm": 4.0, "mesher": "swept"},
}


def scene(**tables: Any):
    return parse(SCENE | tables)


def test_the_deck_of_a_symmetric_press_is_a_quarter() -> None:
    made = press_deck(scene().model(), "Würfel")
    assert made.multiple == 4.0
    assert made.deck.axes == ("x", "z")
    assert made.remarks == ()
    assert [step.increments for step in made.deck.steps] == [4]
    np.testing.assert_allclose(made.deck.steps[0].motion, [0.0, -1.0, 0.0], atol=1e-12)
    assert made.deck.contact.penalty == pytest.approx(200.0 * 2.0 / 1.0)
    assert made.deck.object.nodes[:, 1].min() == pytest.approx(8.0)
    text = made.deck.text()
    assert text.isascii()
    assert " 4 times " in text
    assert "2, 0.4" in text


def test_every_leg_is_a_step_and_every_increment_of_one_that_turns() -> None:
    legs = [
        {"depth_mm": 1.0, "steps": 4},
        {"depth_mm": 1.0, "slide_x_mm": 0.5, "steps": 3},
        {"depth_mm": 1.0, "slide_x_mm": 0.5, "turn_y_deg": 5.0, "steps": 2},
        {"depth_mm": 0.5, "slide_x_mm": 0.5, "turn_y_deg": 5.0},
    ]
    made = press_deck(scene(press={"leg": legs}).model())
    assert [step.increments for step in made.deck.steps] == [4, 3, 1, 1, 10]
    assert [step.motion.ndim for step in made.deck.steps] == [1, 1, 2, 2, 2]
    np.testing.assert_allclose(made.deck.steps[1].motion, [0.5, -1.0, 0.0], atol=1e-12)
    assert made.multiple == 1.0
    (remark,) = made.remarks
    assert remark.startswith('steps = "auto": 10 increments ')


def test_a_section_has_its_thickness() -> None:
    strain, stress = (press_deck(scene(model={"domain": f"plane-{kind}"}).model()) for kind in ("strain", "stress"))
    assert (strain.multiple, strain.deck.thickness_mm) == (2.0, 6.0)
    # a thin slice of a section in plane stress
    assert stress.deck.thickness_mm < 0.01
    assert stress.multiple * stress.deck.thickness_mm == pytest.approx(2.0 * 6.0)
    assert "CPS6" in stress.deck.text()
    assert "CPE6" in strain.deck.text()


def test_parts_of_a_given_mesh_have_their_materials() -> None:
    file = {"geometry": str(GMSH / "binary.msh")}
    given = parse(
        {k: v for k, v in SCENE.items() if k != "mesh"}
        | {"finger": file, "parts": {"core": {"E_MPa": 50.0, "nu": 0.3}}}
    )
    made = press_deck(given.model())
    assert made.deck.laws == (("*ELASTIC", "2, 0.4"), ("*ELASTIC", "50, 0.3"))
    assert made.deck.text().count("*SOLID SECTION, ELSET=BODY") == 2


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        (
            {"effects": {"viscosity": {"prony": [[0.3, 0.5]]}}, "press": {"depth_mm": 1.0, "duration_s": 1.0}},
            "[effects.viscosity]",
        ),
        ({"effects": {"kinetic_friction": {"ratio": 0.7}}}, "[effects.kinetic_friction]"),
        ({"effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4}}}, "[effects.elastic_object]"),
        (
            {
                "effects": {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0}},
                "gauge": [{"name": "g", "x_mm": 0.0, "y_mm": 4.0, "length_mm": 2.0}],
            },
            "[effects.embedded_gauge]",
        ),
        ({"press": {"force_N": 2.0}}, "force_N: "),
        ({"material": {"E_MPa": 1.0, "nu": 0.5}}, " nu = 0.5"),
        ({"model": {"domain": "plane-stress"}, "effects": {"large_deformation": {}}}, "[effects.large_deformation]"),
    ],
)  # fmt: skip
def test_what_calculix_lacks_is_refused_by_name(tables: dict[str, Any], told: str) -> None:
    line = refused(lambda: press_deck(scene(**tables).model()))
    assert line.startswith("--solver calculix: ")
    assert told in line


def test_nearly_incompressible_materials_are_told() -> None:
    made = press_deck(scene(material={"E_MPa": 1.0, "nu": 0.49}).model())
    (remark,) = made.remarks
    assert remark.startswith("nu ")
    assert "C3D10" in remark
