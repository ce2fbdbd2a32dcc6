"""Threads for small dense systems: one is quicker, and far quicker on a machine that has other work."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

SMALL = 3000
"""Rows of a compliance below which two threads gain little, and lose a factor 10 on a busy machine (at 640 rows)."""


@cache
def _controller() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def one_thread() -> AbstractContextManager[Any]:
    """Context in which dense algebra runs on one thread."""
    return _controller().limit(limits=1)


def threads_for(unknowns: int) -> AbstractContextManager[Any]:
    """Context in which dense algebra of this size runs on as many threads as help it."""
    return one_thread() if unknowns < SMALL else nullcontext()
