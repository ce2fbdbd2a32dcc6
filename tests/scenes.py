"""Scene files that several tests press, in small strain unless a test adds large deformation."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

from finger3d.cli import main

FIG9 = """
effects.auto = false
[finger]
geometry = "clipped_cylinder"
radius_mm = 100.0
half_length_mm = 50.0
edge_height_mm = 36.6
width_mm = 20.0
"""
"""The finger of the paper's Fig. 9; a scene adds everything else."""

HALF_CYLINDER = """
title = "half cylinder"
effects.auto = false
[finger]
geometry = "half_cylinder"
radius_mm = 5.0
width_mm = 2.0
[material]
E_MPa = 1.0
nu = 0.3
[friction]
mu = 0.25
[press]
depth_mm = 0.5
steps = 4
[model]
domain = "plane-stress"
[mesh]
size_mm = 0.3
base_size_mm = 1.0
[[gauge]]
name = "g"
x_mm = 1.0
y_mm = 4.0
angle_deg = 30.0
"""
"""A half cylinder of radius 5 mm on a plane, in 2D, with a gauge inside."""
BLOCK = """
effects.auto = false
[finger]
geometry = "block"
half_length_mm = 10.0
height_mm = 8.0
width_mm = 6.0
[material]
E_MPa = 1.0
nu = 0.3
[press]
depth_mm = 0.5
steps = 2
[model]
domain = "plane-strain"
[mesh]
size_mm = 1.0
base_size_mm = 4.0
[[gauge]]
name = "g"
x_mm = 4.0
y_mm = 6.0
"""
SWEPT_FINGER = (
    """
title = "coarse finger"
"""
    + FIG9
    + """
[material]
E_MPa = 1.0
nu = 0.49
[friction]
mu = 0.25
[press]
depth_mm = 10.0
steps = 4
[mesh]
size_mm = 5.0
base_size_mm = 12.0
mesher = "swept"
[[gauge]]
name = "g36"
x_mm = 36.0
y_mm = 38.0
angle_deg = 30.0
"""
)


def changed(text: str, **values: object) -> str:
    """A scene's text with other values of keys that stand in it once, by the names of the keys."""
    lines = text.splitlines()
    for key, value in values.items():
        (at,) = (i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
        lines[at] = f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}"
    return "\n".join(lines) + "\n"


def solid(text: str, size_mm: float) -> str:
    """The scene in 3D, on a swept mesh."""
    return changed(text, domain="solid", size_mm=size_mm).replace("[mesh]\n", '[mesh]\nmesher = "swept"\n')


SECTION = changed(HALF_CYLINDER, title="a <script>alert(1)</script> & ü", name="<g>", angle_deg=0.0)
"""The half cylinder with a title and a name that hold markup."""

SOLID = solid(SECTION, 0.5)


def pressed(folder: Path, text: str, *arguments: str) -> Path:
    """Press a scene by the command line, and return the folder of the results."""
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    assert main(["press", str(folder / "scene.toml"), "--out", str(folder / "out"), "--no-error", *arguments]) == 0
    return folder / "out"


def words(page: Path) -> str:
    """What a reader reads: the page without scripts, styles, pictures and tags."""
    text = re.sub(r"<(script|style)\b.*?</\1>", " ", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", text)).split())


def written(folder: Path, text: str, name: str = "scene.toml") -> Path:
    """Write a scene file, and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
