"""The main job: a scene to numbers, tables, fields and pictures, written as they come."""

from __future__ import annotations

import math
import time
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d._machine import versions
from finger3d.analyses.result import PressResult
from finger3d.contact.friction import OPEN
from finger3d.fem.simplex import middles
from finger3d.io import atomic, claimed, write_csv, write_json
from finger3d.mechanics.history import History, StepResult, contact_table, measure
from finger3d.plotting.worker import PlotWorker
from finger3d.progress import Progress
from finger3d.results.vtu import write_vtu

if TYPE_CHECKING:
    from finger3d.accuracy.estimate import ErrorEstimate
    from finger3d.accuracy.prefetch import MeshPrefetch
    from finger3d.accuracy.refine import Refinement
    from finger3d.mechanics.solve import Problem
    from finger3d.mechanics.step_halving import StepEstimate
    from finger3d.scene import Scene

_WRITE_EVERY_S = 0.5
_WRITE_SHARE = 10.0  # a file tells of all increments so far: of thousands it takes seconds, so it is written less often
_DEEP = 0.3  # the Fig. 9 finger is pressed by a fifth, the half cylinder too
_FEW_POINTS = {2: 6, 3: 100}  # six along a line; ten by ten on a face
_INCOMPLETE = "incomplete: the press was still running, or was interrupted; the steps written are good"


def _peak_memory_mb() -> float:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


class _Output:
    """The files of a press that grow with its steps."""

    def __init__(self, scene: Scene, problem: Problem, out: Path, started: float, before: int) -> None:
        from finger3d.mechanics import resolution

        self.scene, self.problem, self.out, self.started = scene, problem, out, started
        self.factorizations_before = before
        self.factorizations: int | None = None  # of the press alone, once it is done: the estimate makes its own
        self.frames: list[StepResult] = []
        self.estimate: StepEstimate | None = None
        self.error: ErrorEstimate | None = None
        self.refinement: dict[str, Any] | None = None
        self.coupling = problem.coupling()
        self.advice: list[str] = []
        self.warnings = [*problem.model.warnings, *_coupling_warning(self.coupling), *_depth_warning(problem)]
        self.warnings += resolution.warnings(problem)
        self.seconds = {"cad": 0.0, "mesh": 0.0, **problem.seconds, "contact": 0.0, "output": 0.0}
        self._written = -math.inf
        self._write_s = 0.0

    def add(self, frame: StepResult, seconds: float) -> None:
        self.frames.append(frame)
        self.seconds["contact"] += seconds
        if time.perf_counter() - self._written > max(_WRITE_EVERY_S, _WRITE_SHARE * self._write_s):
            self.write(_INCOMPLETE)

    def write(self, outcome: str, tables: bool = True) -> dict[str, Any]:
        """The summary, and with it the tables, unless those on disk tell of these very frames."""
        begin = time.perf_counter()
        steps = [measure(self.problem.points, f) for f in self.frames]
        summary = self._summary(steps, outcome)
        write_json(self.out / "summary.json", summary)
        if steps and tables:
            flat = [{**s, **{f"gauge_{k}": v for k, v in s["gauges"].items()}} for s in steps]
            write_csv(self.out / "history.csv", {k: [row[k] for row in flat] for k in flat[0] if k != "gauges"})
            last = next((f for f in reversed(self.frames) if f.outcome.ok), self.frames[-1])
            write_csv(self.out / "contact.csv", contact_table(self.problem.points, last.state))
        self._written = time.perf_counter()
        self._write_s = self._written - begin
        self.seconds["output"] += self._write_s
        return summary

    def _summary(self, steps: list[dict[str, Any]], outcome: str) -> dict[str, Any]:
        problem, report = self.problem, self.problem.report
        return {
            "scene": self.scene.as_dict(),
            "effects": list(self.scene.effects),
            "outcome": outcome,
            "warnings": self.warnings,
            "advice": self.advice,
            "steps": steps,
            "step_estimate": self.estimate.as_dict() if self.estimate else None,
            "error_estimate": self.error.as_dict() if self.error else None,
            "refinement": self.refinement,
            "uniqueness": {"largest_coupling": self.coupling},
            "mesh": {
                "points": report.points,
                "cells": report.cells,
                "dofs": int(problem.stiffness.upper.shape[0]),
                "contact_points": len(problem.surface.nodes),
                "min_dihedral_deg": report.min_dihedral_deg,
                "volume_mm3": report.volume_mm3,
                "cad_volume_mm3": report.cad_volume_mm3,
                "hash": report.hash,
                "from_cache": report.from_cache,
                "cache_path": report.cache_path,
                "symmetry": list(problem.axes),
                "formulation": "mixed quadratic/linear" if problem.elastic.mixed else "quadratic displacement",
            },
            "cost": {
                "seconds": {**self.seconds, "total": time.perf_counter() - self.started},
                "factorizations": self.factorizations_before
                + (problem.factorizations if self.factorizations is None else self.factorizations),
                "peak_memory_MB": _peak_memory_mb(),
                "solver": problem.condensed.solver,
                "perturbed_pivots": problem.condensed.perturbed_pivots,
            },
            "versions": versions(),
        }


