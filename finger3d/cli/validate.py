"""Command ``validate``, which has left the package."""

from __future__ import annotations

from finger3d.cli.common import app
from finger3d.errors import Finger3dError


@app.command(show=False)
def validate(*arguments: str) -> None:
    """Say where the studies are."""
    raise Finger3dError("validate: the studies run from a checkout: python -m validation [STUDY ...] [--quick]")
