"""Calibration of readings of a scene: one condensation, a press for every mu, and the effect of the tolerances."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._machine import versions
from finger3d._types import Tree
from finger3d.analyses.calibrate.curve_points import CurvePoints, choose_increments, choose_mesh
from finger3d.analyses.calibrate.settings import MUS, CalibrationSettings, found_readings
from finger3d.analyses.calibrate.tolerances import displaced_gauges, evaluate_tolerances, read, with_defaults
from finger3d.analyses.pressed_body import PressedBody, presses, under
from finger3d.analyses.reduced import ReducedModel
from finger3d.io import claimed, write_csv, write_text
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Model
from finger3d.plotting.analyses import draw_calibration
from finger3d.progress import Progress
from finger3d.report.analyses import calibrate_page
from finger3d.sensor.calibration import Calibration, save, write_table
from finger3d.sensor.curve import (
    MARKER_NOISE_MM,
    NOISE,
    NOISES,
    RESOLUTION,
    TAXEL_NOISE_MPA,
    Kind,
    ReadingCurve,
    Tolerance,
)

if TYPE_CHECKING:
    from finger3d.scene import Scene, Source


def write_points(folder: Path, curve: CurvePoints, settings: CalibrationSettings) -> None:
    """Write the values of mu that are finished to calibration.csv."""
    frames, failed = curve.frames, curve.failed
    mus = [p.mu for p in curve.presses]
    columns: Tree = {"mu": mus}
    for name in settings.names:
        columns[name] = [frames[mu].named_readings[name] if mu in frames else math.nan for mu in mus]
    write_csv(folder / "calibration.csv", columns | {"outcome": [failed.get(mu, "converged") for mu in mus]})


def write_body(folder: Path, model: Model, problem: Problem, report: Progress) -> None:
    """Write the condensed body with the readings of the scene, without the displaced gauges, to reduced.npz."""
    if not model.is_linear_elastic:
        report.say("no reduced.npz: the compliance of the body changes during the press")
        return
    rows = problem.system.reading_rows[: len(model.columns)]
    own = replace(
        problem,
        model=replace(problem.model, gauges=model.gauges),
        system=replace(problem.system, reading_rows=rows),
    )
    ReducedModel.of(own).save(folder / "reduced.npz")


_FILES = ("calibration.json", "calibration.csv", "calibration.png", "reduced.npz", "report.html")

_SIZES = {"size_mm", "base_size_mm", "tolerance"}
"""Keys of [mesh] with which a scene chooses its own mesh."""


def calibrate(
    scene: Source,
    gauge: str | Sequence[str],
    out: str | Path | None = None,
    mus: Sequence[float] = MUS,
    noise: float = NOISE,
    limit: float = RESOLUTION,
    tolerances: Mapping[str, float] | None = None,
    report: Progress | None = None,
    marker_noise_mm: float = MARKER_NOISE_MM,
    taxel_noise_MPa: float = TAXEL_NOISE_MPA,
    overrides: Sequence[str] = (),
) -> Calibration:
    """Calibrate a gauge, or several readings together: their values at the end of the scene's path, for every mu.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene; its own friction.mu does not matter
    gauge : name of a [[gauge]]; or names of several readings: gauges, ``m1.x`` of a [[marker]], and taxels
    out : folder for calibration.json, .csv, .png, reduced.npz; None writes nothing
    mus : coefficients of friction, from 0 up
    noise, limit : standard deviation of a strain reading, and largest one of mu at which the sensor is usable
    tolerances : standard deviations by name, in place of the defaults of `TOLERANCES`; 0 omits one. The default of
        E_percent is the largest spread of a modulus, if the scene gives hardnesses or silicones
    report : receives the progress
    marker_noise_mm, taxel_noise_MPa : standard deviation of a reading of a marker, and of a taxel
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        For an unknown reading, a scene without one, or numbers out of range.
    MissingError
        If fewer than four values of mu converge; the others are in calibration.csv.
    """
    from finger3d.analyses.free_keys import settled
    from finger3d.scene import scene_of
    from finger3d.scene.material import largest_spread

    report = report or Progress()
    scene, _ = settled(scene_of(scene, overrides), report)
    model = scene.model()
    noises: dict[Kind, float] = {"gauge": noise, "marker": marker_noise_mm, "taxel": taxel_noise_MPa}
    readings = found_readings(model, [gauge] if isinstance(gauge, str) else gauge, noises)
    tolerances = with_defaults(tolerances, largest_spread(scene.tables))
    settings = CalibrationSettings(readings, tuple(mus), limit, tolerances)
    with nullcontext() if out is None else claimed(out, "calibrate") as folder:
        return _calibrate_scene(scene, model, settings, folder, report)


def _calibrate_scene(
    scene: Scene, model: Model, settings: CalibrationSettings, folder: Path | None, report: Progress
) -> Calibration:
    """Press every mu, apply the tolerances, and write the results."""
    start = time.perf_counter()
    if folder:
        for name in _FILES:
            (folder / name).unlink(missing_ok=True)
        write_text(folder / "scene.toml", scene.to_toml())

    def calibrate_model(changed: Model) -> tuple[CurvePoints, Calibration]:
        curve = _press_all(changed, settings, report, folder)
        return curve, _calibration(curve, settings, report)

    automatic = not _SIZES & set(scene.given.get("mesh", {}))
    chosen = choose_mesh(model, automatic, calibrate_model, report)
    curve, calibration, used = chosen.curve, chosen.calibration, chosen.curve.problem.model.mesh
    if used != model.mesh:
        scene = scene.with_mesh(used)
        if folder:
            write_text(folder / "scene.toml", scene.to_toml())
    seconds = {**calibration.about["seconds"], "total": time.perf_counter() - start}
    about = {**_about(scene, curve), "seconds": seconds, "mesh": {**used.as_table(), "note": chosen.note}}
    digest = hashlib.sha256(scene.to_toml().encode()).hexdigest()[:16]
    calibration = replace(calibration, scene=scene.as_dict(), hash=digest, about=about)
    if folder:
        report.stage("writing")
        write_body(folder, model, curve.problem, report)
        write_table(calibration, folder / "calibration.csv")
        save(calibration, folder / "calibration.json")
        draw_calibration(folder / "calibration.png", calibration)
        calibrate_page(folder).write(folder)
    return calibration


def calibrated(
    model: Model,
    names: str | Sequence[str],
    mus: Sequence[float] = MUS,
    noises: Mapping[Kind, float] = NOISES,
    limit: float = RESOLUTION,
    tolerances: Mapping[str, float] | None = None,
) -> tuple[Calibration, CurvePoints]:
    """Return the calibration of readings of a model made in Python, and its presses; write nothing."""
    report = Progress()
    readings = found_readings(model, [names] if isinstance(names, str) else names, noises)
    settings = CalibrationSettings(readings, tuple(mus), limit, with_defaults(tolerances))
    curve = _press_all(model, settings, report)
    return _calibration(curve, settings, report), curve


def _press_all(
    model: Model, settings: CalibrationSettings, report: Progress, folder: Path | None = None
) -> CurvePoints:
    """Press every mu; again with all of the contact face if contact leaves the candidate points.

    Every mu that is finished is written to calibration.csv, so that a failure or an interruption keeps it.
    """
    chosen = [] if model.inclusions else [g for g in model.gauges if g.name in settings.names]
    extra = [d.gauge for gauge in chosen for d in displaced_gauges(model, gauge, settings.tolerances)]
    model = replace(model, gauges=(*model.gauges, *extra))
    report.stage("condensing")
    body = PressedBody(model, report)

    def press_all(problem: Problem, before: CurvePoints | None) -> tuple[CurvePoints, list[StepResult]]:
        spent = before.factorizations if before else 0
        for curve in _curve_points(problem, settings, report):
            seconds = {"build": body.seconds, **curve.seconds}
            curve = replace(curve, seconds=seconds, factorizations_before=spent)
            if folder:
                write_points(folder, curve, settings)
        return curve, list(curve.frames.values())

    return body.pressed(press_all)[0]


def _curve_points(problem: Problem, settings: CalibrationSettings, report: Progress) -> Iterator[CurvePoints]:
    """Choose the increments, press the body with every mu, and yield the points after each."""
    start = time.perf_counter()
    mus = settings.mus
    three = np.array(mus)[[0, len(mus) // 2, -1]]
    report.stage("increments")
    increments = choose_increments(problem, lambda p: read(p, settings.names, three) / settings.noise)
    if increments.chosen:
        report.say(str(increments))
    problem = under(problem, legs=increments.legs)
    if problem.model.finite_strain:
        formulation = dict(problem.model.filled).get("hyperelastic_law", "this body")
        report.say(
            f"{formulation}: its compliance changes during the press, so that every one of {len(mus)} mu is a full "
            "press, and so is every tolerance"
        )
    report.stage("pressing")
    curve = CurvePoints(problem, mus, increments, (), {})
    for found in presses(problem, mus):
        seconds = {"presses": time.perf_counter() - start}
        known = sorted((*curve.presses, found), key=lambda press: press.mu)
        curve = replace(curve, presses=tuple(known), seconds=seconds)
        report.step(len(curve.presses), len(mus), f"mu = {found.mu:.4g}: {curve.failed.get(found.mu, 'converged')}")
        yield curve


def _calibration(curve: CurvePoints, settings: CalibrationSettings, report: Progress) -> Calibration:
    """Return the calibration of all readings with the effect of every tolerance; too few points are an error."""
    start = time.perf_counter()
    curves = tuple(
        ReadingCurve(reading.name, curve.mu, curve.reading(reading.name), reading.noise, kind=reading.kind)
        for reading in settings.readings
    )
    bare = Calibration(curves, settings.limit, tuple(sorted(curve.failed.items())))
    found: dict[str, list[Tolerance]] = {name: [] for name in settings.names}
    for name, tolerance in evaluate_tolerances(curve, settings, report) if settings.tolerances else ():
        found[name].append(tolerance)
    seconds = {**curve.seconds, "tolerances": time.perf_counter() - start}
    return replace(
        bare,
        readings=tuple(replace(one, tolerances=tuple(found[one.name])) for one in curves),
        about={"seconds": seconds},
    )


def _about(scene: Scene, curve: CurvePoints) -> dict[str, object]:
    problem = curve.problem
    return {
        "domain": problem.model.domain,
        "effects": list(scene.effects),
        "dofs": int(problem.body.stiffness.upper.shape[0]),
        "contact_points": len(problem.surface.nodes),
        "mesh_hash": problem.body.report.hash,
        "factorizations": curve.factorizations,
        "versions": versions(),
        "increments": curve.increments.as_dict(),
    }
