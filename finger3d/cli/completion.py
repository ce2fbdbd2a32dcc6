"""Command ``completion``: a completion script for the shell."""

from __future__ import annotations

from typing import Literal

from finger3d.cli.common import app


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
