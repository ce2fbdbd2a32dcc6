"""Command ``plan``: model size, time and memory of a press."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from finger3d.cli.common import app, load
from finger3d.cli.options import Json, Set
from finger3d.cli.printing import print_json, print_rows

if TYPE_CHECKING:
    from finger3d.scene import Scene


@app.command
def plan(scene: Path, /, *, set_: Set = None, json_: Json = False) -> None:
    """Print the active effects, the size of the model, and the estimated time and memory, without solving.

    Example: finger3d plan scene.toml --set mesh.size_mm=1

    Parameters
    ----------
    scene
        The scene file (TOML).
    """
    loaded = load(scene, set_)
    from finger3d.analyses.cost import plan as run

    result = run(loaded)
    if json_:
        print_json(result.summary())
        return
    print_rows("material", result.moduli.items())
    print_rows("effects", effect_rows(loaded))
    print_rows(loaded.title, [(key.replace("_", " "), value) for key, value in result.forecast.items()])
    print("The real time is 0.5 to 2.5 times the forecast, the real memory 0.8 to 1.3 times.")
    for text in result.warnings:
        print(f"warning: {text}")


def effect_rows(scene: Scene) -> list[tuple[str, str]]:
    """Return each known effect and the reason why it is on or off."""
    from finger3d.effects import effect_names

    def why(name: str) -> str:
        if_needed = f"on if it changes a number by more than {100 * scene.tolerance_of_effects:g} % of its scale"
        if name in scene.open_effects and name not in scene.effects:
            return if_needed
        if name not in scene.effects:
            return f"off: the scene has no [effects.{name}]"
        settings = ", ".join(f"{k} = {v}" for k, v in scene.tables.effects[name].items())
        state = if_needed if name in scene.open_effects else "on"
        return f"{state}: [effects.{name}] {settings}"

    return [(name, why(name)) for name in effect_names()]
