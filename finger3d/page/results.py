"""What pages of several commands share, and the page of a comparison."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from finger3d.errors import Finger3dError
from finger3d.page.build import Code, Figure, Part, Row, Section, Table, number, write_page

_SETTINGS = ("finger", "material", "object", "friction", "press", "contact", "model", "mesh")
_FORCE = "force_N_per_mm"


def read_json(path: Path) -> dict[str, Any]:
    """Read a result.

    Raises
    ------
    Finger3dError
        If it is not there, or is no JSON object.
    """
    try:
        found: Any = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Finger3dError(f"{path.parent}: holds no {path.name}; give a folder of results") from None
    except (OSError, ValueError, RecursionError) as error:
        raise Finger3dError(f"{path}: cannot be read ({error}); make the results again") from None
    if not isinstance(found, dict):
        raise Finger3dError(f"{path}: holds no JSON object; make the results again")
    return found


def read_rows(path: Path) -> list[dict[str, str]]:
    """Lines of a CSV file by column; none, if it is not there.

    Raises
    ------
    Finger3dError
        If it cannot be read.
    """
    if not path.is_file():
        return []
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise Finger3dError(f"{path}: cannot be read ({error}); make the results again") from None


def title_of(scene: Mapping[str, Any]) -> str:
    """The scene's title, or what is pressed onto what."""
    object_ = (scene.get("object") or {}).get("shape", "plane")
    return scene.get("title") or f"{scene['finger']['geometry']} on a {object_}"


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


def compare_page(folder: str | Path) -> Path:
    """Write report.html of a comparison from what is in its folder.

    Raises
    ------
    Finger3dError
        If there is no compare.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "compare.json")
    own = data["scene"]["finger"].get("width_mm")
    cases = [c for c in data["cases"] if c["numbers"]]
    headline = [
        Row(f"force per width, {c['model']}", c["numbers"][_FORCE], "N/mm", c["errors"].get(_FORCE))
        for c in cases
        if c["width_mm"] == own and c["model"] != "solid, ends held"
    ]
    keys = list(dict.fromkeys(k for c in cases for k in c["numbers"]))
    rows = [
        (c["model"], c["width_mm"], c["size_mm"], *(_with_error(c, k) for k in keys), c["seconds"], c["outcome"])
        for c in data["cases"]
    ]
    head = ("model", "width (mm)", "edges (mm)", *keys, "seconds", "outcome")
    proof = (
        "Each case is a press of its own. It has numbers only if every step of it met Eqs. (1)-(4) of the paper and "
        "friction opposing slip to 1e-8; press the scene for its steps."
    )
    return write_page(
        folder,
        f"{title_of(data['scene'])}: 2D against 3D",
        headline,
        [
            Section("Verdict", list(data["verdict"])),
            Section("Scene", how_modelled(data, folder)),
            Section("Every case", [proof, _BARS, Table(head, rows)]),
        ],
        [Figure("compare.png", "Force against width, tractions along x, and every quantity beside the solid's")],
        command="compare",
        outcome=data["outcome"],
        good=data["outcome"] == "converged",
        versions=data["versions"],
    )


_BARS = (
    "After ±: the error by mesh and increments, estimated as finger3d press does: from a mesh with edges about twice "
    "as long (half as long where none is coarser), and from more increments. Solids and sections of one width share "
    "their edge lengths, so on swept meshes the deviation of their forces is known better than either force. The "
    "verdict calls a deviation told from the limit where it is two bars away."
)


def _with_error(case: Mapping[str, Any], key: str) -> str:
    if key not in case["numbers"] or case["numbers"][key] is None:
        return ""
    return number(case["numbers"][key], case["errors"].get(key))
