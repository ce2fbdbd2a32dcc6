"""What is read from a folder of results: JSON, CSV, the title, the gauges and the error bars of a summary."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

from finger3d._types import Tree, TreeView
from finger3d.errors import Finger3dError
from finger3d.mechanics.gauges import Gauge


def read_json(path: Path) -> Tree:
    """Read a result.

    Raises
    ------
    Finger3dError
        If it is not there, or is no JSON object.
    """
    try:
        found: object = json.loads(path.read_text(encoding="utf-8"))
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


def title_of(scene: TreeView) -> str:
    """The scene's title, or what is pressed onto what."""
    object_ = (scene.get("object") or {}).get("shape", "plane")
    return scene.get("title") or f"{scene['finger']['geometry']} on a {object_}"


def gauges_of(scene: TreeView) -> list[Gauge]:
    """The gauges of a scene as summary.json holds it.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError
        If they are not as a press writes them.
    """

    def number(value: object) -> float:
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(value)
        return float(value)

    return [
        Gauge(
            str(g["name"]), number(g["x_mm"]), number(g["y_mm"]), number(g["z_mm"]),
            math.radians(number(g["angle_deg"])), number(g["length_mm"]),
        )
        for g in scene.get("gauge") or ()
    ]  # fmt: skip
