"""Style sheets and scripts of the pages, and data for the scripts."""

from __future__ import annotations

import json
from importlib import resources


def asset(name: str) -> str:
    """Return the text of a file of this package."""
    return resources.files("finger3d.report").joinpath(name).read_text(encoding="utf-8")


def embedded(data: object) -> str:
    """Return JSON for a script element, with "<" escaped, which could end the element or begin a comment."""
    return json.dumps(data).replace("<", "\\u003c")
