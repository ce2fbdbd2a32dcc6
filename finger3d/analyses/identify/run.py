"""Identification: the values of free keys with which a scene reproduces a measured press."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import interp1d
from scipy.linalg import block_diag, solve_triangular

from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.effects_by_need import settled_tables
from finger3d.analyses.free_keys import Bounds, FreeKey, check_distinct, free_keys
from finger3d.analyses.identify.fit import Scale, fit, jacobian, misfit_text, values_at
from finger3d.analyses.identify.measured import SHARPEST, MeasuredPress, read_measured
from finger3d.analyses.identify.posterior import FittedValues, Mixture, along_friction, fitted_values, normal
from finger3d.analyses.identify.simulated import (
    MODULI,
    OFFSET,
    Curve,
    Simulation,
    check_rows,
    fitted_scene,
    has_zones,
    largest,
    moving_part,
    names_of,
)
from finger3d.errors import Finger3dError
from finger3d.io import atomic, claimed, write_csv, write_json
from finger3d.plotting.identify import Panel, draw
from finger3d.progress import Progress
from finger3d.report.identify import identify_page
from finger3d.results.journal import opened
from finger3d.scene import Scene, Source, files, parse, tables_of, tree

DEVIATIONS = "of the noise of the data, and of the errors of mesh and increments"
"""What the standard deviations of an identification contain."""

_BAR = 1.645
"""Error bar over the standard deviation of the error: nine of ten errors are within a bar."""

_SHARE = 0.02  # standard deviation in the first fit of a column without one, over its largest magnitude
_LEAST_SHARE = 1e-4  # lower bound of the same when it is taken from the residuals
_TRIED_MODULI = 41  # values of Young's modulus that are tried at the start
_FRICTION = 0.2, 0.45, 0.7  # shares tried at the start: a fit does not leave values at which all of the contact sticks
_FITS, _AS_LIKELY = 3, 0.8  # most fits; likelihood, over the largest one, of values from which no other fit is tried
_FROM_BOUND = 0.05  # of the first shares: the method is slow near a bound


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes
    ----------
    scene : with the values that were found
    keys : the free keys (k)
    fitted : their values, standard deviations and correlation
    measured : the data
    simulated : values by column at the measured rows
    stds : standard deviations by column (n,): those of the file, or those that the residuals have
    curve : the simulated press
    reduced_chi_square : of the columns with standard deviations of their own; NaN without any
    notes : remarks on values that the data do not determine, and on a poor fit
    presses : number of presses that were solved
    """

    scene: Scene
    keys: tuple[str, ...]
    fitted: FittedValues
    measured: MeasuredPress
    simulated: Mapping[str, Float]
    stds: Mapping[str, Float]
    curve: Curve
    reduced_chi_square: float
    notes: tuple[str, ...]
    presses: int

    def as_dict(self) -> Tree:
        """Return the content of identify.json."""
        fitted = self.fitted
        return {
            "scene": self.scene.as_dict(),
            "measured": str(self.measured.path),
            "index": self.measured.index,
            "values": {
                key: {
                    "value": float(fitted.values[i]),
                    "std": float(fitted.stds[i]),
                    "std_numerical": float(fitted.numerical[i]),
                    "low": float(fitted.low[i]),
                    "high": float(fitted.high[i]),
                }
                for i, key in enumerate(self.keys)
            },
            "correlation": {
                key: dict(zip(self.keys, map(float, fitted.correlation[i]), strict=True))
                for i, key in enumerate(self.keys)
            },
            "reduced_chi_square": self.reduced_chi_square,
            "residual_rms": {
                name: float(np.sqrt(np.mean((values - self.simulated[name]) ** 2)))
                for name, values in self.measured.columns.items()
            },
            "std_of_columns": {
                name: {"from": "file" if name in self.measured.stds else "residuals", "rms": _rms(std)}
                for name, std in self.stds.items()
            },
            "deviations": DEVIATIONS,
            "notes": list(self.notes),
            "presses": self.presses,
        }


