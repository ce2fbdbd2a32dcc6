"""Registry of the effects. Reading the names imports none of them."""

from __future__ import annotations

import importlib
import pkgutil

import finger3d.effects
from finger3d.effects.base import Effect


def effect_names() -> tuple[str, ...]:
    """Return the names of the effects: one file each in finger3d/effects, besides base.py."""
    modules = (m.name for m in pkgutil.iter_modules(finger3d.effects.__path__))
    return tuple(sorted(n for n in modules if n != "base" and not n.startswith("_")))


def effect_type(name: str) -> type[Effect]:
    """Import one effect and return its settings: a frozen dataclass with ``apply(model) -> model``."""
    effect: type[Effect] = importlib.import_module(f"finger3d.effects.{name}").Effect
    return effect
