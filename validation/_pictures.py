"""Pictures of the scenes in geometries/ and of a mold, for the README and docs/: ``python -m validation._pictures``.

Each is the finger.png of a press, or the mold.png of an export, as these commands write them; figures/NAME.png has the
name of its scene. The names of some pictures may be given, for instance ``python -m validation._pictures gear mold``.
All other files in figures/ are drawn by the studies.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import finger3d
from finger3d.mold.options import MoldOptions

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent / "geometries"
MOLD = "mold"


def names() -> list[str]:
    """Return the names of all pictures: those of the scenes, and the mold."""
    return [*sorted(scene.stem for scene in SCENES.glob("*.toml")), MOLD]


def draw(name: str, folder: Path, overrides: Sequence[str] = ()) -> None:
    """Draw one picture into a folder; `overrides` change keys of its scene."""
    with TemporaryDirectory() as out:
        scene = finger3d.load(SCENES / f"{'fig9' if name == MOLD else name}.toml", overrides)
        if name == MOLD:
            finger3d.export(scene, out, MoldOptions())
        else:
            finger3d.press(scene, out, figures=True, error=False)
        shutil.copyfile(Path(out) / ("mold.png" if name == MOLD else "finger.png"), folder / f"{name}.png")


if __name__ == "__main__":
    for picture in sys.argv[1:] or names():
        draw(picture, HERE / "figures")
        print(picture)
