"""What helps to write: command ``new`` for a scene or its schema, option ``--completion`` for shells."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Literal

from finger3d import _extras
from finger3d.cli.common import app
from finger3d.cli.options import Flag
from finger3d.cli.printing import print_json
from finger3d.errors import Finger3dError

_CORE_MESHER = 'mesher = "swept"         # structured; or "ftetwild", "netgen" (CAD)'


@app.command
def new(file: Path = Path("scene.toml"), /, *, schema: Flag = False) -> None:
    """Write a commented example scene: the finger of Maeno 2004, Fig. 9.

    Editors with Taplo (Even Better TOML in VS Code) complete and check the keys of a scene whose first line names a
    file with the schema: ``#:schema ./scene.schema.json``.

    Example: finger3d new my_scene.toml; finger3d new --schema > scene.schema.json

    Parameters
    ----------
    file
        File to write; an existing file is not overwritten.
    schema
        Print the JSON schema of all scenes instead.
    """
    if schema:
        from finger3d.scene.schema import schema as of_a_scene

        print_json(of_a_scene())
        return
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


@app.command(name="--completion")
def completion(shell: Literal["bash", "zsh", "fish"], /) -> None:
    """Print a script with which a shell completes commands and options.

    For bash, add the line of the example to ~/.bashrc. For zsh, write the output to a file _finger3d in a folder of
    $fpath; for fish, to ~/.config/fish/completions/finger3d.fish.

    Example: source <(finger3d --completion bash)

    Parameters
    ----------
    shell
        Shell for which the script is written.
    """
    print(app.generate_completion(shell=shell), end="")
