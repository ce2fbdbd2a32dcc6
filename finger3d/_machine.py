"""Versions of the packages, cores and memory of this machine, and child processes that end with their parent."""

from __future__ import annotations

import ctypes
import hashlib
import math
import os
import platform
import signal
import sys
from functools import cache
from importlib import metadata
from pathlib import Path

_PR_SET_PDEATHSIG = 1  # linux/prctl.h
_BUFFERS_BYTES = 2 * 2**26  # measured: NumPy's and SciPy's OpenBLAS map 32 MB each
_UNROLLED = 64  # rows above which a product takes a buffer

PACKAGES = (
    "finger3d",
    "numpy",
    "scipy",
    "pypardiso",
    "mkl",
    "casadi",
    "build123d",
    "cadquery-ocp-novtk",
    "pytetwild",
    "netgen-mesher",
    "meshio",
    "trimesh",
    "manifold3d",
    "pyvista",
    "vtk",
    "matplotlib",
    "pydantic",
)
"""Names on PyPI of finger3d and of every package that shapes numbers or pictures."""

_PICTURES = ("pyvista", "vtk", "matplotlib")
"""Those among them that shape no number."""


def versions() -> dict[str, str]:
    """Return the installed version of each package by name, and that of Python; absent packages are left out."""
    return dict(_installed())


def made_with() -> dict[str, str]:
    """Return what shapes numbers besides a scene: versions of packages, and the source of finger3d and its designs."""
    shaping = {name: version for name, version in _installed().items() if name not in _PICTURES}
    return {**shaping, "the source of finger3d and its designs": source_hash()}


@cache
def source_hash(folder: str = "") -> str:
    """Return 16 hex digits of the SHA-256 of the source of finger3d, or of a folder in it, and of all designs."""
    package = Path(__file__).resolve().parent
    files = [*(package / folder).rglob("*.py"), *package.rglob("*.toml"), *package.parent.glob("geometries/*.py")]
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


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
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory_bytes() -> tuple[int, int] | None:
    """Return total and available memory in bytes, or None if the system does not report them."""
    try:
        page = os.sysconf("SC_PAGE_SIZE")
        return page * os.sysconf("SC_PHYS_PAGES"), page * os.sysconf("SC_AVPHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def peak_memory_MB() -> float:
    """Return the largest memory that this process has held; NaN where the system does not report it, as on Windows."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows
        return math.nan
    unit = 1 if sys.platform == "darwin" else 1024  # bytes on macOS, KiB elsewhere
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit) / 2**20


_LIBRARIES_BYTES, _THREAD_BYTES = 300 * 2**20, 82 * 2**20
"""Address space that the imported libraries and a small solution take, measured, and that each thread takes besides."""


def address_limit() -> int | None:
    """Return the limit of the address space of a process (``ulimit -v``) in bytes, or None without one.

    Where such a limit is reached OpenBLAS, in the wheels of NumPy and SciPy, repeats an allocation that fails without
    end, even while it is imported.
    """
    try:
        import resource
    except ModuleNotFoundError:  # Windows
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def enough_address_space() -> bool:
    """Return whether the limit of the address space, if there is one, leaves room for the libraries."""
    limit = address_limit()
    given = next((n for n in map(os.environ.get, ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")) if n), "")
    threads = int(given) if given.isdecimal() else cores()
    return limit is None or limit > _LIBRARIES_BYTES + threads * _THREAD_BYTES


def reserve_for_linear_algebra() -> None:
    """Let OpenBLAS allocate its buffers now, if the address space is limited: later there may be no room for them.

    Raises
    ------
    MemoryError
        If there is no room for them now.
    """
    if address_limit() is None:
        return
    import numpy as np
    from scipy.linalg import lu_factor

    np.empty(_BUFFERS_BYTES, dtype=np.uint8)  # raises MemoryError, which OpenBLAS does not
    lu_factor(np.eye(2))
    np.eye(_UNROLLED) @ np.eye(_UNROLLED)


def child_environment() -> dict[str, str]:
    """Return the environment of this process, changed so that a child imports this same package."""
    here = str(Path(__file__).resolve().parent.parent)
    path = os.pathsep.join(p for p in (here, os.environ.get("PYTHONPATH")) if p)
    return {**os.environ, "PYTHONPATH": path}


def end_with(parent: int) -> None:
    """Let the kernel kill this process when its parent ends for whatever reason; Linux only.

    A thread could not watch the parent: meshing holds Python's global interpreter lock.

    Parameters
    ----------
    parent : process id of the parent
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent ended before the call
            os._exit(1)
