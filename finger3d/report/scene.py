"""The scene of a result, as a section of its page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from finger3d.report.build import Code, Part, Table

_SETTINGS = ("finger", "material", "object", "friction", "press", "contact", "model", "mesh")


def how_modelled(summary: Mapping[str, Any], folder: Path) -> list[Part]:
    """The scene as a table, the effects that were on, and the file itself."""
    scene = summary["scene"]
    rows = [(name, _told(scene[name])) for name in _SETTINGS if scene.get(name)]
    rows += [(f"gauge {gauge['name']}", _told({k: v for k, v in gauge.items() if k != "name"}))
             for gauge in scene.get("gauge") or ()]  # fmt: skip
    effects = scene.get("effects") or {}
    rows += [(f"effect {name}", _told(settings) or "on") for name, settings in effects.items()]
    parts: list[Part] = [Table(("", "as run, defaults filled in"), rows)]
    if not effects:
        parts.append(
            "No effect beyond the baseline: small strain, linear elasticity, a rigid object, Coulomb friction."
        )
    file = folder / "scene.toml"
    if file.exists():
        parts.append(Code(file.read_text(encoding="utf-8"), "scene.toml, to run it again"))
    return parts


def _told(settings: Any) -> str:
    if not isinstance(settings, Mapping):
        return str(settings)
    return ", ".join(f"{k} = {_value(v)}" for k, v in settings.items() if v is not None)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"({_told(value)})"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)
