"""Physical effects beyond the baseline, one a file; each sets one slot of the model, which no other effect may set."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import replace
from typing import Any, ClassVar, Protocol

from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model

LARGE_DEFORMATION = "large_deformation"
"""The effect that every scene has the data for."""


class Effect(Protocol):
    """Settings of an effect: a frozen dataclass whose fields are the keys of its table.

    Attributes
    ----------
    slot : str
        Field of the model that the effect sets.
    """

    slot: ClassVar[str]

    def apply(self, model: Model) -> Model:
        """Return the model with the effect in its slot.

        Raises
        ------
        Finger3dError
            If the model does not allow the effect.
        """
        ...


def fill(model: Model, slot: str, value: Any, effect: str) -> Model:
    """Return the model with `slot` set by `effect`; an effect that set it before is named in the error."""
    taken = dict(model.filled).get(slot)
    if taken is not None:
        raise Finger3dError(f"effects: {taken} and {effect} both set the {slot}; keep one of them")
    filled = tuple(sorted((*model.filled, (slot, effect))))
    return replace(model, **{slot: value}, filled=filled)


def warn(model: Model, text: str) -> Model:
    """Return the model with one more warning for the summary."""
    return replace(model, warnings=tuple(sorted({*model.warnings, text})))


def effect_names() -> tuple[str, ...]:
    """Return the names of the effects: one file each in finger3d/effects. None is imported."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def effect_type(name: str) -> type[Effect]:
    """Import one effect and return its settings: a frozen dataclass with ``apply(model) -> model``."""
    effect: type[Effect] = importlib.import_module(f"finger3d.effects.{name}").Effect
    return effect
