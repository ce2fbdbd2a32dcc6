"""Tables of a scene, each checked by itself: mistakes are collected under their places."""

from __future__ import annotations

from typing import Any

from finger3d.scene.checked_tables import checked, effects_of, shaped
from finger3d.scene.tables import FrictionTable


def test_mistakes_are_collected_and_none_stops_the_next() -> None:
    mistakes: dict[Any, str] = {}
    assert checked(FrictionTable, {"mu": -1.0}, ("friction",), mistakes) is None
    assert checked(FrictionTable, {"mu": 0.5}, ("friction",), mistakes) == FrictionTable(mu=0.5)
    assert list(mistakes) == [("friction", "mu")]
    assert "friction.mu = -1.0" in mistakes["friction", "mu"]


def test_an_object_without_a_shape_is_a_plane() -> None:
    assert shaped({"tilt_deg": 2.0}) == {"shape": "plane", "tilt_deg": 2.0}
    assert shaped({"shap": "sphere"}) == {"shap": "sphere"}  # misspelt: it is told so


def test_keys_of_the_effects_themselves_are_no_effects() -> None:
    mistakes: dict[Any, str] = {}
    document = {"effects": {"auto": True, "auto_tolerance": 0.1, "kinetic_friction": {"ratio": 0.7}}}
    tables, effects, auto = effects_of(document, mistakes)
    assert not mistakes
    assert set(tables) == set(effects) == {"kinetic_friction"}
    assert auto is not None
    assert (auto.auto, auto.auto_tolerance) == (True, 0.1)
