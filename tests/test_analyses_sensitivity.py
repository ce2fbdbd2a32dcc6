"""The analysis of sensitivities: its files, its Python form, bounds of keys, and bad input in one line."""

from __future__ import annotations

import pytest

import finger3d
from finger3d.errors import Finger3dError
from tests.sensor_cases import scene

SECTION = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0},
    "friction": {"mu": 0.4},
}

HELD = {"depth_mm": 4.0, "steps": 1, "duration_s": 1.0}
HOLD = {
    "press": {"leg": [HELD, HELD]},
    "friction": {"mu": 0.2},
    "mesh": {"size_mm": 6.0, "base_size_mm": 15.0},
    "effects": {"viscosity": {"prony": [[0.3, 0.5]]}},
}
"""A viscous finger that is held at the end, as points that slipped rest at their friction limit."""


@pytest.mark.slow
def test_derivatives_of_scene_keys_are_those_of_presses() -> None:
    given = scene(**SECTION)
    slopes = finger3d.sensitivity(given, ["gauge_g36"]).derivatives["gauge_g36"]
    for key, step in (("friction.mu", 1e-5), ("press.depth_mm", 1e-5), ("gauge.g36.angle_deg", 1e-4)):
        value = finger3d.sensitivity(given, ["gauge_g36"]).keys[key]
        name = key.replace("g36", "0")
        ends = [
            finger3d.press(given, error=False, overrides=[f"{name}={value + h!r}"]).last.gauges["g36"]
            for h in (-step, step)
        ]
        assert slopes[key] == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-5)


def test_moduli_times_and_durations_of_a_viscous_press_have_derivatives() -> None:
    slow = {
        "effects": {"viscosity": {"prony": [[0.3, 0.5]]}},
        "press": {"depth_mm": 4.0, "steps": 3, "duration_s": 1.0},
    }
    given = scene(**SECTION | slow)
    found = finger3d.sensitivity(given, ["normal_force_N"])
    for key in ("effects.viscosity.prony.0.0", "effects.viscosity.prony.0.1", "press.duration_s"):
        ends = [
            finger3d.press(given, error=False, overrides=[f"{key}={found.keys[key] + h!r}"]).last.normal_force_N
            for h in (-1e-5, 1e-5)
        ]
        assert found.derivatives["normal_force_N"][key] == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-5)


def test_a_silicone_has_the_derivatives_of_its_modulus() -> None:
    named = scene(**SECTION | {"material": {"silicone": "Dragon Skin 20"}})
    found = finger3d.sensitivity(named, ["normal_force_N"])
    modulus = {key: found.keys[f"material.{key}"] for key in ("E_MPa", "nu")}
    given = finger3d.sensitivity(scene(**SECTION | {"material": modulus}), ["normal_force_N"])
    assert found.derivatives == given.derivatives
    assert finger3d.press(named, error=False).derivatives("normal_force_N") == found.derivatives["normal_force_N"]


def test_at_a_kink_both_derivatives_are_told() -> None:
    given = scene(**SECTION | HOLD)
    found = finger3d.sensitivity(given, ["gauge_g36"])
    key = "press.leg.1.depth_mm"
    growing, falling = found.derivatives["gauge_g36"], found.falling["gauge_g36"]
    assert abs(growing[key] - falling[key]) > 1e-3 * abs(growing[key])
    assert "material.nu" not in falling
    row = next(row for row in found.rows() if row["key"] == key)
    assert (row["derivative"], row["derivative_falling"]) == (growing[key], falling[key])
    assert finger3d.press(given).derivatives("gauge_g36", falling=True) == {**growing, **falling}


def test_at_the_bound_of_a_key_the_derivative_is_one_sided() -> None:
    found = finger3d.sensitivity(scene(**SECTION | {"material": {"E_MPa": 1.0, "nu": 0.5}}), ["normal_force_N"])
    near = finger3d.sensitivity(scene(**SECTION | {"material": {"E_MPa": 1.0, "nu": 0.4999}}), ["normal_force_N"])
    one, other = (f.derivatives["normal_force_N"]["material.nu"] for f in (found, near))
    assert one == pytest.approx(other, rel=0.05)


def test_a_result_tells_its_derivatives() -> None:
    given = scene(**SECTION)
    result = finger3d.press(given)
    assert result.derivatives("gauge_g36") == finger3d.sensitivity(given, ["gauge_g36"]).derivatives["gauge_g36"]
    with pytest.raises(Finger3dError, match="must be one of"):
        result.derivatives("gauge_g3")
