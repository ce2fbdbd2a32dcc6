"""Materials of a scene by hardness and by name."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.materials.modulus import modulus_of_shore_A
from finger3d.scene import load, parse
from finger3d.scene.material import modulus_of, replace_modulus
from tests.commands import refused
from tests.scene_tables import SMALL

SILICONE = {**SMALL, "material": {"silicone": "dragon skin20"}}


def told(material) -> str:
    with pytest.raises(Finger3dError) as error:
        parse({**SMALL, "material": material})
    return str(error.value)


def test_a_silicone_is_a_material() -> None:
    scene = parse(SILICONE)
    material, constants = scene.model().material, scene.constants
    assert (material.E_MPa, material.nu) == (constants.E_MPa, 0.49)
    assert 0.3 < constants.E_MPa < 0.6
    assert scene.as_dict()["material"] == {
        "silicone": "Dragon Skin 20",
        "nu": 0.49,
        "E_MPa": constants.E_MPa,
        "E_spread": constants.spread,
        "E_origin": constants.origin,
    }
    assert parse(SMALL).as_dict()["material"] == {"E_MPa": 1.0, "nu": 0.49}


def test_a_hardness_is_a_material_and_forecasts_a_depth() -> None:
    scene = parse({**SMALL, "material": {"shore_A": 20, "nu": 0.45}, "press": {"force_N": 10.0}})
    assert scene.constants.E_MPa == modulus_of_shore_A(20.0)
    assert scene.model().material.nu == 0.45
    soft, hard = (
        parse({**SMALL, "material": {"shore_00": s}, "press": {"force_N": 10.0}}).legs[0].depth_mm for s in (10.0, 50.0)
    )
    assert soft > hard > 0.0


def test_the_scene_as_run_loads_as_the_same(tmp_path) -> None:
    scene = parse(SILICONE)
    path = tmp_path / "scene.toml"
    for text in (scene.to_toml(), scene.to_toml(defaults=False)):
        path.write_text(text, encoding="utf-8")
        again = load(path)
        assert again == scene
        assert again.constants == scene.constants
    assert "E_MPa" not in scene.to_toml()


@pytest.mark.parametrize(
    ("material", "words"),
    [
        ({"nu": 0.49}, ["material.E_MPa is missing", "shore_A, shore_00 or silicone"]),
        ({"E_MPa": 1.0}, ["material.nu is missing", "beside E_MPa"]),
        ({"E_MPa": 1.0, "nu": 0.4, "shore_A": 20.0}, ["material.shore_A = 20.0", "beside E_MPa"]),
        ({"shore_A": 20.0, "silicone": "Dragon Skin 20"}, ["material.silicone", "beside shore_A"]),
        ({"silicone": "Dragn Skin 20"}, ['material.silicone = "Dragn Skin 20"', '"Dragon Skin 20"']),
        ({"silicone": "butter"}, ["Ecoflex 00-10", "Sylgard 184"]),
        ({"silicone": 20}, ["material.silicone = 20", "text"]),
        ({"shore_A": 99.0}, ["material.shore_A = 99.0", "from 5 to 90"]),
        ({"shore_0": 30.0}, ["material.shore_0", '"shore_00"']),
    ],
)
def test_a_mistake_is_told_in_one_line(material, words) -> None:
    line = told(material)
    assert "\n" not in line
    assert all(word in line for word in words), line


def test_a_modulus_from_the_command_line_replaces_the_silicone(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(parse(SILICONE).to_toml(defaults=False), encoding="utf-8")
    stiff = load(path, ["material.E_MPa=2.5"])
    assert stiff.as_dict()["material"] == {"E_MPa": 2.5, "nu": 0.49}
    other = load(path, ["material.silicone=Ecoflex 00-30"])
    assert other.as_dict()["material"]["silicone"] == "Ecoflex 00-30"
    assert load(path, ["material.shore_A=30", "material.nu=0.45"]).as_dict()["material"]["nu"] == 0.45
    path.write_text(parse(SMALL).to_toml(defaults=False), encoding="utf-8")
    assert load(path, ["material.silicone=Ecoflex 00-30"]).constants.origin.startswith("Ecoflex 00-30")


def test_two_moduli_from_the_command_line_are_refused(tmp_path, capsys) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(parse(SILICONE).to_toml(defaults=False), encoding="utf-8")
    line = refused(capsys, "plan", str(path), "--set", "material.E_MPa=1", "--set", "material.shore_A=20")
    assert "beside E_MPa" in line


def test_only_tables_of_materials_are_touched() -> None:
    tree = {
        "material": {"silicone": "Ecoflex 00-30", "nu": 0.4},
        "parts": {"skin": {"shore_A": 20.0}},
        "effects": {"elastic_object": {"E_MPa": 3.0}},
    }
    replace_modulus(tree, ["parts.skin.E_MPa", "effects.elastic_object.E_MPa", "friction.mu"])
    assert tree["material"] == {"silicone": "Ecoflex 00-30", "nu": 0.4}
    assert tree["parts"] == {"skin": {"nu": 0.49}}
    assert tree["effects"] == {"elastic_object": {"E_MPa": 3.0}}


def test_the_modulus_behind_another_key() -> None:
    assert modulus_of(SILICONE, "material.E_MPa") == parse(SILICONE).constants.E_MPa
    assert modulus_of(SILICONE, "material.nu") is None
    assert modulus_of({"material": {"silicone": "butter"}}, "material.E_MPa") is None
    assert modulus_of({}, "material.E_MPa") is None