def press(
    scene: Scene | str | Path,
    out: str | Path | None = None,
    report: Progress | None = None,
    figures: bool | None = None,
    error: bool = True,
    artist: PlotWorker | None = None,
) -> PressResult:
    """Press a scene, and write its results into a folder.

    Parameters
    ----------
    scene : a loaded scene, or the path of a TOML file
    out : folder, made if it is not there; None: a temporary one, which is removed together with what is returned
    report : told about stages and steps
    figures : whether to draw PNG files and to write report.html; None: if a folder is given
    error : whether to estimate the errors by mesh and increments, from a run on another mesh
    artist : one that has entered already, and loads what drawing needs; None: one of its own

    Returns
    -------
    PressResult
        With the outcome of the last step; steps up to a failure or an interruption are kept and written.

    Examples
    --------
    >>> import finger3d
    >>> finger3d.press("scene.toml", "out").summary()["outcome"]
    'converged'
    >>> stiff = finger3d.load("scene.toml", ["material.E_MPa=2.0"])
    >>> len(finger3d.press(stiff).history.steps)
    4
    """
    from finger3d.accuracy.prefetch import MeshPrefetch
    from finger3d.scene import load

    started = time.perf_counter()
    scene = load(scene) if isinstance(scene, str | Path) else scene
    temporary = TemporaryDirectory(prefix="finger3d-") if out is None else None
    figures = temporary is None if figures is None else figures
    with claimed(temporary.name if temporary else str(out), "press") as folder:
        with (
            nullcontext(artist) if artist else PlotWorker(figures, formulae=False) as mine,
            MeshPrefetch(scene if error else None) as ahead,
        ):
            drawing, beside = mine if figures else None, ahead if error else None
            history, summary = _pressed(scene, folder, report or Progress(), started, drawing, beside)
    return PressResult(history, folder, summary, temporary)


def _pressed(
    scene: Scene, folder: Path, report: Progress, started: float, artist: PlotWorker | None, ahead: MeshPrefetch | None
) -> tuple[History, dict[str, Any]]:
    from finger3d.accuracy.estimate import estimate, press_numbers
    from finger3d.mechanics import resolution
    from finger3d.mechanics.solve import step_within_candidates

    _clear(folder)
    refinement = _refined(scene, report)
    if refinement:
        scene = scene.with_mesh(refinement.mesh)
    with atomic(folder / "scene.toml") as path:
        path.write_text(scene.to_toml(), encoding="utf-8")
    problem, output = _solve(scene, folder, report, started, refinement=refinement)
    if output.frames and output.frames[-1].outcome.ok and not step_within_candidates(problem, output.frames[-1]):
        report.say("contact reached beyond the candidate points; solving again with all of the contact face")
        problem, output = _solve(scene, folder, report, started, math.inf, output, refinement)
    begin = time.perf_counter()
    report.stage("writing fields")
    _fields(problem, output, folder, artist)
    output.seconds["output"] += time.perf_counter() - begin
    output.warnings += _coarse_warning(problem, output.frames) + resolution.unseen(problem, output.frames)
    history = History(problem.points, tuple(output.frames))
    summary = output.write(_told(history), tables=False)
    if ahead:
        output.factorizations = problem.factorizations
        report.stage("estimating the error")
        ahead.wait()
        levels = [(count, ends[-1]) for count, ends in output.estimate.levels] if output.estimate else []
        output.error = estimate(problem, output.frames, output.seconds, report.say, press_numbers, levels)
        summary = output.write(_told(history), tables=False)
    if artist:
        report.stage("drawing")
        from finger3d.report.press import press_page  # while the pictures are drawn

        artist.finish()
        press_page(folder)
    return history, summary


