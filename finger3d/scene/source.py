"""What the functions of the Python interface take for a scene: a file, a dict with the same tables, or a loaded one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from finger3d._types import TreeView
from finger3d.errors import Finger3dError
from finger3d.scene import tree
from finger3d.scene.scene import Scene, parse

Source = Scene | TreeView | str | Path
"""A scene: loaded, as the tables of a scene file, or the path of the file."""


def load(path: str | Path, overrides: Iterable[str] = ()) -> Scene:
    """Read and check a scene file.

    Parameters
    ----------
    path : TOML file
    overrides : texts such as ``friction.mu=0.5``, applied before anything is checked

    Raises
    ------
    Finger3dError
        With one line that names the file, the key, the value and what is allowed.
    """
    return scene_of(Path(path), overrides)


def scene_of(source: Source, overrides: Iterable[str] = ()) -> Scene:
    """Return the scene that an argument stands for, with values of other keys as for ``--set``.

    Raises
    ------
    Finger3dError
        If it has a mistake, or is no scene.
    """
    overrides = list(overrides)
    if isinstance(source, Scene) and not overrides:
        return source
    document, path = tables_of(source)
    changed, keys = tree.overridden(document, overrides)
    return parse(changed, path, keys)


def tables_of(source: Source, overrides: Sequence[str] = ()) -> tuple[TreeView, Path | None]:
    """Return the tables of a scene, with values of other keys as for ``--set``, and the path of its file if it has one.

    Raises
    ------
    Finger3dError
        If the file cannot be read, a key cannot be set, or the argument is no scene.
    """
    if isinstance(source, Scene):
        document, path = source.given, source.path
    elif isinstance(source, Mapping):
        document, path = tree.frozen(source), None
    elif isinstance(source, str | Path):
        path = Path(source)
        document = tree.read(path)
    else:
        raise Finger3dError(
            f"a {type(source).__name__} is no scene: give the path of a scene file, a dict with its tables, or what "
            "finger3d.load returns (a Model is solved by build and march of finger3d.mechanics)"
        )
    return tree.override(document, overrides), path
