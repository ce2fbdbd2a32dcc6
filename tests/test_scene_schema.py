"""The JSON schema takes every scene that is shipped, and refuses what the tables refuse."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from finger3d.scene.schema import schema

SCENE = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "press": {"depth_mm": 0.5},
}
LEGS = {"leg": [{"depth_mm": 0.5}, {"force_N": 2.0, "slide_x_mm": 1.0}, {"depth_mm": 0.0}]}


@pytest.fixture(scope="module")
def valid() -> Callable[[dict[str, Any]], bool]:
    from jsonschema import Draft202012Validator

    Draft202012Validator.check_schema(schema())
    return Draft202012Validator(schema()).is_valid


def test_every_shipped_scene_and_the_template_are_valid(valid: Callable[[dict[str, Any]], bool], root: Path) -> None:
    scenes = [path.read_text(encoding="utf-8") for path in root.glob("geometries/*.toml")]
    scenes.append(resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8"))
    assert len(scenes) > 5
    assert all(valid(tomllib.loads(text)) for text in scenes)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"finger": {"geometry": "thumb.STEP"}},
        {"finger": {"geometry": "thumb.msh"}},
        {"material": {"shore_A": 20.0}},
        {"object": {"tilt_deg": 3.0}},
        {"object": {"shape": "sphere", "radius_mm": 4}},
        {"press": {"force_N": 3.0, "steps": "auto"}},
        {"press": LEGS},
        {"parts": {"skin": {"rigid": True}}},
        {"effects": {"viscosity": {"prony": [[0.3, 0.5]]}, "large_deformation": {}}},
        {"effects": {"viscosity": False, "large_deformation": True}},
    ],
)
def test_what_a_scene_takes_is_valid(valid: Callable[[dict[str, Any]], bool], change: dict[str, Any]) -> None:
    assert valid(SCENE | change)


@pytest.mark.parametrize(
    "change",
    [
        {"fingr": {}},
        {"finger": {"geometry": "half_cylinder", "radius_mm": 5.0}},  # no width
        {"finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0, "height_mm": 3.0}},
        {"finger": {"geometry": "thumb.obj"}},
        {"material": {"E_MPa": 1.0, "nu": 0.6}},
        {"material": {"E_MPa": 1.0}},
        {"material": {"E_MPa": 1.0, "nu": 0.49, "shore_A": 20.0}},
        {"object": {"shape": "plane", "radius_mm": 4.0}},
        {"object": {"shape": "sphere"}},
        {"press": {"depth_mm": 0.5, "force_N": 3.0}},
        {"press": {"steps": 5}},
        {"press": LEGS | {"depth_mm": 0.5}},
        {"effects": {"warmth": {}}},
        {"effects": {"large_deformation": 1}},
        {"effects": {"viscosity": {"prony": [[0.3, 0.5, 0.1]]}}},
        {"gauge": [{"name": "a", "x_mm": 1.0}]},
    ],
)
def test_what_a_scene_refuses_is_not_valid(valid: Callable[[dict[str, Any]], bool], change: dict[str, Any]) -> None:
    assert not valid(SCENE | change)


def test_every_key_has_its_meaning() -> None:
    def keys(node: Any) -> list[dict[str, Any]]:
        inner = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
        own = list(node["properties"].values()) if isinstance(node, dict) and "properties" in node else []
        return own + [key for child in inner for key in keys(child)]

    leaves = [key for key in keys(schema()) if "properties" not in key and "oneOf" not in key and "const" not in key]
    leaves = [key for key in leaves if "items" not in key and "additionalProperties" not in key]
    assert len(leaves) > 100
    assert not [key for key in leaves if not key.get("description")]
