"""Versions and machine: what a reader of a result, or of a bug report, has to know."""

from __future__ import annotations

import os
import platform
from functools import cache
from importlib import metadata

PACKAGES = (
    "finger3d",
    "numpy",
    "scipy",
    "pypardiso",
    "mkl",
    "build123d",
    "cadquery-ocp-novtk",
    "pytetwild",
    "trimesh",
    "pyvista",
    "vtk",
    "matplotlib",
    "plotly",
    "pydantic",
)
"""finger3d and every package that shapes numbers or pictures, by its name on PyPI."""


def versions() -> dict[str, str]:
    """Return name -> installed version, without importing any of them; a package that is absent is left out."""
    return dict(_installed())


@cache
def _installed() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory_bytes() -> tuple[int, int] | None:
    """Return total and available memory, or None where the system does not tell."""
    try:
        page = os.sysconf("SC_PAGE_SIZE")
        return page * os.sysconf("SC_PHYS_PAGES"), page * os.sysconf("SC_AVPHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None
