"""Command ``schema``: the JSON schema of a scene."""

from __future__ import annotations

from finger3d.cli.common import app, print_json


@app.command
def schema() -> None:
    """Print the JSON schema of a scene, by which editors complete and check keys.

    Write it to a file, and name that file in the first line of a scene: ``#:schema ./scene.schema.json``. Editors with
    Taplo (Even Better TOML in VS Code) read that line.

    Example: finger3d schema > scene.schema.json
    """
    from finger3d.scene.schema import schema as of_a_scene

    print_json(of_a_scene())
