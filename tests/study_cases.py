"""Studies that pass, fail and are interrupted."""

from __future__ import annotations

from pathlib import Path

GOOD = '''"""Is one and a half what it was?

Source: none.
"""
from validation._rows import Result, Row

from ._shared import VALUE

def run(quick):
    rows = (Row("value | mm", "a page", 1.5, VALUE + (0.001 if quick else 0.0), 0.01, "so", "sensitivity"),)
    return Result(rows, {"x": [1, 2], "y": [0.1, 1 / 3]}, lambda figure: figure.subplots().plot([1, 2]))
'''
BAD = '''"""Does it fail?"""
from validation._rows import Result, Row

def run(quick):
    return Result((Row("bound", "a page", 1e-8, 2e-8, 0.0, "so", measure="at most"),))
'''
STOPS = '''"""Is it interrupted?"""

def run(quick):
    raise KeyboardInterrupt
'''


def write_studies(home: Path) -> Path:
    """Write a study that passes and one that fails into a new folder, and return it."""
    home.mkdir()
    for name, text in {"good": GOOD, "bad": BAD, "_shared": "VALUE = 1.5\n"}.items():
        (home / f"{name}.py").write_text(text)
    return home
