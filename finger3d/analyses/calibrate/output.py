"""Files of a calibration in its folder."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._types import Tree
from finger3d.analyses.calibrate.curve_points import CurvePoints
from finger3d.analyses.reduced import ReducedModel
from finger3d.io import write_csv, write_text
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Model
from finger3d.plotting.calibration import draw
from finger3d.progress import Progress
from finger3d.report.calibrate import calibrate_page
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.files import save, write_table

if TYPE_CHECKING:
    from finger3d.analyses.calibrate.settings import CalibrationSettings
    from finger3d.scene import Scene


def write_scene(folder: Path, scene: Scene) -> None:
    """Write scene.toml."""
    write_text(folder / "scene.toml", scene.to_toml())


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


def write_curve(folder: Path, calibration: Calibration) -> None:
    """Write the curve, its figure and its page."""
    write_table(calibration, folder / "calibration.csv")
    save(calibration, folder / "calibration.json")
    draw(folder / "calibration.png", calibration)
    calibrate_page(folder).write(folder)
