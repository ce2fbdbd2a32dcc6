"""Presses of one body with several friction laws and paths: in parallel, or increment by increment in turn."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from threading import Event
from typing import TypeVar

from finger3d._machine import cores
from finger3d.contact.acceleration import one_thread
from finger3d.contact.state import ContactState
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march

Variant = TypeVar("Variant")
Result = TypeVar("Result")

_ROWS_FOR_THREADS = 1000
"""Contact rows from which presses at once are quicker than in turn; below that their time is spent in Python."""


_STRIDES = (4, 2, 1)
"""Distances between the friction laws with which an increment is solved one after another."""


def map_parallel(
    problem: Problem,
    press: Callable[[Variant, Sequence[Result], Workspace, Event], Result],
    variants: Sequence[Variant],
    most: int | None = None,
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
    """
    formulation = problem.model.formulation
    known: tuple[Result, ...] = ()
    at_once = min(len(variants), cores() if most is None else most)
    cancel = Event()
    if len(problem.system.active_dofs) < _ROWS_FOR_THREADS or at_once < 2 or formulation.refactorises:
        workspace = formulation.workspace()
        for variant in variants:
            known = (*known, press(variant, known, workspace, cancel))[-2:]
            yield known[-1]
        return
    waiting = iter(variants)
    # The limit on threads is set once around the pool: a limit set by a press would undo that of another.
    with one_thread(), ThreadPoolExecutor(at_once) as pool:

        def submitted(count: int) -> list[Future[Result]]:
            return [
                pool.submit(press, variant, known, formulation.workspace(), cancel)
                for variant in islice(waiting, count)
            ]

        running = deque(submitted(at_once))
        try:
            while running:
                known = (*known, running.popleft().result())[-2:]
                running.extend(submitted(1))
                yield known[-1]
        finally:
            cancel.set()
            pool.shutdown(cancel_futures=True)


def march_together(
    problems: Sequence[Problem], workspace: Workspace, cancel: Event
) -> Iterator[tuple[int, StepResult]]:
    """Press one body with several friction laws at once: every increment with all of them before the next.

    All share the factors.  An increment is solved with every fourth law first; those between begin with the mean of
    what it changed with their neighbours.

    Yields
    ------
    Number of the problem, and the result of its next increment.
    """
    running = {number: march(problem, (), workspace, cancel) for number, problem in enumerate(problems)}
    states = [problem.model.formulation.start(problem) for problem in problems]
    while running:
        changes: dict[int, tuple[ContactState, ContactState]] = {}
        for stride in _STRIDES:
            for number in [n for n in running if n % stride == 0 and n not in changes]:
                workspace.similar = tuple(changes[n] for n in (number - stride, number + stride) if n in changes)
                step = next(running[number], None)
                workspace.similar = ()
                if step is None:
                    del running[number]
                    continue
                changes[number] = states[number], step.part
                states[number] = step.part
                yield number, step
