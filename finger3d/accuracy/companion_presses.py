"""Presses on the companions of a mesh, from which its error is estimated."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from threading import Event
from types import TracebackType
from typing import NamedTuple, Self

from finger3d.contact.acceleration import one_thread
from finger3d.errors import FAILURES
from finger3d.mechanics.discretise.companions import coarse_companions, finer_companions
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import FEW_CUTS, StepEstimate, last_step, rough_workspace
from finger3d.progress import QUIET, Progress


class CompanionPress(NamedTuple):
    """Edge length of a companion over that of the mesh, its problem, and its last increment."""

    ratio: float
    problem: Problem
    end: StepResult


def companion_presses(
    problem: Problem,
    chosen: StepEstimate | None = None,
    report: Progress = QUIET,
    cancel: Event | None = None,
    unknowns: int | None = None,
) -> list[CompanionPress]:
    """Press the companions of a problem in the same increments, which are numbers; those that fail are left out.

    They have coarser meshes; where there are none, finer ones.

    Parameters
    ----------
    chosen : runs of a companion that chose automatic increments
    unknowns : of the mesh whose error follows, in place of those of the problem's
    """
    found = []
    for ratio, beside in coarse_companions(problem, report, chosen.beside if chosen else None, unknowns):
        try:
            found.append(CompanionPress(ratio, beside, _end_of(beside, chosen, cancel)))
        except FAILURES:
            continue
    if not found:
        finer = finer_companions(problem, report)
        found = [CompanionPress(ratio, beside, _end_of(beside, None, cancel)) for ratio, beside in finer]
    return found


def _end_of(beside: Problem, chosen: StepEstimate | None, cancel: Event | None) -> StepResult:
    """Return the last increment of a companion, pressed roughly unless it is known."""
    if chosen and chosen.beside and chosen.beside.mesh is beside.mesh:
        count, steps = chosen.runs[-1]
        if all(leg.steps == count for leg in beside.model.legs):
            return steps[-1]
    return last_step(beside, rough_workspace(beside), FEW_CUTS, cancel)


class CompanionThread:
    """Thread in which the companions of one problem are pressed while that is pressed itself.

    An increment at finite strain has too little work for two threads; two presses do not take much longer than one.
    """

    def __init__(self) -> None:
        self._problem: Problem | None = None
        self._cancel, self._running = Event(), ExitStack()
        self._future: Future[list[CompanionPress]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._cancel.set()
        self._running.close()

    def begin(self, problem: Problem, chosen: StepEstimate | None = None) -> None:
        """Press the companions of a problem in increments that are numbers; those of an earlier one are given up."""
        self.__exit__(None, None, None)
        self._problem, self._cancel = problem, Event()
        self._running.enter_context(one_thread())
        pool = self._running.enter_context(ThreadPoolExecutor(1))
        self._future = pool.submit(companion_presses, problem, chosen, QUIET, self._cancel)

    def of(self, problem: Problem, chosen: StepEstimate | None, report: Progress) -> list[CompanionPress]:
        """Return the presses of a problem's companions, made now unless they were begun; raises what they raised."""
        if self._future is None or self._problem is None or self._problem.mesh is not problem.mesh:
            return companion_presses(problem, chosen, report)
        try:
            return self._future.result()
        finally:
            self._running.close()
