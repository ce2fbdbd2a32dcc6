"""Materials, legs and edge lengths that follow from a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic
from finger3d.materials.modulus import SPREAD_A, elastic_constants, modulus_of_shore_A
from finger3d.scene import load, parse
from finger3d.scene.material import check_parts, largest_spread, moduli, parts_of, spreads
from finger3d.scene.tables import SceneTable
from tests.commands import refused
from tests.designs import GOOD
from tests.scene_tables import FINGER, HEIGHT, SMALL

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
        ({"E_MPa": 1.0, "nu": 0.4, "shore_A": 20.0}, ["material.shore_A = 20.0", "beside E_MPa"]),
        ({"shore_A": 20.0, "silicone": "Dragon Skin 20"}, ["material.silicone", "beside shore_A"]),
        ({"silicone": "Dragn Skin 20"}, ['material.silicone = "Dragn Skin 20"', '"Dragon Skin 20"']),
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
    assert found["core"].E_MPa == RIGID_RATIO * 4.0


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
    assert told["skin"]["E_MPa"] == scene.model().parts[0][1].E_MPa
    assert "E_MPa" not in told["core"]
    path = tmp_path / "scene.toml"
    path.write_text(scene.to_toml(), encoding="utf-8")
    assert load(path) == scene
    replaced = load(path, ["parts.skin.E_MPa=0.2"]).as_dict()["parts"]["skin"]
    assert replaced == {"E_MPa": 0.2, "nu": 0.49, "rigid": False}


@pytest.mark.parametrize(
    ("domain", "mesher", "width", "size", "base"),
    [
        ("solid", "ftetwild", HEIGHT, HEIGHT / 27.5, HEIGHT / 3),
        ("solid", "ftetwild", 20.0, HEIGHT / 27.5, 0.4 * 20.0),  # the largest edges are not long beside the width
        ("solid", "ftetwild", 1.0, 0.5, 0.5),  # a thin finger gets two elements across
        ("solid", "swept", HEIGHT, HEIGHT / 25, HEIGHT / 6.25),  # its rows run through the whole body
        ("plane-strain", "ftetwild", HEIGHT, HEIGHT / 100, HEIGHT / 25),
        ("plane-stress", "ftetwild", HEIGHT, HEIGHT / 100, HEIGHT / 25),
    ],
)
def test_absent_mesh_sizes_are_chosen_from_the_extents(domain, mesher, width, size, base) -> None:
    finger = {**FINGER, "width_mm": width}
    mesh = parse({**SMALL, "finger": finger, "model": {"domain": domain}, "mesh": {"mesher": mesher}}).model().mesh
    assert (mesh.size_mm, mesh.base_size_mm) == pytest.approx((size, base), rel=1e-3)


@pytest.mark.parametrize("given_size", [{"size_mm": 10.0}, {"base_size_mm": 1.0}])
def test_a_chosen_size_never_contradicts_a_given_one(given_size) -> None:
    mesh = parse({**SMALL, "mesh": given_size}).model().mesh
    assert mesh.size_mm <= mesh.base_size_mm
    assert {k: getattr(mesh, k) for k in given_size} == given_size


@pytest.mark.parametrize(
    ("thing", "size"),
    [
        ({"shape": "plane", "tilt_deg": 0.0}, 10.0 / 27.5),
        ({"shape": "sphere", "radius_mm": 8.0}, 2 * 2.78388 / 600**0.5),  # sqrt(d (2 R - d)) each way, 600 points
        ({"shape": "cylinder", "radius_mm": 8.0, "axis": "z"}, (2 * 2.78388 * 4.0 / 600) ** 0.5),
        ({"shape": "cylinder", "radius_mm": 100.0, "axis": "x"}, 4.0 / 12.0),  # as wide as the finger, no end inside
        ({"shape": "wave", "wavelength_mm": 5.0, "amplitude_mm": 0.1}, 4.0 / 12.0),  # finer: more than 600 points
        ({"shape": "sphere", "radius_mm": 0.1}, 0.05 * 10.0 / 27.5),  # the finest
        ({"shape": "sphere", "radius_mm": 0.1, "mesher": "swept"}, 0.2 * 0.4),
    ],
)
def test_default_edges_resolve_the_overlap_of_a_curved_object(thing, size) -> None:
    tables = {
        "finger": {
            "geometry": "block",
            "half_length_mm": 10.0,
            "height_mm": 10.0,
            "width_mm": 20.0 if thing["shape"] in ("sphere", "plane") else 4.0,
        },
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": 0.5},
        "object": {key: value for key, value in thing.items() if key != "mesher"},
        "mesh": {"mesher": thing.get("mesher", "ftetwild")},
    }
    # the overlap is found on a grid of a hundredth of the finger
    assert parse(tables).mesh.size_mm == pytest.approx(size, rel=0.06)


@pytest.mark.parametrize(
    ("depth", "domain", "size"),
    [
        # a plane overlaps a half cylinder of 10 mm over 2 sqrt(d (2 R - d))
        (0.02, "plane-strain", 1.2643 / 20),
        (0.2, "plane-strain", 0.1),
        (0.1, "solid", (2.8213 * 2.0 / 600) ** 0.5),
        (2.0, "solid", 10.0 / 27.5),
    ],
)
def test_default_edges_resolve_the_contact_of_a_round_finger_with_a_plane(depth, domain, size) -> None:
    tables = {
        "finger": {"geometry": "half_cylinder", "radius_mm": 10.0, "width_mm": 2.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": depth},
        "model": {"domain": domain},
    }
    # the overlap is found on a grid of a hundredth of the finger
    assert parse(tables).mesh.size_mm == pytest.approx(size, rel=0.06)


@pytest.mark.parametrize(
    ("height", "radius", "size", "base"),
    [
        # a ball of 6 mm that is 1.6 mm deep overlaps 8.16 mm of the pad, at 1.925 mm 8.8 mm
        (4.0, 6.0, 8.16 / 600**0.5, 0.4 * 4.0),
        (1.5, 6.0, 2.5 * 1.5 / 27.5, 0.6),  # 1/11 and 0.4 of the height at most
        (40.0, 6.0, 8.8 / 600**0.5, 0.4 * 16.0),  # no layer
    ],
)
def test_edges_in_a_layer_follow_the_contact_and_the_thickness(height, radius, size, base) -> None:
    mesh = parse(
        {
            "finger": {"geometry": "block", "half_length_mm": 8.0, "height_mm": height, "width_mm": 16.0},
            "material": {"E_MPa": 0.1, "nu": 0.49},
            "object": {"shape": "sphere", "radius_mm": radius},
            "press": {"depth_mm": min(1.925, 0.4 * height)},
        }
    ).mesh
    # the overlap is found on a grid that is a twentieth of its width
    assert mesh.size_mm == pytest.approx(size, rel=0.09)
    assert mesh.base_size_mm == pytest.approx(base, rel=0.09)
