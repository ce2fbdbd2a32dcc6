"""Press a scene: solve it, recover the fields, estimate the errors, and write and draw the results."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from finger3d.accuracy.estimate import CompanionThread
from finger3d.analyses.press_files import Fields, PressRecord, ResultWriter, point_count_warning
from finger3d.analyses.pressed_body import PressedBody, with_penetration
from finger3d.analyses.result import PressResult, result_in
from finger3d.errors import Finger3dError
from finger3d.io import claimed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import with_few_increments
from finger3d.progress import Progress

if TYPE_CHECKING:
    from finger3d.accuracy.refine import Refinement
    from finger3d.mechanics.march.step_halving import StepEstimate
    from finger3d.results.states import States
    from finger3d.scene import Scene, Source


_WITHIN = 0.01
"""Relative distance of a force that holds and one that does not at which the search ends."""

_INCREMENTS = 5
"""Increments of closing and of each load: the force at which all of a contact slips hardly depends on them."""

_NONE = 1e-4
"""Share of the largest force below which no grip is needed."""


def least_grip(problem: Problem, largest: float, report: Progress) -> float:
    """Return the smallest force (N) that holds the object, within 1 % of one that does not, or 0 if none is needed.

    The first two trials are next to the force at which Coulomb's friction on flat faces bears the load.

    Parameters
    ----------
    problem : a finger of a grip
    largest : force (N) of each finger that holds
    """
    few = with_few_increments(problem, _INCREMENTS)
    workspace = formulation_of(problem.model).workspace()

    def holds(force: float) -> bool:
        legs = tuple(replace(leg, force_N=2.0 * force) for leg in few.model.legs)
        steps = list(march(replace(few, model=replace(few.model, legs=legs)), workspace=workspace))
        report.say(f"a grip of {force:.4g} N {'holds' if steps[-1].outcome.ok else 'does not hold'} the object")
        return steps[-1].outcome.ok

    mu = problem.model.friction.largest
    tangential = max(math.hypot(leg.force_x_N or 0.0, leg.force_z_N or 0.0) for leg in few.model.legs)
    flat = 0.5 * tangential / mu if mu > 0.0 else math.inf
    trials = [share * flat for share in (1.0 + 0.45 * _WITHIN, 1.0 - 0.45 * _WITHIN)]
    not_held, held = 0.0, largest
    while held > max((1.0 + _WITHIN) * not_held, _NONE * largest):
        known = [trial for trial in trials if not_held < trial < held]
        force = known[0] if known else float(np.sqrt(not_held * held)) if not_held else 0.5 * held
        not_held, held = (not_held, force) if holds(force) else (force, held)
    return held if not_held else 0.0


Begun: TypeAlias = "Callable[[Problem, StepEstimate | None], None]"

_SHOWN_EVERY_S = 1.0
"""Seconds between reports of the trial depths under a prescribed force, and of the increments of a trial run."""


def press(
    scene: Source,
    out: str | Path | None = None,
    report: Progress | None = None,
    figures: bool | None = None,
    error: bool = True,
    overrides: Sequence[str] = (),
    least_grip: bool = False,
) -> PressResult:
    """Press a scene, and write its results into a folder.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder, made if it is not there; None: a temporary one, which is removed together with what is returned
    report : receives the progress
    figures : whether to draw PNG files and to write report.html; None: if a folder is given
    error : whether to estimate the errors due to the mesh and the increments
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    least_grip : whether to find the smallest grip that holds, of a scene with two fingers

    Returns
    -------
    PressResult
        With the outcome of the last step; steps up to a failure or an interruption are kept and written.

    Examples
    --------
    >>> import finger3d
    >>> finger3d.press("scene.toml", "out").last.outcome
    'converged'
    >>> len(finger3d.press("scene.toml", overrides=["material.E_MPa=2.0"]).steps)
    4
    """
    from finger3d.analyses.free_keys import settled
    from finger3d.scene import scene_of

    started = time.perf_counter()
    scene = scene_of(scene, overrides)
    if least_grip and scene.tables.grip is None:
        raise Finger3dError("--least-grip: only of a scene with [grip]")
    temporary = TemporaryDirectory(prefix="finger3d-") if out is None else None
    figures = temporary is None if figures is None else figures
    report = report or Progress()
    with claimed(temporary.name if temporary else str(out), "press") as folder, CompanionThread() as companions:
        writer = ResultWriter(folder)
        scene, need = settled(scene, report)
        record = _solve(scene, writer, report, started, companions.begin if error else None)
        record.need = need
        fields = _recover(record, writer, report)
        writer.summary(record, record.outcome())
        with writer.pictures(record, fields) if figures and fields else nullcontext(lambda: None) as draw:
            if error:
                _estimate_errors(record, report, companions)
                writer.markers(record)
                _estimate_changes(record, report)
                writer.summary(record, record.outcome())
            if least_grip:
                _find_least_grip(record, report)
                writer.summary(record, record.outcome())
            if figures:
                from finger3d.report.press import press_page

                report.stage("drawing")
                draw()
                press_page(folder).write(folder)
    return result_in(folder, record.history, temporary)


# --- solve --------------------------------------------------------------------------------------------------------


def _solve(scene: Scene, writer: ResultWriter, report: Progress, started: float, begun: Begun | None) -> PressRecord:
    """Build the problem and march through its increments, again with all points of the free faces if contact reaches
    beyond the candidate points.

    Parameters
    ----------
    begun : called with the problem, and how its increments were chosen, before a press at large deformation
    """
    for warning in scene.model().warnings:
        report.say(f"warning: {warning}")
    refinement = _refine_mesh(scene, report)
    if refinement:
        scene = scene.with_mesh(refinement.mesh)
    writer.scene(scene.to_toml())
    report.stage("meshing")
    model = scene.model()
    known = refinement.problem if refinement else None
    body = PressedBody(model, report, known) if known else PressedBody.with_refined_borders(model, report)

    def press_all(problem: Problem, before: PressRecord | None) -> tuple[PressRecord, list[StepResult]]:
        spent = before.all_factorizations if before else 0
        record = PressRecord(scene, problem, started, refinement, spent)
        _march(record, writer, report, begun if problem.model.finite_strain else None)
        return record, record.converged_steps

    record, checks = body.pressed(press_all)
    record.surface_checks = checks
    record.steps = with_penetration(record.steps, checks)
    writer.progress(record)
    return record


def _refine_mesh(scene: Scene, report: Progress) -> Refinement | None:
    """Return the refined mesh, if the scene has mesh.tolerance."""
    mesh = scene.tables.mesh
    if mesh.tolerance is None:
        return None
    from finger3d.accuracy.refine import GOAL, refine_mesh

    goal = mesh.goal or GOAL
    report.stage(f"refining to an error of {mesh.tolerance:g} in {goal}")
    return refine_mesh(scene.model(), mesh.tolerance, mesh.max_seconds, report, goal)


def _march(record: PressRecord, writer: ResultWriter, report: Progress, begun: Begun | None) -> None:
    """Solve the increments of a record, and write what there is after each and after an interruption."""
    from finger3d.mechanics.march.step_halving import automatic, with_steps
    from finger3d.mechanics.path import AUTO_START

    for warning in record.warnings[len(record.problem.model.warnings) :]:  # those of the model are said before
        report.say(f"warning: {warning}")
    writer.progress(record, "incomplete: no increment was finished")
    try:
        if automatic(record.problem.model):
            _march_automatically(record, writer, report, begun or (lambda problem, chosen: None))
        else:
            if begun:
                begun(with_steps(record.problem, AUTO_START), None)
            _march_through(record, writer, report)
    finally:
        writer.progress(record)


def _march_through(record: PressRecord, writer: ResultWriter, report: Progress) -> None:
    """Solve the increments that the scene names."""
    from finger3d.mechanics.march.solve import march
    from finger3d.mechanics.path import targets

    total = len(targets(record.problem.model.legs))
    report.stage("pressing")
    begin = time.perf_counter()
    for step in march(record.problem, workspace=record.workspace, report=report):
        record.steps.append(step)
        record.seconds["contact"] += time.perf_counter() - begin
        writer.progress_if_due(record)
        report.step(len(record.steps), total, _remark(record.problem, step))
        begin = time.perf_counter()


def _march_automatically(record: PressRecord, writer: ResultWriter, report: Progress, begun: Begun) -> None:
    """Halve the increments until their error is small; every finer run takes the place of the one before."""
    from finger3d.mechanics.march.step_halving import refine

    report.stage("pressing, increments chosen by their error")
    begin = time.perf_counter()
    advanced = _now_and_then(lambda done, total, step: report.step(done, total, _remark(record.problem, step)))
    for steps, estimate in refine(record.problem, record.workspace, advanced=advanced, chosen=begun):
        record.seconds["contact"] += time.perf_counter() - begin
        record.steps, record.step_estimate = list(steps), estimate
        writer.progress(record)
        report.step(len(steps), len(steps), _remark(record.problem, steps[-1]))
        begin = time.perf_counter()
    if record.step_estimate and record.step_estimate.warning:
        record.warnings.append(record.step_estimate.warning)


def _now_and_then(show: Callable[..., None]) -> Callable[..., None]:
    """Return a function that calls `show` if it last did so more than `_SHOWN_EVERY_S` ago."""
    last = time.perf_counter()

    def shown(*arguments: object) -> None:
        nonlocal last
        if time.perf_counter() - last > _SHOWN_EVERY_S:
            show(*arguments)
            last = time.perf_counter()

    return shown


def _remark(problem: Problem, step: StepResult) -> str:
    force = measure(problem.points, step)["normal_force_N"]
    return f"depth {step.target.depth_mm:.4g} mm, force {force:.5g} N, residual {step.residual:.1e}"


# --- recover and estimate -----------------------------------------------------------------------------------------


def _recover(record: PressRecord, writer: ResultWriter, report: Progress) -> States | None:
    """Recover and write the fields after the last converged increment, None without one; add warnings and advice."""
    from finger3d.accuracy.model_error import largest_principal_strain
    from finger3d.mechanics.finite_strain.increment import fold_warnings, snap_warnings
    from finger3d.mechanics.postprocess.penetration import (
        cavity_warnings,
        increments_without_contact,
        penetration_warnings,
    )

    begin = time.perf_counter()
    report.stage("writing fields")
    states, good, problem = None, record.converged_steps, record.problem
    if good:
        formulation = formulation_of(problem.model)
        fields = [Fields.of(own, *formulation.fields(own, steps[-1].meshed_state)) for own, steps in record.fingers()]
        record.warnings += penetration_warnings(problem, record.surface_checks) + fold_warnings(problem, good)
        record.warnings += snap_warnings(good)
        record.largest_strain = max(largest_principal_strain(one.strain) for one in fields)
        _advise(record)
        record.warnings += cavity_warnings(fields[0].mesh, fields[0].displacement)
        states = writer.fields(record, fields)
    record.warnings += point_count_warning(record) + increments_without_contact(problem, record.steps)
    record.seconds["output"] += time.perf_counter() - begin
    return states


def _estimate_errors(record: PressRecord, report: Progress, companions: CompanionThread) -> None:
    """Estimate the errors by mesh and increments."""
    from finger3d.accuracy.estimate import estimate_with_grid, modulus_errors, press_numbers
    from finger3d.scene.material import spreads

    report.stage("estimating the error")
    found, of_grid = estimate_with_grid(
        record.problem, record.steps, record.marker_grid, report, record.step_estimate, companions.of
    )
    record.marker_errors = found.totals() | of_grid
    known = spreads(record.scene.tables) if record.steps and record.steps[-1].outcome.ok else {}
    by_modulus, why = modulus_errors(record.problem, record.converged_steps, known, press_numbers)
    method = f"{found.method}; no errors by the spread of the modulus: {why}" if why else found.method
    record.error_estimate = replace(found, modulus=by_modulus, method=method)


def _find_least_grip(record: PressRecord, report: Progress) -> None:
    """Find the smallest grip that holds; none where the scene's own does not."""

    if not record.history.outcome.ok:
        record.warnings.append("least grip: the scene's own grip does not hold the object; ask with a larger one")
        return
    report.stage("looking for the smallest grip that holds")
    ends = [record.entry(steps[-1])["normal_force_N"] for _, steps in record.fingers()]
    record.least_grip_N = least_grip(record.problem, 0.5 * sum(ends), report)


def _estimate_changes(record: PressRecord, report: Progress) -> None:
    """Estimate what effects that are off would change; add advice on it."""
    from finger3d.accuracy.changes import changing_numbers

    problem, steps = record.problem, record.steps
    if not steps or not steps[-1].outcome.ok:
        return
    numbers = changing_numbers(problem, steps[-1])
    if record.need:
        record.model_error = record.need.changes(numbers)
    elif not problem.model.finite_strain:
        from finger3d.accuracy.model_error import judged_large_deformation
        from finger3d.effects import LARGE_DEFORMATION

        report.stage("estimating what large deformation would change")
        judged = judged_large_deformation(problem.model)
        record.model_error = {LARGE_DEFORMATION: judged.estimate.of_press(numbers)}
    _advise(record)


def _advise(record: PressRecord) -> None:
    """Set the lines of advice that follow from the results so far."""
    from finger3d.accuracy.model_error import advise
    from finger3d.mechanics.postprocess.penetration import penetration_advice

    large = record.model_error.get("large_deformation")
    record.advice = advise(record.problem.model, record.largest_strain, large)
    record.advice += penetration_advice(record.problem, record.surface_checks)
