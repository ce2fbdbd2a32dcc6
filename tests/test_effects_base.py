"""Slots of the model that effects fill."""

from __future__ import annotations

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.base import fill, warn
from finger3d.errors import Finger3dError
from tests.models import block


def test_a_slot_is_filled_once_and_both_effects_are_named_otherwise() -> None:
    model = fill(block(), "friction", Coulomb(0.7), "wet")
    assert model.friction == Coulomb(0.7)
    assert dict(model.filled) == {"friction": "wet"}
    with pytest.raises(Finger3dError, match="wet and dry "):
        fill(model, "friction", Coulomb(0.1), "dry")
    assert fill(model, "held_ends", True, "dry").filled == (("friction", "wet"), ("held_ends", "dry"))


def test_a_warning_is_kept_once() -> None:
    assert warn(warn(warn(block(), "b"), "a"), "b").warnings == ("a", "b")
