"""Section of a page with the scene of the result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from finger3d.report.build import Code, Part, Table

_TABLES = ("finger", "material", "object", "friction", "press", "grip", "contact", "model", "mesh")


def how_modelled(summary: Mapping[str, object], folder: Path) -> list[Part]:
    """Return the scene as a table, with the active effects, and the text of scene.toml.

    Parameters
    ----------
    summary : JSON object with the key ``scene``
    folder : results folder
    """
    scene = _mapping(summary["scene"])
    rows = [(name, _settings(scene[name])) for name in _TABLES if scene.get(name)]
    rows += _modulus("", scene.get("material"))
    for label, settings in _mapping(scene.get("parts")).items():
        rows += [(f"part {label}", _settings(settings)), *_modulus(f" of {label}", settings)]
    gauges = scene.get("gauge")
    for gauge in map(_mapping, gauges if isinstance(gauges, list | tuple) else ()):
        rows.append((f"gauge {gauge['name']}", _settings({k: v for k, v in gauge.items() if k != "name"})))
    named = _mapping(scene.get("effects")).items()
    effects = {name: settings for name, settings in named if isinstance(settings, Mapping)}
    rows += [(f"effect {name}", _settings(settings) or "on") for name, settings in effects.items()]
    parts: list[Part] = [Table(("", "settings, with defaults"), rows)]
    if not effects:
        parts.append(
            "No effect beyond the baseline: small strain, linear elasticity, a rigid object, Coulomb friction."
        )
    file = folder / "scene.toml"
    if file.exists():
        parts.append(Code(file.read_text(encoding="utf-8"), "scene.toml"))
    return parts


def _modulus(of: str, table: object) -> list[tuple[str, str]]:
    """Return the row of a Young's modulus that follows from a hardness or a silicone, with its spread and origin."""
    E, spread, origin = (_mapping(table).get(key) for key in ("E_MPa", "E_spread", "E_origin"))
    if not (isinstance(E, float) and isinstance(spread, float) and origin):
        return []
    return [(f"Young's modulus{of}", f"{E:.3g} MPa \u00b1 {100.0 * spread:.0f} %: {origin}")]


def _mapping(value: object) -> Mapping[str, object]:
    """Return a JSON object, empty if it is missing."""
    return value if isinstance(value, Mapping) else {}


def _settings(settings: object) -> str:
    """Return a table of a scene in one line."""
    if not isinstance(settings, Mapping):
        return str(settings)
    # the spread and the origin of a modulus have a row of their own
    told = {k: v for k, v in settings.items() if v is not None and k not in ("E_spread", "E_origin")}
    return ", ".join(f"{k} = {_value(v)}" for k, v in told.items())


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return f"({_settings(value)})"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)
