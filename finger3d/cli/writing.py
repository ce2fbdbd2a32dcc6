"""Commands that help to write: ``new`` a scene, ``schema`` for editors, ``completion`` for shells."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Literal

from finger3d import _extras
from finger3d.cli.common import app, print_json
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


@app.command
def completion(shell: Literal["bash", "zsh", "fish"], /) -> None:
    """Print a script with which a shell completes commands and options.

    For bash, add the line of the example to ~/.bashrc. For zsh, write the output to a file _finger3d in a folder of
    $fpath; for fish, to ~/.config/fish/completions/finger3d.fish.

    Example: source <(finger3d completion bash)

    Parameters
    ----------
    shell
        Shell for which the script is written.
    """
    print(app.generate_completion(shell=shell), end="")


@app.command
def schema() -> None:
    """Print the JSON schema of a scene, by which editors complete and check keys.

    Write it to a file, and name that file in the first line of a scene: ``#:schema ./scene.schema.json``. Editors with
    Taplo (Even Better TOML in VS Code) read that line.

    Example: finger3d schema > scene.schema.json
    """
    from finger3d.scene.schema import schema as of_a_scene

    print_json(of_a_scene())
