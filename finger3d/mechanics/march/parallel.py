"""Presses of one body with several friction laws and paths, in parallel."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from threading import Event
from typing import TypeVar

from finger3d._machine import cores
from finger3d.contact.acceleration import one_thread
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of

Variant = TypeVar("Variant")
Result = TypeVar("Result")

_ROWS_FOR_THREADS = 1000
"""Contact rows from which concurrent presses are faster than sequential ones; below, most time is spent in Python."""


def map_parallel(
    problem: Problem,
    press: Callable[[Variant, Sequence[Result], Workspace, Event], Result],
    variants: Sequence[Variant],
    most: int | None = None,
    threads_from: int | None = None,
) -> Generator[Result, None, None]:
    """Press one body as several variants, and yield the results in the order of the variants.

    Presses run at once, each on one thread, if the body has enough contact points for that to pay and the formulation
    factors nothing on the way; otherwise one after another.  Closing the generator cancels those that run.

    Parameters
    ----------
    problem : Problem
        The condensed body.
    press : function of a variant, the last two results known, a workspace, and the event that cancels it
        The results may serve as initial guess; workspace and event are for `march`.
    variants : sequence
    most : int, optional
        Largest number of presses at once; the number of cores unless given.
    threads_from : int, optional
        Number of contact rows from which presses run at once; `_ROWS_FOR_THREADS` unless given.
    """
    formulation = formulation_of(problem.model)
    last_results: tuple[Result, ...] = ()
    at_once = min(len(variants), cores() if most is None else most)
    cancel = Event()
    least = _ROWS_FOR_THREADS if threads_from is None else threads_from
    if len(problem.system.active_dofs) < least or at_once < 2 or problem.model.refactorises:
        workspace = formulation.workspace()
        for variant in variants:
            last_results = (*last_results, press(variant, last_results, workspace, cancel))[-2:]
            yield last_results[-1]
        return
    waiting = iter(variants)
    # The limit on threads is set once around the pool: a limit set by a press would undo that of another.
    with one_thread(), ThreadPoolExecutor(at_once) as pool:

        def submitted(count: int) -> list[Future[Result]]:
            return [
                pool.submit(press, variant, last_results, formulation.workspace(), cancel)
                for variant in islice(waiting, count)
            ]

        running = deque(submitted(at_once))
        try:
            while running:
                last_results = (*last_results, running.popleft().result())[-2:]
                running.extend(submitted(1))
                yield last_results[-1]
        finally:
            cancel.set()
            pool.shutdown(cancel_futures=True)
