"""Threads for small dense systems: one is quicker, and far quicker on a machine that has other work."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

SMALL = 3000
"""Rows of a compliance below which two threads gain little, and lose a factor 10 on a busy machine (at 640 rows)."""


@cache
def _controller(lapack: bool) -> Any:
    if lapack:
        import scipy.linalg.lapack  # noqa: F401  a BLAS of its own: no limit set before it is loaded holds for it
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def one_thread(lapack: bool) -> AbstractContextManager[Any]:
    """Context in which dense algebra runs on one thread, with `lapack` that of SciPy too."""
    return _controller(lapack).limit(limits=1)


def threads_for(unknowns: int, lapack: bool) -> AbstractContextManager[Any]:
    """Context in which dense algebra of this size runs on as many threads as help it."""
    return one_thread(lapack) if unknowns < SMALL else nullcontext()
