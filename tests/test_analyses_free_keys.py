"""Free keys of a scene."""

from __future__ import annotations

import pytest

from finger3d.analyses.free_keys import FreeKey, check_distinct, scene_with
from finger3d.errors import Finger3dError
from tests.sensor_cases import SCENE


@pytest.mark.parametrize("text", ["a", "a=", "a=1", "a=2:1", "a=1:1", "a=1:inf", "=1:2", "a=1:2:3"])
def test_bounds_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(Finger3dError, match="KEY=LOW:HIGH"):
        FreeKey.of(text)


def test_a_key_starts_at_the_scenes_value_or_in_the_middle_of_its_bounds() -> None:
    assert FreeKey.of(" material.E_MPa = 0.5:2") == FreeKey("material.E_MPa", 0.5, 2.0)
    assert FreeKey("material.E_MPa", 0.5, 2.0).start(SCENE) == 1.0
    assert FreeKey("material.E_MPa", 2.0, 4.0).start(SCENE) == 3.0
    gauge = FreeKey("gauge.long.x_mm", 0.0, 40.0)
    assert gauge.numbered(SCENE) == "gauge.1.x_mm"
    assert gauge.start(SCENE) == 30.0


def test_a_modulus_starts_at_that_of_the_silicone_and_replaces_it() -> None:
    given = {**SCENE, "material": {"silicone": "Dragon Skin 20"}}
    key = FreeKey("material.E_MPa", 0.1, 2.0)
    assert 0.3 < key.start(given) < 0.6
    scene = scene_with(given, ["material.E_MPa"], [0.7], None)
    assert scene.as_dict()["material"] == {"E_MPa": 0.7, "nu": 0.49}
    assert given["material"] == {"silicone": "Dragon Skin 20"}


def test_a_scene_takes_the_values_and_leaves_the_tables_it_was_given() -> None:
    scene = scene_with(SCENE, ["material.E_MPa", "gauge.1.x_mm"], [0.1 + 0.2, 12.5], None)
    assert scene.tables.material.E_MPa == 0.1 + 0.2
    assert scene.tables.gauge[1].x_mm == 12.5
    assert SCENE["material"]["E_MPa"] == 1.0
    with pytest.raises(Finger3dError, match=r"--free material\.nu.* 0\.5"):
        scene_with(SCENE, ["material.nu"], [0.7], None)


def test_a_key_is_free_once() -> None:
    check_distinct(["a", "b"])
    with pytest.raises(Finger3dError, match="--free b: "):
        check_distinct(["a", "b", "b"])
