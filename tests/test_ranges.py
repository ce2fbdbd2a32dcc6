"""Ranges of a scene's keys: every number has one, and within it results scale exactly."""

from __future__ import annotations

import math
import typing
from typing import Any

import annotated_types as at
import numpy as np
import pytest

from finger3d._ranges import Modulus, at_least, at_most
from finger3d.cli import main
from finger3d.effects import effect_names, effect_type
from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.objects import OBJECTS
from finger3d.scene import parse
from finger3d.scene.tables import (
    FrictionTable,
    GaugeTable,
    LegTable,
    MaterialTable,
    MeshTable,
    PressTable,
    TomlTable,
    table_of,
)

OF_DESIGNS = [table_of(design) for design in designs().values()]
OF_EFFECTS = [table_of(effect_type(name)) for name in effect_names()]
TABLES: list[type[TomlTable]] = [
    *OF_DESIGNS, *OF_EFFECTS, *map(table_of, OBJECTS.values()),
    FrictionTable, GaugeTable, LegTable, MaterialTable, MeshTable, PressTable,
]  # fmt: skip


def numbers(hint: Any) -> list[tuple[bool, bool]]:
    """Whether every number in a type has a lower and an upper bound."""
    if typing.get_origin(hint) is typing.Annotated:
        kind, *bounds = typing.get_args(hint)
        if kind in (float, int):
            return [tuple(any(isinstance(b, kinds) for b in bounds) for kinds in ((at.Ge, at.Gt), (at.Le, at.Lt)))]
        return numbers(kind)
    if hint in (float, int):
        return [(False, False)]
    return [found for part in typing.get_args(hint) for found in numbers(part)]


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.__name__)
def test_every_number_has_a_range(table: type[TomlTable]) -> None:
    for name, hint in typing.get_type_hints(table, include_extras=True).items():
        if name != "model_config":
            assert all(low and high for low, high in numbers(hint)), name


SCENE: dict[str, Any] = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "friction": {"mu": 0.3},
    "press": {"leg": ({"depth_mm": 1.0, "steps": 2, "duration_s": 1.0}, {"depth_mm": 1.0, "slide_x_mm": 0.1, "steps": 1,
                                                                         "duration_s": 1.0})},
    "mesh": {"size_mm": 1.0, "base_size_mm": 2.0, "mesher": "swept"},
    "gauge": ({"name": "g", "x_mm": 1.0, "y_mm": 3.0, "length_mm": 1.0},),
}  # fmt: skip


def scaled(E: float, domain: str, effect: str | None) -> tuple[Any, Any]:
    """Forces over E and gauge strains of a press with all moduli multiplied by E."""
    settings: dict[str, Any] = {
        "viscosity": {"prony": ((0.3, 0.5),), "bulk": False},
        "elastic_object": {"E_MPa": 2.0 * E, "nu": 0.5},
        "embedded_gauge": {"E_MPa": 2.0 * E, "thickness_mm": 0.02, "width_mm": 2.0},
        "large_deformation": {},
    }
    on = {} if effect is None else {"effects": {effect: settings[effect]}}
    tree = {**SCENE, **on, "material": {"E_MPa": E, "nu": 0.49}, "model": {"domain": domain}}
    frames = list(march(build(parse(tree).model())))
    assert all(frame.outcome.ok for frame in frames)
    return np.stack([f.state.force for f in frames]) / E, np.array([f.gauges["g"] for f in frames])


@pytest.mark.parametrize(
    ("domain", "effect"),
    [
        ("plane-strain", None), ("plane-strain", "viscosity"), ("plane-strain", "elastic_object"),
        ("plane-strain", "embedded_gauge"), ("plane-strain", "large_deformation"), ("solid", None),
    ],
)  # fmt: skip
def test_forces_are_proportional_to_the_modulus_from_end_to_end(domain: str, effect: str | None) -> None:
    # powers of four, of which square roots too are exact, so that the same digits are computed at every modulus: any
    # difference is an absolute tolerance; the moduli of effects are twice that of the finger
    _, low, high = typing.get_args(Modulus)
    force, strain = scaled(1.0, domain, effect)
    assert np.abs(force).max() > 0.0
    for E in (4.0 ** math.ceil(math.log(low.ge, 4)), 4.0 ** math.floor(math.log(0.5 * high.le, 4))):
        found = scaled(E, domain, effect)
        assert (found[0] == force).all()
        assert (found[1] == strain).all()


@pytest.mark.parametrize(
    "override",
    [
        "material.E_MPa=1e200", "material.E_MPa=5e-324", "material.E_MPa=1e-160", "material.E_MPa=1e154",
        "finger.radius_mm=1e300", "press.duration_s=1e300", "press.slide_x_mm=1e300", "press.slide_x_mm=600.0",
        "effects.viscosity={prony=[[1e308, 1.0]]}", "mesh.size_mm=1e-300", "friction.mu=1e308",
        "press.steps=100000000", "object.radius_mm=1e300", "object.x_mm=1e300", "press.depth_mm=1e-300",
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["press", "plan"])
def test_an_absurd_number_is_refused_in_one_line(override, command, tmp_path, capsys) -> None:
    path = tmp_path / "scene.toml"
    tree = {**SCENE, "press": {"depth_mm": 1.0}, "object": {"shape": "sphere", "radius_mm": 20.0},
            "model": {"domain": "plane-strain"}}  # fmt: skip
    from finger3d.scene.tree import written

    path.write_text(written(tree), encoding="utf-8")
    out = ["--out", str(tmp_path / "out")] if command == "press" else []
    assert main([command, str(path), "--set", override, *out]) == 2
    out_text, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert override.split("=")[0].split(".")[-1] in err
    assert out_text == ""


@pytest.mark.parametrize("value", [49.99745962, 43.29267, 1 / 3, 1e-7 / 3, 123456.78, 2.0, 99999.96])
def test_a_bound_holds_as_it_is_printed(value: float) -> None:
    # six digits: the printed bound is within 1e-5 of the exact one, on its inner side
    assert value * (1 - 1e-5) <= float(at_most(value)) <= value
    assert value <= float(at_least(value)) <= value * (1 + 1e-5)
    assert float(at_most(-value)) <= -value <= float(at_least(-value))


def test_a_size_as_large_as_the_refusal_allows_is_taken() -> None:
    finger = {"geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
              "width_mm": 80.0}  # fmt: skip
    tree = {**SCENE, "finger": finger, "gauge": (), "model": {"domain": "plane-strain"}}
    with pytest.raises(Finger3dError) as refused:
        parse({**tree, "mesh": {"size_mm": 60.0, "mesher": "swept"}})
    told = float(str(refused.value).split("at most ")[1].split(",")[0])
    assert parse({**tree, "mesh": {"size_mm": told, "mesher": "swept"}}).mesh.size_mm == told