def _refined(scene: Scene, report: Progress) -> Refinement | None:
    """Edge lengths for mesh.tolerance, if the scene asks for one."""
    mesh = scene.tables.mesh
    if mesh.tolerance is None:
        return None
    from finger3d.accuracy.refine import refined

    report.stage(f"refining to an error of {mesh.tolerance:g}")
    return refined(scene.model(), mesh.tolerance, mesh.max_seconds, report.say)


def _coupling_warning(coupling: float) -> list[str]:
    if coupling <= 1.0:
        return []
    return [
        f"the largest mu |K_tt^-1 K_tn| is {coupling:.3g}, above 1: several contact states may satisfy all conditions; "
        "the one reported follows from the history"
    ]


def _depth_warning(problem: Problem) -> list[str]:
    if problem.model.formulation.finite_strain:
        return []
    height = problem.model.design.height_mm
    share = max(leg.depth_mm for leg in problem.model.legs) / height
    if share <= _DEEP:
        return []
    return [
        f"the press reaches {100.0 * share:.0f} % of the finger's height of {height:.4g} mm: small strain is a poor "
        "model there, whatever the residual says; press less, or read the numbers as trends"
    ]


def _coarse_warning(problem: Problem, frames: list[StepResult]) -> list[str]:
    """Whether the contact is wide enough in points to be called resolved, where it was widest."""
    touching = max((f.state.status != OPEN for f in frames), key=np.count_nonzero, default=np.zeros(0, dtype=bool))
    count = int(np.count_nonzero(touching))
    if not count or count >= _FEW_POINTS[problem.dim]:
        return []
    return [f"only {count} points touch: too few for contact and stick lengths; lower mesh.size_mm"]


def _clear(folder: Path) -> None:
    """Remove results of an earlier run, so that no old number stands beside a new one."""
    pictures = ("finger.png", "contact.png", "force.png", "report.html")
    for name in ("summary.json", "history.csv", "contact.csv", "fields.vtu", "steps.npz", *pictures):
        (folder / name).unlink(missing_ok=True)


def _solve(
    scene: Scene,
    folder: Path,
    report: Progress,
    started: float,
    margin: float | None = None,
    before: _Output | None = None,
    refinement: Refinement | None = None,
) -> tuple[Problem, _Output]:
    from finger3d.mechanics.solve import build
    from finger3d.mechanics.step_halving import automatic

    model = scene.model()
    report.stage("meshing")
    problem = refinement.problem if refinement and margin is None else None
    if problem is None:
        problem = build(model, report.say) if margin is None else build(model, report.say, margin)
    spent = before.factorizations_before + before.problem.factorizations if before else 0
    output = _Output(scene, problem, folder, started, spent)
    if refinement:
        output.refinement = refinement.as_dict()
        output.warnings += [refinement.warning] if refinement.warning else []
    for warning in output.warnings:
        report.say(f"warning: {warning}")
    output.write("incomplete: no step was finished")
    try:
        if automatic(problem.model):
            _press_automatically(problem, output, report)
        else:
            _press_steps(problem, output, report)
    finally:
        output.write(_INCOMPLETE)
    return problem, output


def _press_steps(problem: Problem, output: _Output, report: Progress) -> None:
    from finger3d.mechanics.solve import march, targets

    total = len(targets(problem.model.legs))
    report.stage("pressing")
    begin = time.perf_counter()
    for done, frame in enumerate(march(problem), start=1):
        output.add(frame, time.perf_counter() - begin)
        report.step(done, total, _remark(problem, frame))
        begin = time.perf_counter()


