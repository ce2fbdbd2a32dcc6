"""Which effects a scene calls for: against presses with each, what is refused, and what a press tells."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import finger3d
from finger3d.accuracy.changes import changing_numbers
from finger3d.accuracy.model_error import CoarsePresses, at_large_deformation
from finger3d.analyses.effects_by_need import judge
from finger3d.errors import Finger3dError, UnresolvedError
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
    """With friction even the shallow one does: presses on this mesh and one four times as fine differ by 15 % in it."""
    deep, shallow = judge(needs(), QUIET), judge(parse({**needs(0.1).given, "friction": {"mu": 0.0}}), QUIET)
    friction = judge(needs(0.1), QUIET).judged["large_deformation"]
    assert friction.used
    assert friction.number == "friction_sum_N"
    assert friction.change == pytest.approx(0.15, abs=0.03)
    assert deep.used == ("large_deformation",)
    assert shallow.used == ()
    assert abs(shallow.judged["large_deformation"].change) < 0.02
    assert set(shallow.left_out) == {"large_deformation"}
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


def test_bodies_that_share_what_is_condensed_are_those_condensed_alone() -> None:
    """Without foils the body alone is meshed by half, so that its cells about the gauge differ."""
    soft = {"E_MPa": 2.0, "nu": 0.4}
    effects = {"auto": True, "embedded_gauge": GAUGES, "elastic_object": soft, "kinetic_friction": {"ratio": 0.7}}
    asked = parse({**needs(2.0).given, "gauge": LONG, "effects": effects})
    plain, on = asked.with_effects(()).model(), {name: effect.apply for name, effect in asked.effects.items()}
    shared = CoarsePresses(plain, 2.0)
    shared.numbers(on, False)
    for left_out, error in (("embedded_gauge", 5e-3), ("elastic_object", 1e-9), ("kinetic_friction", 1e-9)):
        some = {name: on[name] for name in on if name != left_out}
        alone = CoarsePresses(plain, 2.0).numbers(some, False)[0]
        assert shared.numbers(some, False)[0] == pytest.approx(alone, rel=error)


def test_presses_at_finite_strain_begin_near_each_other_and_end_where_they_do_alone() -> None:
    """Increments that end at a residual of 1e-4 leave 0.1 % in friction.

    An object of another modulus is not condensed anew: its compliance is inversely proportional to that.
    """
    effects = {"auto": True, "elastic_object": {"E_MPa": 2.0, "nu": 0.4}, "kinetic_friction": {"ratio": 0.7}}
    asked = parse({**needs(2.0).given, "gauge": LONG, "effects": effects})
    plain, on = asked.with_effects(()).model(), {name: effect.apply for name, effect in asked.effects.items()}
    on["large_deformation"] = at_large_deformation
    shared = CoarsePresses(plain, 2.0, 1e-4)
    shared.numbers(on, False)
    stiff = replace(asked.effects["elastic_object"], E_MPa=40.0).apply
    for name, some in (
        ("kinetic_friction", {name: on[name] for name in on if name != "kinetic_friction"}),
        ("elastic_object", {**on, "elastic_object": stiff}),
    ):
        alone = CoarsePresses(plain, 2.0).numbers(some, False)[0]
        beside = {f"other {key}" if key == name else key: effect for key, effect in some.items()}
        assert shared.numbers(beside, False)[0] == pytest.approx(alone, rel=2e-3)


def test_gauges_are_read_alike_with_foils_and_without() -> None:
    """Between points on a coarse mesh: foils without stiffness leave the body as it is, and read what others read."""
    asked = parse({**needs(2.0).given, "gauge": LONG, "effects": {"auto": True, "embedded_gauge": GAUGES}})
    soft = replace(asked.effects["embedded_gauge"], E_MPa=1e-9)
    plain, large = asked.with_effects(()).model(), {"large_deformation": at_large_deformation}
    presses = CoarsePresses(plain, 2.0, 1e-6)
    presses.numbers({**large, "embedded_gauge": asked.effects["embedded_gauge"].apply}, False)
    wanted = CoarsePresses(plain, 2.0).numbers({**large, "embedded_gauge": soft.apply}, False)[0]
    assert presses.numbers(large, False)[0] == pytest.approx(wanted, rel=1e-4)


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


def test_what_is_left_out_is_told_and_holds(tmp_path: Path) -> None:
    """The truth is the same press at large deformation."""
    given = changed(HALF_CYLINDER, depth_mm=0.05, size_mm=0.15) + "\n[effects]\nauto = true\nauto_tolerance = 0.9\n"
    path = tmp_path / "scene.toml"
    path.write_text(given, encoding="utf-8")
    result = finger3d.press(path, tmp_path / "out", figures=True)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["effects"] == []
    judged = summary["effects_auto"]["judged"]["large_deformation"]
    assert not judged["used"]
    assert "changes" in judged["why"]
    assert "auto" not in (tmp_path / "out" / "scene.toml").read_text(encoding="utf-8")
    error = result.model_error["large_deformation"]["normal_force_N"]
    large = finger3d.press(path, overrides=["effects={large_deformation={}}"], error=False)
    true = large.last.normal_force_N - result.last.normal_force_N
    assert error["low"] <= true <= error["high"]
    assert "Effects" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_other_commands_ask_for_the_scene_that_a_press_writes() -> None:
    with pytest.raises(Finger3dError, match="effects.auto = true: a press finds which effects"):
        finger3d.compare(needs(), "unused")
    assert finger3d.plan(needs()).dofs > 0


@pytest.mark.parametrize(
    ("effects", "why"),
    [
        ({"auto": True, "auto_tolerance": 1.5}, "auto_tolerance = 1.5"),
        ({"auto": "yes"}, "effects.auto = "),
        ({"auto_tolerance": 0.1}, "only with effects.auto = true"),
        ({"auto": True, "viscosity": {}}, "prony"),
        ({"auto": True, "magic": {}}, "magic"),
    ],
)
def test_mistakes_are_refused_in_one_line(effects: Any, why: str) -> None:
    with pytest.raises(Finger3dError, match=why):
        parse({**scene().given, "effects": effects})


def test_a_press_too_shallow_for_coarser_meshes_is_judged_on_its_own() -> None:
    """Large deformation does not matter at 0.4 % of the height."""
    text = changed(HALF_CYLINDER, depth_mm=0.02, size_mm=0.3)
    plain = parse(tomllib.loads(text)).model()
    with pytest.raises(UnresolvedError):
        CoarsePresses(plain, 2.0).check({})
    found = judge(parse(tomllib.loads(text) | {"effects": {"auto": True}}), QUIET)
    assert found.used == ()
    assert abs(found.judged["large_deformation"].change) < 0.02
