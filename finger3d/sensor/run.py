"""Calibration of one gauge of a scene: one condensation, a press for every mu, and what the tolerances do."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finger3d.drawing import Artist
from finger3d.errors import Finger3dError
from finger3d.export import atomic, claimed, write_csv
from finger3d.history import Frame
from finger3d.increments import automatic, refine, with_steps
from finger3d.kinematics import SmallStrain
from finger3d.model import Gauge, Model
from finger3d.page import calibrate_page
from finger3d.problem import Problem
from finger3d.reduced import Condensed, friction_at
from finger3d.report import Report
from finger3d.sensor.curve import FEWEST, NOISE, RESOLUTION, Calibration, Range, Tolerance
from finger3d.sensor.files import save, write_table
from finger3d.sensor.presses import Press, presses
from finger3d.sensor.tolerances import Pressed, chosen, moved_gauges, slopes
from finger3d.solve import MARGIN, build, covered
from finger3d.versions import versions

if TYPE_CHECKING:
    from finger3d.scene import Scene

Float = NDArray[np.float64]

MUS = tuple(float(mu) for mu in np.linspace(0.02, 1.2, 25).round(10))
"""Values of mu that are pressed unless others are given."""

_FILES = ("calibration.json", "calibration.csv", "calibration.png", "reduced.npz", "map.png", "map.csv", "report.html")
_SLOPES = {True: 7, False: 3}  # values of mu at which tolerances are tried: in small strain, and beyond


@dataclass
class Sweep:
    """The presses of one calibration as they come: last frame by mu, or why there is none; a few with their paths."""

    mus: tuple[float, ...]
    frames: dict[float, Frame] = field(default_factory=dict)
    failed: dict[float, str] = field(default_factory=dict)
    few: dict[float, Press] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

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
    report: Report | None = None,
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
    tolerances : standard deviations by name, over the defaults of `finger3d.sensor.TOLERANCES`; 0 leaves one out
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

    report = report or Report()
    scene = load(scene) if isinstance(scene, str | Path) else scene
    model = scene.model()
    known = found_gauge(model, gauge)
    asked = _checked(mus, noise, limit)
    wanted = chosen(tolerances)
    if maps:
        from finger3d.sensor.maps import check

        check(model)
    settings = (known, asked, wanted, noise, limit, report, maps)
    with Artist(out is not None, "finger3d.sensor.picture") as artist:
        if out is None:
            return _whole(scene, model, None, artist, *settings)
        with claimed(out, "calibrate") as folder:
            return _whole(scene, model, folder, artist, *settings)


def _whole(
    scene: Scene, model: Model, folder: Path | None, artist: Artist, gauge: Gauge, mus: tuple[float, ...],
    wanted: Mapping[str, float], noise: float, limit: float, report: Report, maps: bool,
) -> Calibration:  # fmt: skip
    """Calibrate and write what is found; an interruption leaves the curve so far in calibration.csv."""
    text = scene.to_toml()
    if folder:
        for name in _FILES:
            (folder / name).unlink(missing_ok=True)
        with atomic(folder / "scene.toml") as path:
            path.write_text(text, encoding="utf-8")
    sweep, start = Sweep(mus), time.perf_counter()
    try:
        problem = _condensed(model, gauge, wanted, sweep, report)
        calibration = _calibrated(problem, gauge, wanted, sweep, noise, limit, report)
    except (KeyboardInterrupt, Finger3dError):
        if folder and (sweep.frames or sweep.failed):
            _keep(folder, sweep, gauge.name)
        raise
    sweep.seconds["total"] = time.perf_counter() - start
    about = {
        "domain": model.domain, "effects": list(scene.effects), "dofs": int(problem.stiffness.upper.shape[0]),
        "contact_points": len(problem.surface.nodes), "mesh_hash": problem.report.hash, "seconds": sweep.seconds,
        "factorizations": problem.factorizations, "versions": versions(),
    }  # fmt: skip
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    calibration = replace(calibration, scene=scene.as_dict(), hash=digest, about=about)
    if folder:
        _write(folder, artist, calibration, problem, model, gauge, sweep, report, maps)
    return calibration


def calibrated(
    model: Model,
    gauge: str,
    mus: Sequence[float] = MUS,
    noise: float = NOISE,
    limit: float = RESOLUTION,
    tolerances: Mapping[str, float] | None = None,
    report: Report | None = None,
) -> tuple[Calibration, Problem, Sweep]:
    """The same for a model made in Python; writes nothing. Returns also the condensed body and the last frames."""
    report, known, sweep = report or Report(), found_gauge(model, gauge), Sweep(_checked(mus, noise, limit))
    wanted = chosen(tolerances)
    problem = _condensed(model, known, wanted, sweep, report)
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
        if not (math.isfinite(mu) and mu >= 0.0):
            raise Finger3dError(f"--mu: {mu:g}: must be finite numbers from 0 up, for instance 0.02:1.2:25")
    found = tuple(sorted({float(mu) for mu in mus}))
    if len(found) < FEWEST:
        raise Finger3dError(
            f"--mu: {len(found)} different value{'s' if len(found) != 1 else ''}; a calibration needs at least "
            f"{FEWEST}, for instance 0.02:1.2:25"
        )
    for name, value in (("--noise", noise), ("--resolution", limit)):
        if not (math.isfinite(value) and value > 0.0):
            raise Finger3dError(f"{name} {value:g}: must be a finite number above 0")
    return found


def _condensed(model: Model, gauge: Gauge, wanted: Mapping[str, float], sweep: Sweep, report: Report) -> Problem:
    """Build, press every mu, and once more with the whole contact face where contact went beyond the candidates."""
    extra = () if model.inclusions else tuple(m.gauge for m in moved_gauges(model, gauge, wanted))
    model = replace(model, gauges=(*model.gauges, *extra))
    for margin in (MARGIN, math.inf):
        start = time.perf_counter()
        report.stage("condensing")
        problem = build(model, report.say, margin)
        sweep.seconds["build"] = time.perf_counter() - start
        start = time.perf_counter()
        if automatic(model):
            report.stage("increments by step halving")
            middle = friction_at(model.friction, sweep.mus[len(sweep.mus) // 2])
            *_, (frames, estimate) = refine(replace(problem, model=replace(model, friction=middle)))
            problem = with_steps(problem, estimate.steps if estimate else len(frames))
        _press(problem, sweep, report)
        sweep.seconds["presses"] = time.perf_counter() - start
        if all(covered(problem, list(sweep.frames.values()))):
            break
        report.say("contact reached beyond the candidate points; once more with all of the contact face")
    return problem


def _press(problem: Problem, sweep: Sweep, report: Report) -> None:
    if not isinstance(problem.model.kinematics, SmallStrain):
        name = dict(problem.model.filled).get("kinematics", "this body")
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
    wanted = _SLOPES[isinstance(problem.model.kinematics, SmallStrain)]
    return np.unique(np.linspace(0, count - 1, wanted).round().astype(int))


def _calibrated(
    problem: Problem, gauge: Gauge, wanted: Mapping[str, float], sweep: Sweep, noise: float, limit: float,
    report: Report,
) -> Calibration:  # fmt: skip
    start = time.perf_counter()
    mu, strain = sweep.strains(gauge.name)
    failed = tuple(sorted(sweep.failed.items()))
    bare = Calibration(gauge.name, mu, strain, noise, limit, (), failed)  # refuses too few points
    found: tuple[Tolerance, ...] = ()
    if wanted:
        strains = {g.name: sweep.strains(g.name)[1] for g in problem.model.gauges}
        base = Pressed(mu, strains, _few(problem, len(mu)), sweep.frames[float(mu[-1])], sweep.few)
        found = tuple(slopes(problem, gauge, wanted, base, report.stage))
    sweep.seconds["tolerances"] = time.perf_counter() - start
    return replace(bare, tolerances=found)


def _keep(folder: Path, sweep: Sweep, gauge: str) -> None:
    """What there is of a curve that was not finished."""
    done = sorted([*sweep.frames, *sweep.failed])
    strain = [sweep.frames[mu].gauges[gauge] if mu in sweep.frames else math.nan for mu in done]
    outcome = [sweep.failed.get(mu, "converged") for mu in done]
    write_csv(folder / "calibration.csv", {"mu": done, "strain": strain, "outcome": outcome})


def _write(
    folder: Path, artist: Artist, calibration: Calibration, problem: Problem, model: Model, gauge: Gauge, sweep: Sweep,
    report: Report, maps: bool,
) -> None:  # fmt: skip
    from finger3d.sensor.picture import draw

    report.stage("writing")
    artist.draw(draw, folder / "calibration.png", calibration)
    artist.begin()
    write_table(calibration, folder / "calibration.csv")
    own = replace(
        problem, model=replace(problem.model, gauges=model.gauges), gauge_rows=problem.gauge_rows[: len(model.gauges)]
    )
    if type(model.kinematics) is SmallStrain:
        Condensed.of(own).save(folder / "reduced.npz")
    else:
        report.say("no reduced.npz: the body's answer changes on the way")
    if maps:
        from finger3d.sensor.maps import StrainMap, draw_map

        found = StrainMap.of(problem, sweep.frames, z_mm=gauge.z_mm)
        found.write(folder / "map.csv", gauge.angle, calibration.noise)
        draw_map(folder / "map.png", found, gauge, calibration)
    save(calibration, folder / "calibration.json")
    artist.finish()
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


def _ranges(stretches: Sequence[Range]) -> str:
    return ", ".join(f"mu = {r.low:.3g} to {r.high:.3g}" for r in stretches) or "nowhere"


def summary(calibration: Calibration) -> list[tuple[str, Any]]:
    """The closing table of a calibration."""
    c = calibration
    at = float(c.mu[np.argmin(np.abs(c.mu - 0.5))]) if c.mu[0] <= 0.5 <= c.mu[-1] else float(c.mu[len(c.mu) // 2])
    shares = sorted(c.shares(at).items(), key=lambda item: -item[1])
    sd = float(c.mu_sd([at])[0])
    rows = [
        ("strain", f"{c.strain[0]:.4g} at mu = {c.mu[0]:g} to {c.strain[-1]:.4g} at mu = {c.mu[-1]:g}"),
        (
            f"mu within {c.limit:g}",
            f"{_ranges(c.trusted)}, with all tolerances; {_ranges(c.usable)} from strain noise alone",
        ),
        (f"resolution at mu = {at:.3g}", f"{float(c.resolution(at)):.2g} from a strain noise of {c.noise:g}"),
        ("second-order fit", f"residual {c.fit.rms:.2g} rms, {c.fit.largest:.2g} at most"),
        (f"mu +- at mu = {at:.3g}", f"{sd:.2g} with all tolerances; shares of the variance below"),
        *((f"  {name}", f"{100.0 * share:.1f} %") for name, share in shares),
    ]
    if c.failed:
        rows.append(("failed", ", ".join(f"mu = {mu:.4g}" for mu, _ in c.failed)))
    return rows
