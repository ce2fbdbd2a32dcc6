"""Command ``new``: a commented example scene."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from finger3d import _extras
from finger3d.cli.common import app
from finger3d.errors import Finger3dError

_CORE_MESHER = 'mesher = "swept"         # structured; or "ftetwild", "netgen" (CAD)'


@app.command
def new(file: Path = Path("scene.toml"), /) -> None:
    """Write a commented example scene: the finger of Maeno 2004, Fig. 9.

    Example: finger3d new my_scene.toml

    Parameters
    ----------
    file
        File to write; an existing file is not overwritten.
    """
    text = resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8")
    if not _extras.available("pytetwild"):  # the core meshes extruded designs, as this one is
        text = text.replace('mesher = "ftetwild"      # or "netgen" (CAD), "swept" (structured)', _CORE_MESHER)
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text.replace("scene.toml", str(file)))
    except FileExistsError:
        raise Finger3dError(f"{file}: there already; give another name") from None
    except OSError as error:
        raise Finger3dError(f"{file}: cannot be written: {error.strerror}") from None
    print(f"{file} written; next: finger3d press {file} --out out")
