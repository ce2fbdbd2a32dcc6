"""Which effects a scene calls for: against presses with each, what is refused, and what a press tells."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import finger3d
from finger3d.accuracy.changes import changing_numbers
from finger3d.analyses.free_keys import judge, settled
from finger3d.errors import Finger3dError
from finger3d.progress import QUIET
from finger3d.scene import Scene, parse
from tests.models import ended
from tests.scenes import HALF_CYLINDER, changed
from tests.sensor_cases import scene

MESH = {"size_mm": 1.5, "base_size_mm": 6.0}


def needs(depth: float = 10.0, **effects: Any) -> Scene:
    legs = {"depth_mm": depth, "duration_s": 1.0}
    found: Scene = scene(press=legs, mesh=MESH, friction={"mu": 0.4}, effects={"auto": True, **effects})
    return found


def test_a_deep_press_calls_for_large_deformation_and_a_shallow_one_does_not() -> None:
    deep, shallow = judge(needs(), QUIET), judge(parse({**needs(0.1).given, "friction": {"mu": 0.0}}), QUIET)
    assert deep.used == ("large_deformation",)
    assert shallow.used == ()
    assert abs(shallow.judged["large_deformation"].change) < 0.02
    assert set(shallow.changes({"normal_force_N": 1.0})) == {"large_deformation"}
    assert shallow.unjudged["viscosity"] == "no Prony series"


@pytest.mark.parametrize(
    ("name", "much", "little"),
    [
        ("viscosity", {"prony": [[0.5, 0.3]]}, {"prony": [[0.001, 0.3]]}),
        ("elastic_object", {"E_MPa": 2.0, "nu": 0.4}, {"E_MPa": 5e5, "nu": 0.4}),
    ],
)
def test_an_effect_is_used_if_its_data_make_it_matter(name: str, much: Any, little: Any) -> None:
    assert name in judge(needs(0.5, **{name: much}), QUIET).used
    without = judge(needs(0.5, **{name: little}), QUIET)
    assert name not in without.used
    assert abs(without.judged[name].change) < 0.02


def test_few_increments_make_no_difference_of_their_own() -> None:
    """With two coefficients increments are as they are; without, the path under a plane is exact."""
    found = judge(needs(0.3, kinetic_friction={"ratio": 0.999}, viscosity={"prony": [[0.001, 0.3]]}), QUIET)
    for name in ("kinetic_friction", "viscosity"):
        assert name not in found.used
        assert abs(found.judged[name].change) < 0.01  # both change the limit of friction or the force by 0.1 %


GAUGES = {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0}
LONG = [{"name": "long", "x_mm": 30.0, "y_mm": 38.0, "angle_deg": 10.0, "length_mm": 4.0}]


def test_an_effect_is_judged_beside_all_others() -> None:
    """By static friction alone most points stick unless the deformation is large; by kinetic friction few stick at all.

    The truth is pressed on the scene's own mesh.
    """
    shallow = {
        "material": {"E_MPa": 1.0, "nu": 0.392}, "object": {"shape": "cylinder", "radius_mm": 74.0},
        "friction": {"mu": 0.058}, "press": {"depth_mm": 0.48, "steps": 4},
        "mesh": {"size_mm": 0.75, "base_size_mm": 8.0}, "gauge": [],
    }  # fmt: skip
    beside = scene(**shallow, effects={"auto": True, "kinetic_friction": {"ratio": 0.63}})
    assert judge(beside, QUIET).used == ("kinetic_friction",)
    assert judge(scene(**shallow, effects={"auto": True}), QUIET).used == ("large_deformation",)
    large, small = (
        changing_numbers(*ended(beside.with_effects(names).model()))["friction_sum_N"]
        for names in (("large_deformation", "kinetic_friction"), ("kinetic_friction",))
    )
    assert large == pytest.approx(small, rel=0.02)


@pytest.mark.slow
def test_effects_are_judged_beside_stiff_gauges() -> None:
    """The free strain of such gauges is no number of a press without them."""
    effects = {"auto": True, "embedded_gauge": GAUGES, "kinetic_friction": {"ratio": 0.9}}
    given = {**needs().given, "gauge": LONG, "effects": effects}
    found = judge(parse(given), QUIET)
    assert {"embedded_gauge", "kinetic_friction"} <= set(found.judged)
    assert not any(name.endswith("_free") for one in found.judged.values() for name in one.estimate.changes)


def test_a_cheap_press_is_judged_on_its_own_mesh() -> None:
    """On twice the edges kinetic friction changes three times as much, which made it seem to matter."""
    light = scene(
        material={"E_MPa": 1.0, "nu": 0.4}, object={"shape": "sphere", "radius_mm": 25.7}, friction={"mu": 0.3},
        press={"depth_mm": 1.06, "steps": 4}, mesh={"size_mm": 0.75, "base_size_mm": 8.0}, gauge=[],
        effects={"auto": True, "kinetic_friction": {"ratio": 0.72}},
    )  # fmt: skip
    found = judge(light, QUIET).judged["kinetic_friction"]
    assert not found.used
    with_kinetic, without = (
        changing_numbers(*ended(with_ratio(light, ratio).model()))["friction_sum_N"] for ratio in (0.72, 1.0 - 1e-9)
    )
    change = found.estimate.changes["friction_sum_N"]
    assert change.low <= with_kinetic - without <= change.high


def with_ratio(given: Scene, ratio: float) -> Scene:
    effects = {"large_deformation": {}, "kinetic_friction": {"ratio": ratio}}
    return parse({**given.given, "effects": effects})


def test_effects_are_judged_in_small_strain_where_large_deformation_costs_too_much() -> None:
    """No longer edges resolve this ball, and at large deformation its own press costs more than a judgement may."""
    solid = scene(
        model={"domain": "solid"}, object={"shape": "sphere", "radius_mm": 157.3}, friction={"mu": 0.66},
        press={"leg": [{"depth_mm": 0.287, "steps": 4}, {"depth_mm": 0.287, "slide_x_mm": 0.1, "steps": 2}]},
        mesh={"size_mm": 5.0, "base_size_mm": 15.0, "mesher": "swept"},
        gauge=[{"name": "b", "x_mm": 0.0, "y_mm": 30.0, "angle_deg": 0.0, "length_mm": 5.0}],
        effects={"auto": True, "kinetic_friction": {"ratio": 0.51}, "embedded_gauge": GAUGES},
    )  # fmt: skip
    judged = judge(solid, QUIET).judged
    assert (judged["kinetic_friction"].used, judged["kinetic_friction"].why) == (False, "changes no number")
    assert judged["large_deformation"].why.startswith("principal strains reach")


def test_what_is_left_out_is_told_and_holds(tmp_path: Path) -> None:
    """The truth is the same press at large deformation."""
    given = changed(
        HALF_CYLINDER.replace("effects.auto = false", "effects.auto = true\neffects.auto_tolerance = 0.9"),
        depth_mm=0.05,
        size_mm=0.15,
    )
    path = tmp_path / "scene.toml"
    path.write_text(given, encoding="utf-8")
    result = finger3d.press(path, tmp_path / "out", figures=True)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["effects"] == []
    judged = summary["effects_auto"]["judged"]["large_deformation"]
    assert not judged["used"]
    assert "changes" in judged["why"]
    assert "auto = false" in (tmp_path / "out" / "scene.toml").read_text(encoding="utf-8")
    error = result.model_error["large_deformation"]["normal_force_N"]
    large = finger3d.press(path, overrides=["effects={large_deformation={}}"], error=False)
    true = large.last.normal_force_N - result.last.normal_force_N
    assert error["low"] <= true <= error["high"]
    assert "Effects" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_large_deformation_is_judged_unless_the_scene_says_otherwise() -> None:
    given = {key: table for key, table in needs().given.items() if key != "effects"}
    for effects, asked in (
        (None, ("large_deformation",)),
        ({"kinetic_friction": {"ratio": 0.7}}, ("large_deformation",)),
        ({"large_deformation": {}}, ()),
        ({"auto": True, "kinetic_friction": {"ratio": 0.7}}, ("kinetic_friction", "large_deformation")),
        ({"auto": False, "kinetic_friction": {"ratio": 0.7}}, ()),
    ):
        assert parse(given if effects is None else {**given, "effects": effects}).open_effects == asked
    shallow, need = settled(parse({**given, "press": {"depth_mm": 0.05}}))
    assert (tuple(shallow.effects), shallow.open_effects) == ((), ())
    assert need is not None
    again, none = settled(shallow)
    assert (again, none) == (shallow, None)


def test_analyses_take_the_effects_that_their_scene_calls_for(tmp_path: Path) -> None:
    """The sweep has one model in all rows: that of its deepest press."""
    given = {key: table for key, table in needs().given.items() if key != "effects"}
    deep = {**given, "press": {"depth_mm": 10.0, "steps": 2}}
    found = finger3d.sweep(deep, {"press.depth_mm": [0.5, 10.0]}, tmp_path / "sweep")
    large = finger3d.press(deep, overrides=["effects={large_deformation={}}", "press.depth_mm=0.5"], error=False)
    # in small strain it is 0.15 of mu times the normal force more; the meshes of sweep and press differ
    assert found.columns["friction_sum_N"][0] == pytest.approx(large.last.friction_sum_N, rel=0.05)
    assert finger3d.plan(deep).dofs > 0


@pytest.mark.parametrize(
    ("effects", "why"),
    [
        ({"auto": True, "auto_tolerance": 1.5}, "auto_tolerance = 1.5"),
        ({"auto": "yes"}, "effects.auto = "),
        ({"auto": False, "auto_tolerance": 0.1}, "nothing is judged with effects.auto = false"),
        ({"auto": True, "viscosity": {}}, "prony"),
        ({"auto": True, "magic": {}}, "magic"),
    ],
)
def test_mistakes_are_refused_in_one_line(effects: Any, why: str) -> None:
    with pytest.raises(Finger3dError, match=why):
        parse({**scene().given, "effects": effects})
