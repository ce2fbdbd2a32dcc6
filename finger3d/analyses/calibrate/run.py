"""Calibration of one gauge of a scene: one condensation, a press for every mu, and what the tolerances do."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._machine import versions
from finger3d._ranges import LARGEST_STRAIN, number
from finger3d.analyses.calibrate.increments import Increments, found_increments
from finger3d.analyses.calibrate.presses import Press, presses
from finger3d.analyses.calibrate.tolerances import ReferenceReadings, chosen, moved_gauges, read, slopes
from finger3d.analyses.reduced import ReducedModel
from finger3d.errors import Finger3dError
from finger3d.io import atomic, claimed, write_csv
from finger3d.mechanics.build import MARGIN, build
from finger3d.mechanics.coverage import contact_within_candidates
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem
from finger3d.progress import Progress
from finger3d.report.calibrate import calibrate_page
from finger3d.sensor.curve import FEWEST, NOISE, RESOLUTION, Calibration, Tolerance
from finger3d.sensor.files import save, write_table

if TYPE_CHECKING:
    from finger3d.scene import Scene

_LARGEST_MU = 1e6

Float = NDArray[np.float64]

MUS = tuple(float(mu) for mu in np.linspace(0.02, 1.2, 25).round(10))
"""Values of mu that are pressed unless others are given."""

_FILES = ("calibration.json", "calibration.csv", "calibration.png", "reduced.npz", "map.png", "map.csv", "report.html")

_SLOPES = {True: 7, False: 3}  # values of mu at which tolerances are tried: in small strain, and beyond


@dataclass
class CurvePoints:
    """The presses of one calibration as they come: last frame by mu, or why there is none; a few with their paths.

    `increments` is known once there is a press.
    """

    mus: tuple[float, ...]
    frames: dict[float, StepResult] = field(default_factory=dict)
    failed: dict[float, str] = field(default_factory=dict)
    few: dict[float, Press] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    increments: Increments | None = None

    def strains(self, name: str) -> tuple[Float, Float]:
        """mu (n,) that converged and strain (n,) of a gauge."""
        good = [mu for mu in self.mus if mu in self.frames]
        return np.array(good), np.array([self.frames[mu].gauges[name] for mu in good])


def calibrate(
    scene: Scene | str | Path,
    gauge: str,
    out: str | Path | None = None,
    mus: Sequence[float] = MUS,
    noise: float = NOISE,
    limit: float = RESOLUTION,
    tolerances: Mapping[str, float] | None = None,
    report: Progress | None = None,
    maps: bool = False,
) -> Calibration:
    """Calibrate a gauge: its strain at the end of the scene's path, for every mu.

    Parameters
    ----------
    scene : a loaded scene, or the path of a TOML file; its own friction.mu does not matter
    gauge : name of a [[gauge]]
    out : folder for calibration.json, .csv, .png, reduced.npz (and map.png, map.csv); None writes nothing
    mus : coefficients of friction, from 0 up
    noise, limit : standard deviation of a strain reading; resolution of mu beyond which the gauge is called blind
    tolerances : standard deviations by name, over the defaults of `finger3d.analyses.calibrate.tolerances.TOLERANCES`;
        0 leaves one out
    report : told about every mu
    maps : also map over the section how far strains follow mu

    Raises
    ------
    Finger3dError
        For an unknown gauge, a scene without one, or numbers out of range.
    MissingError
        If fewer than four values of mu converge; the others are in calibration.csv.
    """
    from finger3d.scene import load

    report = report or Progress()
    scene = load(scene) if isinstance(scene, str | Path) else scene
    model = scene.model()
    known = found_gauge(model, gauge)
    asked = _checked(mus, noise, limit)
    wanted = chosen(tolerances)
    if maps:
        from finger3d.sensor.maps import check

        check(model)
    settings = (known, asked, wanted, noise, limit, report, maps)
    if out is None:
        return _whole(scene, model, None, *settings)
    with claimed(out, "calibrate") as folder:
        return _whole(scene, model, folder, *settings)


def _whole(
    scene: Scene, model: Model, folder: Path | None, gauge: Gauge, mus: tuple[float, ...],
    wanted: Mapping[str, float], noise: float, limit: float, report: Progress, maps: bool,
) -> Calibration:  # fmt: skip
    """Calibrate and write what is found; an interruption leaves the curve so far in calibration.csv."""
    text = scene.to_toml()
    if folder:
        for name in _FILES:
            (folder / name).unlink(missing_ok=True)
        with atomic(folder / "scene.toml") as path:
            path.write_text(text, encoding="utf-8")
    sweep, start = CurvePoints(mus), time.perf_counter()
    try:
        problem = _condensed(model, gauge, wanted, sweep, noise, report)
        calibration = _calibrated(problem, gauge, wanted, sweep, noise, limit, report)
    except (KeyboardInterrupt, Finger3dError):
        if folder and (sweep.frames or sweep.failed):
            _keep(folder, sweep, gauge.name)
        raise
    sweep.seconds["total"] = time.perf_counter() - start
    about = {
        "domain": model.domain, "effects": list(scene.effects), "dofs": int(problem.part.stiffness.upper.shape[0]),
        "contact_points": len(problem.surface.nodes), "mesh_hash": problem.part.report.hash, "seconds": sweep.seconds,
        "factorizations": problem.factorizations, "versions": versions(),
        "increments": sweep.increments.as_dict() if sweep.increments else {},
    }  # fmt: skip
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    calibration = replace(calibration, scene=scene.as_dict(), hash=digest, about=about)
    if folder:
        _write(folder, calibration, problem, model, gauge, sweep, report, maps)
    return calibration


def calibrated(
    model: Model,
    gauge: str,
    mus: Sequence[float] = MUS,
    noise: float = NOISE,
    limit: float = RESOLUTION,
    tolerances: Mapping[str, float] | None = None,
    report: Progress | None = None,
) -> tuple[Calibration, Problem, CurvePoints]:
    """The same for a model made in Python; writes nothing. Returns also the condensed body and the last frames."""
    report, known, sweep = report or Progress(), found_gauge(model, gauge), CurvePoints(_checked(mus, noise, limit))
    wanted = chosen(tolerances)
    problem = _condensed(model, known, wanted, sweep, noise, report)
    return _calibrated(problem, known, wanted, sweep, noise, limit, report), problem, sweep


def found_gauge(model: Model, name: str) -> Gauge:
    """The gauge of this name, or a refusal that names the nearest."""
    names = [g.name for g in model.gauges]
    if not names:
        raise Finger3dError(f'--gauge {name}: the scene has no [[gauge]]; add one with name = "{name}", x_mm and y_mm')
    if name not in names:
        near = get_close_matches(name, names, n=1, cutoff=0.0)[0]
        raise Finger3dError(f'--gauge {name}: no such gauge; did you mean "{near}"? the scene has {", ".join(names)}')
    return model.gauges[names.index(name)]


def _checked(mus: Sequence[float], noise: float, limit: float) -> tuple[float, ...]:
    for mu in mus:
        if not 0.0 <= mu <= _LARGEST_MU:
            raise Finger3dError(f"--mu: {mu:g}: must be finite numbers from 0 up to 1e6, for instance 0.02:1.2:25")
    found = tuple(sorted({float(mu) for mu in mus}))
    if len(found) < FEWEST:
        raise Finger3dError(
            f"--mu: {len(found)} different value{'s' if len(found) != 1 else ''}; a calibration needs at least "
            f"{FEWEST}, for instance 0.02:1.2:25"
        )
    for name, value, low, high in (("--noise", noise, 1e-12, LARGEST_STRAIN), ("--resolution", limit, 1e-12, 1e6)):
        if not low <= value <= high:
            raise Finger3dError(f"{name} {value:g}: must be a finite number from {number(low)} to {number(high)}")
    return found


def _condensed(
    model: Model, gauge: Gauge, wanted: Mapping[str, float], sweep: CurvePoints, noise: float, report: Progress
) -> Problem:
    """Build, press every mu, and once more with the whole contact face where contact went beyond the candidates."""
    extra = () if model.inclusions else tuple(m.gauge for m in moved_gauges(model, gauge, wanted))
    model = replace(model, gauges=(*model.gauges, *extra))
    three = np.array(sweep.mus)[[0, len(sweep.mus) // 2, -1]]
    for margin in (MARGIN, math.inf):
        start = time.perf_counter()
        report.stage("condensing")
        problem = build(model, report.say, margin)
        sweep.seconds["build"] = time.perf_counter() - start
        start = time.perf_counter()
        report.stage("increments")
        sweep.increments = found_increments(problem, lambda p: read(p, (gauge.name,), three)[0], noise)
        if sweep.increments.chosen:
            report.say(str(sweep.increments))
        problem = replace(problem, model=replace(problem.model, legs=sweep.increments.legs))
        _press(problem, sweep, report)
        sweep.seconds["presses"] = time.perf_counter() - start
        if all(contact_within_candidates(problem, list(sweep.frames.values()))):
            break
        report.say("contact reached beyond the candidate points; once more with all of the contact face")
    return problem


def _press(problem: Problem, sweep: CurvePoints, report: Progress) -> None:
    if problem.model.formulation.finite_strain:
        name = dict(problem.model.filled).get("formulation", "this body")
        report.say(f"{name}: its compliance changes on the way, so that every one of {len(sweep.mus)} mu is a full "
                   "march, and so is every tolerance")  # fmt: skip
    report.stage("pressing")
    for kept in (sweep.frames, sweep.failed, sweep.few):
        kept.clear()
    few = {sweep.mus[i] for i in _few(problem, len(sweep.mus))}
    for done, found in enumerate(presses(problem, sweep.mus), start=1):
        mu, frame = found.mu, found.frame
        if frame.outcome.ok:
            sweep.frames[mu] = frame
            if mu in few:
                sweep.few[mu] = found
        else:
            sweep.failed[mu] = f"at depth {frame.target.depth_mm:.4g} mm: {frame.outcome}"
        report.step(done, len(sweep.mus), f"mu = {mu:.4g}: {sweep.failed.get(mu, 'converged')}")


def _few(problem: Problem, count: int) -> NDArray[np.int64]:
    """Numbers, among `count` values of mu, of those at which tolerances are tried."""
    wanted = _SLOPES[not problem.model.formulation.finite_strain]
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(int))


def _calibrated(
    problem: Problem, gauge: Gauge, wanted: Mapping[str, float], sweep: CurvePoints, noise: float, limit: float,
    report: Progress,
) -> Calibration:  # fmt: skip
    start = time.perf_counter()
    mu, strain = sweep.strains(gauge.name)
    failed = tuple(sorted(sweep.failed.items()))
    bare = Calibration(gauge.name, mu, strain, noise, limit, (), failed)  # refuses too few points
    found: tuple[Tolerance, ...] = ()
    if wanted and sweep.increments:
        strains = {g.name: sweep.strains(g.name)[1] for g in problem.model.gauges}
        base = ReferenceReadings(mu, strains, _few(problem, len(mu)), sweep.frames[float(mu[-1])], sweep.few)
        found = tuple(slopes(problem, gauge, wanted, base, sweep.increments, report.stage))
    sweep.seconds["tolerances"] = time.perf_counter() - start
    return replace(bare, tolerances=found)


def _keep(folder: Path, sweep: CurvePoints, gauge: str) -> None:
    """What there is of a curve that was not finished."""
    done = sorted([*sweep.frames, *sweep.failed])
    strain = [sweep.frames[mu].gauges[gauge] if mu in sweep.frames else math.nan for mu in done]
    outcome = [sweep.failed.get(mu, "converged") for mu in done]
    write_csv(folder / "calibration.csv", {"mu": done, "strain": strain, "outcome": outcome})


def _write(
    folder: Path,
    calibration: Calibration,
    problem: Problem,
    model: Model,
    gauge: Gauge,
    sweep: CurvePoints,
    report: Progress,
    maps: bool,
) -> None:
    from finger3d.plotting.calibration import draw

    report.stage("writing")
    write_table(calibration, folder / "calibration.csv")
    own = replace(
        problem,
        model=replace(problem.model, gauges=model.gauges),
        system=replace(problem.system, gauge_rows=problem.system.gauge_rows[: len(model.gauges)]),
    )
    if model.formulation.is_linear_elastic:
        ReducedModel.of(own).save(folder / "reduced.npz")
    else:
        report.say("no reduced.npz: the body's answer changes on the way")
    if maps:
        from finger3d.plotting.strain_map import draw_map
        from finger3d.sensor.maps import StrainMap

        found = StrainMap.of(problem, sweep.frames, z_mm=gauge.z_mm)
        found.write(folder / "map.csv", gauge.angle, calibration.noise)
        draw_map(folder / "map.png", found, gauge, calibration)
    save(calibration, folder / "calibration.json")
    draw(folder / "calibration.png", calibration)
    calibrate_page(folder)


def parsed_mus(text: str) -> tuple[float, ...]:
    """Values of mu from ``first:last:count`` or a list with commas."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            return tuple(float(mu) for mu in np.linspace(float(first), float(last), _count(count)).round(10))
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise Finger3dError(
            f"--mu {text}: must be first:last:count, for instance 0.02:1.2:25, or numbers with commas"
        ) from None


def _count(text: str) -> int:
    count = int(text)
    if not 1 <= count <= 10_000:
        raise ValueError(text)
    return count
