"""Materials of parts and legs of a press follow from the tables of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic
from finger3d.materials.elastic import elastic_constants
from finger3d.materials.modulus import SPREAD_A, modulus_of_shore_A
from finger3d.mechanics.model import Leg
from finger3d.scene import load, parse
from finger3d.scene.derived import check_parts, largest_spread, moduli, parts_of, spreads
from finger3d.scene.tables import SceneTable
from tests.designs import GOOD
from tests.scene_tables import SMALL

SCENE: dict[str, Any] = {
    "finger": {"geometry": "block", "half_length_mm": 5.0, "height_mm": 4.0, "width_mm": 3.0},
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "press": {"depth_mm": 0.2},
}
FINGERTIP = SCENE | {"finger": {"geometry": "fingertip", **GOOD["fingertip"]}}


class Layered:
    """A design with two labelled solids, as far as the tables of parts look at it."""

    name: ClassVar[str] = "layered"
    part_labels: ClassVar[tuple[str, ...]] = ("skin", "core")


def tables(**parts: dict[str, object]) -> SceneTable:
    return SceneTable.model_validate(SCENE | {"parts": parts})


def test_a_part_has_its_own_material_and_a_rigid_one_is_far_stiffer_than_all_others() -> None:
    found = dict(parts_of(tables(skin={"E_MPa": 4.0, "nu": 0.3}, core={"rigid": True})))
    assert found["skin"] == Isotropic(4.0, 0.3)
    assert found["core"].isotropic("a test").E_MPa == RIGID_RATIO * 4.0


@pytest.mark.parametrize(
    ("parts", "begins", "names"),
    [
        ({"skni": {"rigid": True}}, "parts.skni: ", ["skin", "core"]),
        ({"skin": {"E_MPa": 1.0}}, "parts.skin.nu ", ["E_MPa", "rigid"]),
        ({"skin": {}}, "parts.skin.E_MPa ", ["nu", "rigid"]),
        ({"core": {"rigid": True, "nu": 0.3}}, "parts.core.nu = 0.3: ", ["rigid"]),
        ({"core": {"rigid": True, "shore_A": 30.0}}, "parts.core.shore_A = 30.0: ", ["rigid"]),
        ({"skin": {"E_MPa": 1.0, "shore_A": 30.0}}, "parts.skin.shore_A = 30.0: ", ["E_MPa", "rigid"]),
        ({"skin": {"silicone": "Dragon Skim 20"}}, "parts.skin.silicone = ", ["Dragon Skin 20"]),
    ],
)
def test_mistakes_are_named_by_key(parts: dict[str, Any], begins: str, names: list[str]) -> None:
    (line,) = check_parts(tables(**parts), Layered())  # type: ignore[arg-type]
    assert line.startswith(begins)
    assert all(name in line for name in names)


def test_a_part_of_a_finger_of_one_solid_is_refused() -> None:
    with pytest.raises(Finger3dError, match=r"scene: parts\.skin"):
        parse(SCENE | {"parts": {"skin": {"rigid": True}}})


@pytest.mark.parametrize(("key", "value"), [("nu", 0.6), ("E_MPa", -1.0), ("rigid", 1), ("density", 1.0)])
def test_values_out_of_range_are_refused_by_key(key: str, value: object) -> None:
    with pytest.raises(Finger3dError, match=rf"parts\.skin\.{key} = "):
        parse(SCENE | {"parts": {"skin": {key: value}}})


def test_a_part_is_of_a_silicone_or_of_a_hardness() -> None:
    both = tables(skin={"silicone": "ecoflex 00-30"}, core={"shore_A": 60.0, "nu": 0.4})
    found = dict(parts_of(both))
    assert found["skin"] == Isotropic(elastic_constants({"silicone": "Ecoflex 00-30"}).E_MPa, 0.49)
    assert found["core"] == Isotropic(modulus_of_shore_A(60.0), 0.4)
    assert largest_spread(both) == 0.6
    skin = elastic_constants({"silicone": "Ecoflex 00-30"}).spread
    assert spreads(both) == {"skin": skin, "core": SPREAD_A}
    assert largest_spread(tables(core={"rigid": True})) is None
    assert spreads(tables(core={"rigid": True})) == {}
    words = moduli(tables(skin={"silicone": "ecoflex 00-30"}, core={"rigid": True}))
    assert words["modulus"] == "1 MPa, given"
    assert "Ecoflex 00-30" in words["modulus of skin"]
    assert words["modulus of core"] == "rigid"


def test_the_modulus_of_a_part_is_told_and_its_scene_loads_as_the_same(tmp_path: Path) -> None:
    parts = {"skin": {"silicone": "ecoflex 0030"}, "core": {"rigid": True}}
    scene = parse(FINGERTIP | {"parts": parts})
    told = scene.as_dict()["parts"]
    assert told["skin"]["silicone"] == "Ecoflex 00-30"
    assert told["skin"]["E_MPa"] == scene.model().parts[0][1].isotropic("a test").E_MPa
    assert "E_MPa" not in told["core"]
    path = tmp_path / "scene.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    assert load(path) == scene
    replaced = load(path, ["parts.skin.E_MPa=0.2"]).as_dict()["parts"]["skin"]
    assert replaced == {"E_MPa": 0.2, "nu": 0.49, "rigid": False}


def test_legs_press_slide_and_release() -> None:
    legs = [{"depth_mm": 10.0}, {"depth_mm": 10.0, "slide_x_mm": 2.0, "steps": "auto"}, {"depth_mm": 0.0, "steps": 5}]
    model = parse({**SMALL, "press": {"leg": legs}}).model()
    assert model.legs == (Leg(10.0, steps="auto"), Leg(10.0, slide_x_mm=2.0, steps="auto"), Leg(0.0, steps=5))
