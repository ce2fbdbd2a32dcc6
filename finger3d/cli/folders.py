"""Checks of the folder that a command writes into."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from finger3d.errors import Finger3dError


def check_writable(out: Path, scene: Path) -> None:
    """Raise Finger3dError if the output folder cannot be written, or holds the scene file itself."""
    from finger3d.io import holds  # loads NumPy, which --help can do without

    if holds(out, ["scene.toml"], scene):
        raise Finger3dError(f"--out {out}: holds {scene.name}, which the results would overwrite; name another folder")
    check_folder(out)


def check_folder(out: Path) -> None:
    """Raise Finger3dError if a folder cannot be written, or cannot be created where it does not exist."""
    try:
        # a link that leads nowhere, or in a circle, is there without existing
        there = next(p for p in (out, *out.parents, Path()) if os.path.lexists(p))
        if not there.exists():
            raise Finger3dError(f"--out {out}: {there} is a link that leads nowhere; name another folder")
        if there == out and not out.is_dir():
            raise Finger3dError(f"--out {out}: is a file; name a folder")
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise Finger3dError(f"--out {out}: cannot be written: {error.strerror}") from None
