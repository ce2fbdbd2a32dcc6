"""Tables of parts in a scene."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.material import RIGID_RATIO, Isotropic
from finger3d.scene.parts import check_parts, parts_of
from finger3d.scene.scene import parse
from finger3d.scene.tables import SceneTable

SCENE: dict[str, Any] = {
    "finger": {"geometry": "block", "half_length_mm": 5.0, "height_mm": 4.0, "width_mm": 3.0},
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "press": {"depth_mm": 0.2},
}


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