def identify(
    scene: Source,
    measured: str | Path,
    free: Bounds,
    out: str | Path,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> Identification:
    """Find the values of free keys with which a scene reproduces a measured press, by weighted least squares.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    measured : CSV file with columns named as in history.csv, and optionally their standard deviations, ``..._std``
    free : key -> lower and upper bound, for instance ``{"material.E_MPa": (0.05, 5.0)}``, or texts such as
        ``"material.E_MPa=0.05:5"``; ``depth_offset_mm`` is added to the measured depths
    out : folder for presses.jsonl (every press once it is solved), identify.json, identify.csv, identified.toml,
        identify.png and report.html; the same identification is continued there
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : receives the progress at every iteration

    Returns
    -------
    Identification
        With the values, their standard deviations and correlation, and notes on values that the data do not determine.

    Raises
    ------
    Finger3dError
        For a mistake in the file or in the free keys, or if the press fails at the start.
    """
    report = report or Progress()
    given, path = tables_of(scene, overrides)
    given = settled_tables(given, path, report)
    keys = free_keys(free)
    start = _checked_start(given, keys, path)
    model = parse(given, path).model()
    data = read_measured(Path(measured), names_of(model))
    if OFFSET in (f.key for f in keys) and data.index != "depth_mm":
        raise Finger3dError(f"--free {OFFSET}: the rows of {data.path} are ordered by {data.index}, not by depth_mm")
    if data.count <= len(keys):
        raise Finger3dError(f"{data.path}: {data.count} measured values for {len(keys)} free keys; give more rows")
    for values in (start, [f.low for f in keys], [f.high for f in keys]):
        check_rows(fitted_scene(given, keys, values, path).model().legs, keys, data)
    task = {
        "scene": tree.plain(given),
        "files": files.contents(given, path),
        "free": [[f.key, f.low, f.high] for f in keys],
        "measured": hashlib.sha256(data.path.read_bytes()).hexdigest()[:16],
    }
    with (
        claimed(out, "identify") as folder,
        opened(folder / "presses.jsonl", folder / "task.json", task) as journal,
    ):
        simulation = Simulation(given, path, keys, journal, has_zones(data.columns), data)
        found = _fitted(simulation, data, start, report)
        _write(folder, found)
        return found


def _checked_start(given: TreeView, free: Sequence[FreeKey], path: Path | None) -> Float:
    """Return the values of the scene (k,), or the middle of the bounds where they lie outside."""
    if not free:
        raise Finger3dError("identify: nothing is free; give at least one --free, such as material.E_MPa=0.05:5")
    check_distinct([f.numbered(given) for f in free])
    values = [0.0 if f.key == OFFSET and f.low <= 0.0 <= f.high else f.start(given) for f in free]
    fitted_scene(given, free, values, path)
    return np.array(values)


@dataclass(frozen=True)
class _Misfit:
    """Residuals of a simulation over their standard deviations, as functions of the values or shares (k).

    Attributes
    ----------
    stds : (n,) standard deviations by column
    root : Cholesky factor of the covariance of all residuals, each over its standard deviation
    """

    simulation: Simulation
    data: MeasuredPress
    report: Progress
    stds: Mapping[str, Float]
    root: Float

    @classmethod
    def of(cls, simulation: Simulation, data: MeasuredPress, report: Progress) -> _Misfit:
        """Return the misfit by the noise alone; that of columns without standard deviations is a share of them."""
        stds = {
            n: data.stds.get(n, np.full(len(data.at), max(_SHARE * float(np.abs(v).max()), SHARPEST)))
            for n, v in data.columns.items()
        }
        return cls(simulation, data, report, stds, np.eye(data.count))

    @cached_property
    def scales(self) -> list[Scale]:
        return [Scale.of(f) for f in self.simulation.free]

    def of_curve(self, simulated: Mapping[str, Float]) -> Float:
        """Return the residuals of simulated columns."""
        plain = [(simulated[n] - v) / self.stds[n] for n, v in self.data.columns.items()]
        return np.asarray(solve_triangular(self.root, np.concatenate(plain), lower=True))

    def residuals(self, values: Float) -> Float:
        return self.of_curve(self.simulation.at(values, self.data))

    def jacobian(self, shares: Float, wanted: Sequence[int] | None = None) -> Float:
        """Return the derivatives by shares, by some of them if these are given."""
        return jacobian(self.scales, shares, self.residuals, wanted)

    @cached_property
    def without_press(self) -> list[int]:
        """Numbers of the shares whose change needs no press."""
        scales = self.simulation.scales_with_modulus
        return [i for i, f in enumerate(self.simulation.free) if f.key == OFFSET or (f.key in MODULI and scales)]

    def fit(self, shares: Float) -> Float:
        """Return the shares with the least sum of squares, from those given."""

        def announce(values: Float) -> None:
            named = ", ".join(f"{f.key} = {v:.5g}" for f, v in zip(self.simulation.free, values, strict=True))
            self.report.stage(f"fitting, {self.simulation.solved} presses: {named}")

        return fit(self.scales, shares, self.residuals, announce, self.without_press)

    def by_residuals(self, shares: Float) -> _Misfit:
        """Return the misfit with columns weighted by their residuals that have no standard deviations in the file."""
        simulated = self.simulation.at(values_at(self.scales, shares), self.data)
        return replace(self, stds={**self.stds, **_by_residuals(self.data, simulated, len(shares))})


def _fitted(simulation: Simulation, data: MeasuredPress, start: Float, report: Progress) -> Identification:
    """Fit by the noise, then by the noise and the errors of the simulation, and follow the likelihood of friction."""
    report.stage("first presses")
    misfit = _Misfit.of(simulation, data, report)
    shares = misfit.fit(_first(misfit, start))
    if set(data.stds) != set(data.columns):
        misfit = misfit.by_residuals(shares)
        shares = misfit.fit(shares)
        misfit = misfit.by_residuals(shares)
    report.stage("errors of mesh and increments")
    scales = misfit.scales
    known = simulation.errors(values_at(scales, shares), data)
    zero = np.zeros((1, len(data.at)))
    # a row of zeros for all columns but the one that the error is of
    plain = block_diag(*(known.get(name, zero) / (_BAR * misfit.stds[name]) for name in data.columns))
    misfit = replace(misfit, root=np.linalg.cholesky(np.eye(data.count) + plain.T @ plain))
    errors = solve_triangular(misfit.root, plain.T, lower=True)
    shares, mixture, derivative = _likelihood(misfit, shares)
    friction = _friction(simulation.free)
    fitted = fitted_values(scales, shares, derivative, errors @ errors.T, mixture, friction)
    values = values_at(scales, shares)
    simulated = simulation.at(values, data)
    reduced = _reduced_chi_square(data, simulated, len(scales))
    unknown = sorted(set(data.columns) - set(known))
    missing = [f"the error of the mesh is not known: {', '.join(unknown)}"] if unknown else []
    notes = [*fitted.untold, *missing, *([text] if reduced == reduced and (text := misfit_text(reduced)) else [])]
    return Identification(
        scene=simulation.scene(values),
        keys=tuple(f.key for f in simulation.free),
        fitted=fitted,
        measured=data,
        simulated=simulated,
        stds=misfit.stds,
        curve=simulation.curve(values),
        reduced_chi_square=reduced,
        notes=tuple(notes),
        presses=simulation.solved,
    )


def _first(misfit: _Misfit, start: Float) -> Float:
    """Return the shares to fit from: those of `start`, or with another friction or modulus if these promise more."""
    simulation, data, scales = misfit.simulation, misfit.data, misfit.scales
    given = np.array([scale.share(v) for scale, v in zip(scales, start, strict=True)])
    begin = np.clip(given, _FROM_BOUND, 1.0 - _FROM_BOUND)
    friction, starts = _friction(simulation.free), [begin]
    if friction is not None:
        starts += [np.where(np.arange(len(begin)) == friction, share, begin) for share in _FRICTION]
    tried = [_with_modulus(simulation, shares) for shares in starts]
    curves = [[simulation.at(values_at(scales, shares), data) for shares in trials] for trials in tried]
    _check_columns(simulation, scales, [curve for some in curves for curve in some], data)
    least = [int(np.argmin([np.sum(misfit.of_curve(curve) ** 2) for curve in some])) for some in curves]
    best = [trials[number] for trials, number in zip(tried, least, strict=True)]
    return min(best, key=lambda shares: float(np.sum(misfit.residuals(values_at(scales, shares)) ** 2)))


def _friction(free: Sequence[FreeKey]) -> int | None:
    """Return the number of the first key of friction."""
    return next((i for i, f in enumerate(free) if f.key.startswith("friction.")), None)


def _likelihood(misfit: _Misfit, start: Float) -> tuple[Float, Mixture, Float]:
    """Return the most likely shares (k,), the likelihood about them, and the derivatives (n, k) of the residuals there.

    The fit begins again where the likelihood along friction has a larger maximum.
    """
    friction = _friction(misfit.simulation.free)

    for _ in range(_FITS):
        shares = misfit.fit(start)
        derivative = misfit.jacobian(shares)
        if friction is None:
            return shares, normal(shares, derivative), derivative
        misfit.report.stage("likelihood of friction")
        mixture = along_friction(shares, derivative, friction, _press_along(misfit, shares, friction))
        start = mixture.shares[np.argmax(mixture.density)]
        if np.interp(shares[friction], mixture.shares[:, friction], mixture.density) > _AS_LIKELY:
            break
    return shares, mixture, derivative


def _press_along(misfit: _Misfit, shares: Float, friction: int) -> Callable[[Float], tuple[Float, Float]]:
    """Return the function that `along_friction` presses with.

    Derivatives that need presses change little along friction: they are interpolated between its bounds and the values
    that were found.
    """
    scales, others = misfit.scales, [i for i in range(len(shares)) if i != friction]
    pressed = [i for i in others if i not in misfit.without_press]
    known: list[tuple[float, Float]] = []
    for place in np.unique([0.0, shares[friction], 1.0]) if pressed else ():
        with suppress(Finger3dError):  # a press that fails leaves the others
            at = np.where(np.arange(len(shares)) == friction, place, shares)
            known.append((float(place), misfit.jacobian(at, pressed)))

    def press(at: Float) -> tuple[Float, Float]:
        residual = misfit.residuals(values_at(scales, at))
        slope = np.empty((len(residual), len(shares)))
        slope[:, misfit.without_press] = misfit.jacobian(at, misfit.without_press)
        if pressed:
            places, columns = zip(*known, strict=True)
            slope[:, pressed] = interp1d(places, np.array(columns), axis=0)(
                np.clip(at[friction], places[0], places[-1])
            )
        return residual, slope[:, others]

    return press


def _check_columns(
    simulation: Simulation, scales: Sequence[Scale], curves: Sequence[Mapping[str, Float]], data: MeasuredPress
) -> None:
    """Check signs and units against presses that the fit needs anyway, and refuse them only if those at the bounds do.

    Raises
    ------
    Finger3dError
        For a column of another sign or unit than the scene gives.
    """

    def check(every: Sequence[Mapping[str, Float]]) -> None:
        data.check_signs(every)
        magnitudes = [largest(curve) for curve in every]
        data.check_units(
            {n: min(m[n] for m in magnitudes) for n in data.columns},
            {n: max(m[n] for m in magnitudes) for n in data.columns},
        )

    try:
        check(curves)
    except Finger3dError:
        ends = (np.zeros(len(scales)), np.ones(len(scales)))
        check([*curves, *(simulation.at(values_at(scales, shares), data) for shares in ends)])


def _with_modulus(simulation: Simulation, shares: Float) -> list[Float]:
    """Return the shares, and copies with several values of Young's modulus if these need no further solution."""
    own = np.array([f.key in MODULI for f in simulation.free])
    if own.sum() != 1 or not simulation.scales_with_modulus:
        return [shares]
    moduli = np.linspace(_FROM_BOUND, 1.0 - _FROM_BOUND, _TRIED_MODULI)
    return [np.where(own, share, shares) for share in (shares[own][0], *moduli)]


def _by_residuals(data: MeasuredPress, simulated: Mapping[str, Float], keys: int) -> dict[str, Float]:
    """Return the standard deviations (n,) of columns that have none in the file, from their residuals."""
    left = 1.0 - min(keys / data.count, 0.5)  # share of the degrees of freedom that the fit leaves
    found = {}
    for name, values in data.columns.items():
        if name not in data.stds:
            least = max(_LEAST_SHARE * float(np.abs(values).max()), SHARPEST)
            found[name] = np.full(len(values), max(_rms(values - simulated[name]) / math.sqrt(left), least))
    return found


def _reduced_chi_square(data: MeasuredPress, simulated: Mapping[str, Float], keys: int) -> float:
    """Return chi-square over its degrees of freedom, of the columns with standard deviations of their own."""
    squares = [((simulated[n] - data.columns[n]) / std) ** 2 for n, std in data.stds.items()]
    if not squares:
        return math.nan
    every = np.concatenate(squares)
    return float(every.sum() / max(len(every) - keys, 1))


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _write(folder: Path, found: Identification) -> None:
    """Write the results, the figure and the page."""
    write_json(folder / "identify.json", found.as_dict())
    data = found.measured
    columns: Tree = {data.index: data.at}
    for name, values in data.columns.items():
        columns |= {
            name: values,
            f"{name}_std": found.stds[name],
            f"{name}_simulated": found.simulated[name],
        }
    write_csv(folder / "identify.csv", columns)
    with atomic(folder / "identified.toml") as temporary:
        temporary.write_text(found.scene.to_toml(), encoding="utf-8")
    offset = dict(zip(found.keys, found.fitted.values, strict=True)).get(OFFSET, 0.0)
    part = moving_part(found.curve[data.index], data)
    curve = {name: values[part] for name, values in found.curve.items()}
    panels = [Panel(n, values, found.stds[n], found.simulated[n], curve[n]) for n, values in data.columns.items()]
    draw(folder / "identify.png", data.index, data.at + float(offset), curve[data.index], panels)
    identify_page(folder)
