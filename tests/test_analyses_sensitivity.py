"""Free keys, and what a change of every key does."""

from __future__ import annotations

import math
from typing import Any

import pytest

import finger3d
from finger3d.analyses.free_keys import FreeKey, check_distinct, scene_with
from finger3d.errors import Finger3dError
from tests.sensor_cases import SCENE, scene


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


def test_a_key_is_free_once() -> None:
    check_distinct(["a", "b"])
    with pytest.raises(Finger3dError, match="--free b: "):
        check_distinct(["a", "b", "b"])


SECTION = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0},
    "friction": {"mu": 0.4},
}
NUMBERS = ["normal_force_N", "friction_sum_N", "gauge_g36"]


def differences(given: Any, key: str, value: float, change: float, *overrides: str) -> dict[str, tuple[float, float]]:
    """Changes of numbers in presses of their own, as a key falls and as it grows."""

    def at(x: float) -> dict[str, float]:
        last = finger3d.press(given, error=False, overrides=[f"{key}={x!r}", *overrides]).last
        forces = {"normal_force_N": last.normal_force_N, "friction_sum_N": last.friction_sum_N}
        return forces | {f"gauge_{name}": strain for name, strain in last.gauges.items()}

    own, less, more = at(value), at(value - change), at(value + change)
    return {number: (less[number] - x, more[number] - x) for number, x in own.items()}


@pytest.mark.parametrize(
    "effects",
    [
        pytest.param({}, id="small strain"),
        pytest.param({"large_deformation": {}}, marks=pytest.mark.slow, id="large deformation"),
    ],
)
def test_effects_are_differences_of_presses(effects: dict[str, Any]) -> None:
    given = scene(**SECTION | {"effects": {"auto": False, **effects}, "press": {"depth_mm": 4.0, "steps": 4}})
    found = finger3d.sensitivity(given, NUMBERS)
    # a scene of another depth has another mesh, so that the depth is not among these
    for key in ("friction.mu", "gauge.g36.angle_deg", "material.E_MPa", "material.nu"):
        wanted = differences(given, key.replace("g36", "0"), found.keys[key], found.changes[key])
        for number in NUMBERS:
            effect, size = found.effects[number][key], abs(found.numbers[number])
            expected = pytest.approx(wanted[number], rel=1e-4, abs=1e-7 * size)
            assert (effect.falling, effect.growing) == expected, (key, number)


@pytest.mark.slow
def test_errors_hold_on_a_finer_mesh() -> None:
    given = scene(**SECTION | {"effects": {"auto": False}})
    found = finger3d.sensitivity(given, NUMBERS)
    finer = finger3d.sensitivity(given, NUMBERS, overrides=["mesh.size_mm=0.75", "mesh.base_size_mm=2.5"])
    within = [
        abs(one - true) <= 2.0 * error + 1e-9 * abs(found.numbers[number])
        for number in NUMBERS
        for key, effect in found.effects[number].items()
        for one, error, true in (
            (effect.falling, effect.falling_error, finer.effects[number][key].falling),
            (effect.growing, effect.growing_error, finer.effects[number][key].growing),
        )
    ]
    assert sum(within) >= 0.9 * len(within)  # as error bars


def test_a_tolerance_of_the_user_takes_the_place_of_the_default() -> None:
    given = scene(**SECTION)
    found = finger3d.sensitivity(given, NUMBERS, tolerances={"friction.mu": 0.05, "gauge.g36.x_mm": 1.0})
    assert (found.changes["friction.mu"], found.changes["gauge.g36.x_mm"]) == (0.05, 1.0)
    assert (found.changes["press.depth_mm"], found.changes["finger.radius_mm"]) == (0.1, 1.0)
    with pytest.raises(Finger3dError, match="the scene has no such number"):
        finger3d.sensitivity(given, NUMBERS, tolerances={"friction.nu": 0.05})


def test_a_key_that_breaks_the_symmetry_has_effects_that_mirror_each_other() -> None:
    given, number = scene(**SECTION | {"effects": {"auto": False}}), "tangential_force_x_N"
    found = finger3d.sensitivity(given, [number, *NUMBERS], tolerances={"object.tilt_deg": 0.5})
    force, sideways = (found.effects[name]["object.tilt_deg"] for name in ("normal_force_N", number))
    assert force.falling == pytest.approx(force.growing, rel=0.02)
    assert sideways.falling == pytest.approx(-sideways.growing, rel=0.02)
    tilted = finger3d.press(given, error=False, overrides=["object.tilt_deg=0.5"]).last
    assert sideways.growing == pytest.approx(tilted.tangential_force_x_N, rel=0.05)  # on another mesh


def test_moduli_times_and_durations_of_a_viscous_press_have_effects() -> None:
    slow = {
        "effects": {"auto": False, "viscosity": {"prony": [[0.3, 0.5]]}},
        "press": {"depth_mm": 4.0, "steps": 3, "duration_s": 1.0},
    }
    given = scene(**SECTION | slow)
    found = finger3d.sensitivity(given, ["normal_force_N"])
    for key in ("effects.viscosity.prony.0.0", "effects.viscosity.prony.0.1", "press.duration_s"):
        wanted = differences(given, key, found.keys[key], found.changes[key])["normal_force_N"]
        effect = found.effects["normal_force_N"][key]
        assert (effect.falling, effect.growing) == pytest.approx(wanted, rel=1e-6)


def test_a_silicone_has_the_effects_of_its_modulus() -> None:
    named = scene(**SECTION | {"material": {"silicone": "Dragon Skin 20"}})
    found = finger3d.sensitivity(named, ["normal_force_N"])
    force, modulus = found.numbers["normal_force_N"], found.keys["material.E_MPa"]
    effect = found.effects["normal_force_N"]["material.E_MPa"]
    assert found.changes["material.E_MPa"] == pytest.approx(0.05 * modulus)
    assert (effect.falling, effect.growing) == pytest.approx((-0.05 * force, 0.05 * force))
    assert effect.value(found.changes["material.E_MPa"]) == pytest.approx(force / modulus)


def test_at_the_bound_of_a_key_there_is_one_effect() -> None:
    found = finger3d.sensitivity(scene(**SECTION | {"material": {"E_MPa": 1.0, "nu": 0.5}}), ["normal_force_N"])
    effect = found.effects["normal_force_N"]["material.nu"]
    assert effect.falling < 0.0
    assert math.isnan(effect.growing)
    assert "0.503" in found.failures["material.nu"]
    assert effect.value(0.003) == pytest.approx(-effect.falling / 0.003)
