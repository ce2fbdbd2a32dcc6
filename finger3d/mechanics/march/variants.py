"""Presses of one body with several friction laws and paths, and of changed scenes beside the press that they vary."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from threading import Event
from typing import Generic, TypeVar

from finger3d._machine import cores
from finger3d.contact.acceleration import one_thread
from finger3d.errors import FAILURES, Finger3dError
from finger3d.mechanics.discretise.build import build, changed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model

Variant = TypeVar("Variant")
Result = TypeVar("Result")

_ROWS_FOR_THREADS = 1000
"""Contact rows from which concurrent presses are faster than sequential ones; below, most time is spent in Python."""


def map_parallel(
    problem: Problem,
    press: Callable[[Variant, Workspace, Event], Result],
    variants: Sequence[Variant],
    most: int | None = None,
    threads_from: int = _ROWS_FOR_THREADS,
) -> Generator[Result, None, None]:
    """Press one body as several variants, and yield the results in the order of the variants.

    Presses run at once, each on one thread, if the body has enough contact points for that to pay and the formulation
    factors nothing on the way; otherwise one after another.  Closing the generator cancels those that run.

    Parameters
    ----------
    problem : Problem
        The condensed body.
    press : function of a variant, a workspace, and the event that cancels it, both for `march`
    variants : sequence
    most : int, optional
        Largest number of presses at once; the number of cores unless given.
    threads_from : int, optional
        Number of contact rows from which presses run at once.
    """
    formulation = formulation_of(problem.model)
    at_once = min(len(variants), cores() if most is None else most)
    cancel = Event()
    if len(problem.system.active_dofs) < threads_from or at_once < 2 or problem.model.refactorises:
        workspace = formulation.workspace()
        for variant in variants:
            yield press(variant, workspace, cancel)
        return
    waiting = iter(variants)
    # The limit on threads is set once around the pool: a limit set by a press would undo that of another.
    with one_thread(), ThreadPoolExecutor(at_once) as pool:

        def submitted(count: int) -> list[Future[Result]]:
            return [pool.submit(press, variant, formulation.workspace(), cancel) for variant in islice(waiting, count)]

        running = deque(submitted(at_once))
        try:
            while running:
                found = running.popleft().result()
                running.extend(submitted(1))
                yield found
        finally:
            cancel.set()
            pool.shutdown(cancel_futures=True)


T = TypeVar("T")

Read = Callable[[Problem, Sequence[StepResult]], T]
"""Returns what is kept of a press: of its problem and its increments, all converged."""


@dataclass(frozen=True)
class PressedVariant(Generic[T]):
    """Press of a changed scene, in the same increments.

    Attributes
    ----------
    model : what was pressed
    found : what was kept of the press; None if it failed
    failure : why it failed, in words
    """

    model: Model
    found: T | None
    failure: str = ""


def press_variants(problem: Problem, models: Sequence[Model], read: Read[T]) -> list[PressedVariant[T]]:
    """Press changed models beside a problem, each in as many increments.

    A variant shares the condensed body where only friction, path or a rigid object differ, and else the cells of the
    mesh, which move with the dimensions.  At finite strain all variants share the tangents of the problem, which is
    pressed with them; in small strain they are pressed at once on all cores.

    Parameters
    ----------
    problem : its increments are numbers
    models : their legs have as many increments; the problem's own may be among them
    read : of each press
    """
    if problem.model.finite_strain:
        return _share_tangents(problem, models, read)

    def pressed(model: Model) -> PressedVariant[T]:
        try:
            own = _problem(problem, model)[0]
            return _variant(own, list(march(own)), read)
        except FAILURES as error:
            return _failed(model, error)

    with one_thread(), ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(pressed, models))


def _problem(problem: Problem, model: Model) -> tuple[Problem, bool]:
    """Return the problem of a changed model, and whether it is meshed anew."""
    try:
        return changed(problem, model), False
    except Finger3dError:
        return build(model), True


def _share_tangents(problem: Problem, models: Sequence[Model], read: Read[T]) -> list[PressedVariant[T]]:
    from finger3d.mechanics.march.groups import march_in_groups  # a press in small strain needs none of it

    variants: dict[int, PressedVariant[T]] = {}
    itself = [number for number, model in enumerate(models) if model is problem.model]
    alike, others = dict[int, Problem](), dict[int, Problem]()
    for number, model in enumerate(models):
        if number in itself:
            continue
        try:
            own, is_new = _problem(problem, model)
        except FAILURES as error:
            variants[number] = _failed(model, error)
        else:
            (others if is_new else alike)[number] = own
    numbers = [*list(alike)[: len(alike) // 2], None, *list(alike)[len(alike) // 2 :]]
    several = [problem if number is None else alike[number] for number in numbers]
    for place, steps in march_in_groups(several, formulation_of(problem.model).workspace(), Event()):
        own_number = numbers[place]
        for number in itself if own_number is None else [own_number]:
            variants[number] = _variant(several[place], steps, read)
    for number, own in others.items():
        variants[number] = _variant(own, list(march(own)), read)
    return [variants[number] for number in range(len(models))]


def _variant(problem: Problem, steps: Sequence[StepResult], read: Read[T]) -> PressedVariant[T]:
    try:
        steps[-1].check("a variant")
        return PressedVariant(problem.model, read(problem, steps))
    except FAILURES as error:
        return _failed(problem.model, error)


def _failed(model: Model, error: Exception) -> PressedVariant[T]:
    return PressedVariant(model, None, str(error) or type(error).__name__)
