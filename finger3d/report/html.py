"""Pieces of a page: the package's own files, and data that a script reads."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any


def asset(name: str) -> str:
    """Text of a file that travels with this package."""
    return resources.files("finger3d.report").joinpath(name).read_text(encoding="utf-8")


def embedded(data: Any) -> str:
    """JSON to stand in a script element: no "<" in it, which could end the element or begin a comment."""
    return json.dumps(data).replace("<", "\\u003c")