def _press_automatically(problem: Problem, output: _Output, report: Progress) -> None:
    """Refine the increments; every finer run takes the place of the one before, also on disk."""
    from finger3d.mechanics.step_halving import refine

    report.stage("pressing, increments chosen by their error")
    begin = time.perf_counter()
    for frames, estimate in refine(problem):
        output.seconds["contact"] += time.perf_counter() - begin
        output.frames, output.estimate = list(frames), estimate
        output.write(_INCOMPLETE)
        report.step(len(frames), len(frames), _remark(problem, frames[-1]))
        begin = time.perf_counter()
    if estimate is not None and estimate.warning:
        output.warnings.append(estimate.warning)


def _remark(problem: Problem, frame: StepResult) -> str:
    force = measure(problem.points, frame)["normal_force_N"]
    return f"depth {frame.target.depth_mm:.4g} mm, force {force:.5g} N, residual {frame.residual:.1e}"


def _fields(problem: Problem, output: _Output, folder: Path, artist: PlotWorker | None) -> None:
    """fields.vtu and the pictures, from the last good step; the field is recovered with the factor at hand."""
    from finger3d.accuracy.advice import advise
    from finger3d.fem.simplex import unfold
    from finger3d.mechanics import resolution
    from finger3d.results.states import states_of, write_states

    good = [f for f in output.frames if f.outcome.ok]
    if not good:
        return
    frame, points = good[-1], problem.points
    u, strain, sigma = problem.model.formulation.fields(problem, frame.part)
    output.warnings += resolution.inside(problem, frame, u)
    output.advice = advise(problem, frame, strain)
    if output.estimate and output.estimate.advice:
        output.advice.append(output.estimate.advice)
    mesh, parent, sign = unfold(problem.mesh, tuple("xyz".index(a) for a in problem.axes))
    flip = np.ones((len(parent), 3))
    flip[:, : problem.dim] = sign
    whole_u = u[parent] * sign
    both = flip[:, :, None] * flip[:, None, :]
    table = contact_table(points, frame.state)
    if artist:
        _figures(problem, output, frame, mesh, whole_u, folder, artist)
    on_surface = {name: np.zeros(len(parent)) for name in ("pressure", "shear_x", "shear_z", "status")}
    ends, between = middles(mesh.facets["contact"], mesh.dim)
    for name in ("pressure", "shear_x", "shear_z"):
        on_surface[name][points.nodes] = table[f"{name}_MPa"]
        on_surface[name][between] = on_surface[name][ends].mean(axis=1)
    on_surface["status"][points.nodes] = frame.state.status
    on_surface["status"][between] = on_surface["status"][ends].min(axis=1)
    write_states(folder / "steps.npz", states_of(problem, good, mesh, parent, sign, whole_u))
    write_vtu(
        folder / "fields.vtu",
        mesh,
        {
            "displacement": whole_u,
            "strain": _voigt(strain[parent] * both),
            "stress": _voigt(sigma[parent] * both),
            **on_surface,
        },
    )


def _told(history: History) -> str:
    """The outcome, with the depth where a step failed."""
    failed = next((f for f in history.steps if not f.outcome.ok), None)
    return (
        str(history.outcome) if failed is None else f"at a depth of {failed.target.depth_mm:.4g} mm: {failed.outcome}"
    )


def _voigt(tensor: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Components xx yy zz xy yz xz (n, 6), VTK's order of a symmetric tensor."""
    return np.stack([tensor[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=1)


def _figures(
    problem: Problem, output: _Output, frame: StepResult, mesh: Any, u: Any, folder: Path, artist: PlotWorker
) -> None:
    from finger3d.plotting import figures as view
    from finger3d.plotting.gauges import marks_of

    steps = [measure(problem.points, f) for f in output.frames if f.outcome.ok]
    table = contact_table(problem.points, frame.state)
    artist.draw(
        view.contact_figure, folder / "contact.png", table, problem.model.friction.static, problem.points.band_mm,
        problem.points.half_width_mm if problem.dim == 3 else None,
    )  # fmt: skip
    artist.draw(view.force_figure, folder / "force.png", steps)
    artist.draw(
        view.finger_picture, folder / "finger.png", mesh, u, table, problem.points.nodes,
        f"{steps[-1]['normal_force_N']:.4g} N at {frame.target.depth_mm:g} mm",
        marks=marks_of(mesh, problem.model.gauges, near=mesh.dim == 3),
    )  # fmt: skip
    artist.begin()
