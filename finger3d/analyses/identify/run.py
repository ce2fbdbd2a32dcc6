"""Identification: the values of free keys with which a scene reproduces a measured press and material tests."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import optimize
from scipy.linalg import block_diag, solve_triangular

from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.free_keys import Bounds, FreeKey, check_distinct, free_keys, settled_tables, values_at
from finger3d.analyses.identify.emulator import Emulator
from finger3d.analyses.identify.material_tests import CONSTANT_KEYS, LawInTests, is_material_test, read_material_tests
from finger3d.analyses.identify.posterior import FittedValues, Samples, fitted_values, sampled
from finger3d.analyses.identify.presses import (
    NO_PRESS,
    OFFSET,
    SHARPEST,
    Curve,
    MeasuredPress,
    Simulation,
    check_rows,
    fitted_scene,
    moving_part,
    names_of,
    read_measured,
)
from finger3d.errors import Finger3dError
from finger3d.fem.laws.base import nominal_stress, principal_stretches
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.plotting.analyses import Panel, draw_identification
from finger3d.progress import Progress
from finger3d.report.analyses import identify_page
from finger3d.results.journal import opened
from finger3d.scene import Scene, Source, parse, tables_of, tree

DEVIATIONS = "of the noise of the data, and of the errors of mesh and increments"
"""What the standard deviations of an identification contain."""

_FINE = 100  # stretches of a curve that is drawn


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes
    ----------
    scene : with the values that were found
    keys : the free keys (k)
    fitted : their values, standard deviations and correlation
    measured : the measured press, without columns if there is none
    tested : the material tests, and the law for any values of the free keys
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
    tested: LawInTests
    simulated: Mapping[str, Float]
    stds: Mapping[str, Float]
    curve: Curve
    reduced_chi_square: float
    notes: tuple[str, ...]
    presses: int

    def as_dict(self) -> Tree:
        """Return the content of identify.json."""
        fitted, names = self.fitted, ("value", "std", "std_numerical", "low", "high")
        rows = np.column_stack([fitted.values, fitted.stds, fitted.numerical, fitted.low, fitted.high]).tolist()
        tables = zip(self.keys, rows, fitted.correlation.tolist(), strict=True)
        values, correlation = {}, {}
        for key, row, correlated in tables:
            values[key] = dict(zip(names, row, strict=True))
            correlation[key] = dict(zip(self.keys, correlated, strict=True))
        measured, given = {**self.measured.columns, **self.tested.columns}, {*self.measured.stds, *self.tested.stds}
        return {
            "scene": self.scene.as_dict(),
            "measured": str(self.measured.path) if self.measured.columns else None,
            "material_tests": list(dict.fromkeys(str(test.path) for test in self.tested.tests.values())),
            "index": self.measured.index or None,
            "values": values,
            "correlation": correlation,
            "reduced_chi_square": self.reduced_chi_square,
            "residual_rms": {
                name: float(np.sqrt(np.mean((values - self.simulated[name]) ** 2))) for name, values in measured.items()
            },
            "stable": self.tested.stable(self.fitted.values),
            "std_of_columns": {
                name: {"from": "file" if name in given else "residuals", "rms": float(np.sqrt(np.mean(std**2)))}
                for name, std in self.stds.items()
            },
            "deviations": DEVIATIONS,
            "notes": list(self.notes),
            "presses": self.presses,
        }


def write(folder: Path, found: Identification) -> None:
    """Write the results, the figure and the page."""
    write_json(folder / "identify.json", found.as_dict())
    write_text(folder / "identified.toml", found.scene.to_toml())
    panels = [*(_of_press(folder, found) if found.measured.columns else []), *_of_tests(folder, found)]
    draw_identification(folder / "identify.png", panels)
    identify_page(folder).write(folder)


def _of_press(folder: Path, found: Identification) -> list[Panel]:
    """Write the rows of the press, and return its panels."""
    data = found.measured
    columns: Tree = {data.index: data.at}
    for name, values in data.columns.items():
        columns |= {
            name: values,
            f"{name}_std": found.stds[name],
            f"{name}_simulated": found.simulated[name],
        }
    write_csv(folder / "identify.csv", columns)
    offset = dict(zip(found.keys, found.fitted.values, strict=True)).get(OFFSET, 0.0)
    part = moving_part(found.curve[data.index], data)
    curve = {name: values[part] for name, values in found.curve.items()}
    at = data.at + float(offset)
    return [
        Panel(n, values, found.stds[n], found.simulated[n], curve[n], data.index, at, curve[data.index])
        for n, values in data.columns.items()
    ]


def _of_tests(folder: Path, found: Identification) -> list[Panel]:
    """Write the rows of the material tests, and return their panels."""
    tests = found.tested.tests.items()
    if not tests:
        return []
    columns: Tree = {
        "test": [name.removesuffix("_stress_MPa") for name, test in tests for _ in test.stretch],
        "stretch": np.concatenate([test.stretch for _, test in tests]),
        "stress_MPa": np.concatenate([test.stress for _, test in tests]),
        "stress_MPa_std": np.concatenate([found.stds[name] for name, _ in tests]),
        "stress_MPa_simulated": np.concatenate([found.simulated[name] for name, _ in tests]),
    }
    write_csv(folder / "identify_tests.csv", columns)
    law, panels = found.tested.law(found.fitted.values.tolist()), []
    for name, test in tests:
        at = np.linspace(min(1.0, test.stretch.min()), max(1.0, test.stretch.max()), _FINE)
        curve = nominal_stress(law, principal_stretches(test.mode, at))
        panels.append(
            Panel(name, test.stress, found.stds[name], found.simulated[name], curve, "stretch", test.stretch, at)
        )
    return panels


_BAR = 1.645
"""Error bar over the standard deviation of the error: nine of ten errors are within a bar."""

_SHARE = 0.02  # standard deviation in the first fit of a column without one, over its largest magnitude
_LEAST_SHARE = 1e-4  # lower bound of the same when it is taken from the residuals
_MOST = 12  # presses for each key that needs some, at most, and one more: with that of the errors, and the last
_FEW, _MANY = 256, 2048  # samples of the posterior while presses are chosen, and at the end
_AGREES = 0.5  # difference of an emulator from a press, in standard deviations, that counts as none
_NEAR = 1e-3  # distance of shares from a press at which there is no other
_STEP = 0.01  # of shares, for derivatives
_IMPOSSIBLE, _INSIDE = 1e12, 1e-9  # misfit where a press fails; distance of a first guess from its bounds
_MISFIT = 2.0  # residuals over their stated standard deviation beyond which the scene does not explain the data


def identify(
    scene: Source,
    measured: str | Path | Sequence[str | Path],
    free: Bounds,
    out: str | Path,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> Identification:
    """Find the values of free keys with which a scene reproduces measurements, by weighted least squares.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    measured : CSV file with columns named as in history.csv, and optionally their standard deviations, ``..._std``; or
        material tests, with ``stretch``, ``stress_MPa`` (nominal), ``mode`` (tension, compression, shear or
        equibiaxial) and optionally ``stress_MPa_std``; or several files, of which one at most is a press
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
    keys = free_keys(free)
    files_of_tests, files_of_press = _sorted(measured)
    given, _ = tables_of(scene, overrides)
    absent = [f"{f.key}={f.middle!r}" for f in keys if f.key in CONSTANT_KEYS and tree.value_at(given, f.key) is None]
    given, path = tables_of(scene, [*overrides, *absent])
    if files_of_press:
        given, path = settled_tables(scene, [*overrides, *absent], report)
    start = _checked_start(given, keys, path)
    loaded, data = parse(given, path), NO_PRESS
    tested = LawInTests.of(given, loaded, keys, [test for file in files_of_tests for test in read_material_tests(file)])
    if files_of_press:
        data = read_measured(files_of_press[0], names_of(loaded.model()))
    _check_told(keys, data, tested)
    for values in (start, [f.low for f in keys], [f.high for f in keys]):
        bound = fitted_scene(given, keys, values, path)
        if files_of_press:
            check_rows(bound.model().legs, keys, data)
    task = {
        "scene": tree.plain(given),
        "files": tree.contents(given, path),
        "free": [[f.key, f.low, f.high] for f in keys],
        "measured": [hashlib.sha256(file.read_bytes()).hexdigest()[:16] for file in (*files_of_press, *files_of_tests)],
    }
    with (
        claimed(out, "identify") as folder,
        opened(folder / "presses.jsonl", folder / "task.json", task) as journal,
    ):
        simulation = Simulation(given, path, keys, journal, data)
        found = _fitted(Emulator(simulation, data, tested), start, report)
        write(folder, found)
        return found


def _sorted(measured: str | Path | Sequence[str | Path]) -> tuple[list[Path], list[Path]]:
    """Return the files of material tests, and that of a press if there is one."""
    paths = [Path(path) for path in ([measured] if isinstance(measured, str | Path) else measured)]
    check_distinct([str(path) for path in paths], "--measured")
    tests = [path for path in paths if is_material_test(path)]
    presses = [path for path in paths if path not in tests]
    if len(presses) > 1:
        raise Finger3dError(f"--measured {presses[1]}: is a second press beside {presses[0]}; give one, and any tests")
    return tests, presses


def _check_told(keys: Sequence[FreeKey], data: MeasuredPress, tested: LawInTests) -> None:
    """Raise an error for free keys of which the measurements tell nothing, and for more keys than measured values."""
    for free in keys:
        if free.key == OFFSET and data.columns and data.index != "depth_mm":
            raise Finger3dError(
                f"--free {OFFSET}: the rows of {data.path} are ordered by {data.index}, not by depth_mm"
            )
        if not data.columns and not tested.tells(free.key):
            raise Finger3dError(
                f"--free {free.key}: material tests tell only Young's modulus and the constants of "
                "effects.large_deformation; give a press, too"
            )
    count = data.count + sum(len(test.stress) for test in tested.tests.values())
    if count <= len(keys):
        path = next((test.path for test in tested.tests.values()), data.path)
        raise Finger3dError(f"{path}: {count} measured values for {len(keys)} free keys; give more rows")


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
    """Residuals of a simulation over their standard deviations.

    Attributes
    ----------
    start : (k,) shares from which values stay near where the data do not determine them
    stds : (n,) standard deviations by column
    root : Cholesky factor of the covariance of all residuals, each over its standard deviation
    """

    emulator: Emulator
    start: Float
    stds: Mapping[str, Float]
    root: Float

    @classmethod
    def of(cls, emulator: Emulator, start: Float) -> _Misfit:
        """Return the misfit by the noise alone; that of columns without standard deviations is a share of them."""
        stds = {
            n: emulator.stds.get(n, np.full(len(v), max(_SHARE * float(np.abs(v).max()), SHARPEST)))
            for n, v in emulator.measured.items()
        }
        shares = np.array([key.share(v) for key, v in zip(emulator.free, start, strict=True)])
        return cls(emulator, shares, stds, np.eye(sum(map(len, stds.values()))))

    def with_errors(self, known: Mapping[str, Float]) -> _Misfit:
        """Return the misfit with independent errors (m, r) of the simulation at the rows of each column."""
        # a row of zeros for all columns but the one that the error is of
        plain = block_diag(*(known.get(n, np.zeros((1, len(std)))) / (_BAR * std) for n, std in self.stds.items()))
        return replace(self, root=np.linalg.cholesky(np.eye(plain.shape[1]) + plain.T @ plain))

    @property
    def part_of_errors(self) -> Float:
        """Part (n, n) of the errors of the simulation in the covariance of whitened residuals."""
        inverse = solve_triangular(self.root, np.eye(len(self.root)), lower=True)
        return np.asarray(np.eye(len(self.root)) - inverse @ inverse.T)

    def whitened(self, difference: Float) -> Float:
        """Return differences (s, n) of numbers over their standard deviations, with the identity as covariance."""
        plain = difference / np.concatenate([*self.stds.values()])
        found: Float = np.asarray(solve_triangular(self.root, plain.T, lower=True))
        return found.T

    def residuals(self, shares: Float) -> Float:
        """Return the residuals (s, n) at shares (s, k)."""
        return self.whitened(self.emulator(shares) - np.concatenate([*self.emulator.measured.values()]))

    def log_likelihood(self, shares: Float) -> Float:
        """Return the logarithm of the likelihood (s,) at shares (s, k), which is very small where presses fail.

        The error of the emulator adds to the variance (Kennedy and O'Hagan 2001).
        """
        variance = 1.0 + self.whitened(self.emulator.error(shares)) ** 2
        found = -0.5 * np.sum(self.residuals(shares) ** 2 / variance + np.log(variance), axis=1)
        return np.where(self.emulator.fails(shares), -_IMPOSSIBLE, found)

    def derivative(self, shares: Float) -> Float:
        """Return the derivatives (n, k) of the residuals at shares (k,)."""
        ends = [np.clip(shares + sign * _STEP * np.eye(len(shares)), 0.0, 1.0) for sign in (-1.0, 1.0)]
        less, more = map(self.residuals, ends)
        return np.asarray((more - less).T / np.diag(ends[1] - ends[0]))

    def best(self, samples: Samples) -> Float:
        """Return the most likely shares (k,); over the whole range of a share, one standard deviation is added."""

        def residuals(shares: Float) -> Float:
            return np.concatenate([self.residuals(shares[None])[0], shares - self.start])

        added = 0.5 * np.sum((samples.shares - self.start) ** 2, axis=1)
        first = samples.shares[np.argmax(samples.log_likelihood - added)]
        inside = np.clip(first, _INSIDE, 1.0 - _INSIDE)
        found = optimize.least_squares(residuals, inside, bounds=(0.0, 1.0), xtol=1e-10, ftol=1e-12, x_scale=_STEP).x
        return first if self.emulator.fails(found[None])[0] else np.asarray(found)

    def explored(self, report: Progress, rounds: int = _MOST) -> Float:
        """Return the most likely shares (k,), once presses there and where the emulator is least sure agree with it."""
        emulator, simulation = self.emulator, self.emulator.simulation
        for _ in range(rounds):
            samples = sampled(self.log_likelihood, len(self.start), _FEW)
            best = self.best(samples)
            named = zip(simulation.free, values_at(emulator.free, best), strict=True)
            told = ", ".join(f"{free.key} = {value:.5g}" for free, value in named)
            report.stage(f"fitting, {simulation.solved} presses: {told}")
            unsure = np.sum(self.whitened(emulator.error(samples.shares)) ** 2, axis=1)
            gaps = []
            for shares in (best, samples.shares[np.argmax(unsure)]):
                if emulator.distance(shares) > _NEAR and emulator.count < _MOST * len(emulator.pressed) - 1:
                    before = emulator(shares[None])
                    emulator.press(shares)
                    gap = float(np.linalg.norm(self.whitened(emulator(shares[None]) - before)))
                    gaps.append(math.inf if emulator.fails(shares[None])[0] else gap)
            if max(gaps, default=0.0) <= _AGREES:
                break
        return self.best(sampled(self.log_likelihood, len(self.start), _FEW))

    def as_far_as_it_fits(self, shares: Float) -> _Misfit:
        """Return the misfit with a covariance larger by the reduced chi-square at shares (k,), if that is above one.

        It is the square of the ratio of Birge (1932): what the scene does not explain counts as an error of all data.
        """
        residuals = self.residuals(shares[None])[0]
        ratio = float(residuals @ residuals) / max(len(residuals) - len(shares), 1)
        return replace(self, root=math.sqrt(max(ratio, 1.0)) * self.root)

    def by_residuals(self, shares: Float) -> _Misfit:
        """Return the misfit with columns weighted by their residuals that have no standard deviations in the file."""
        simulated, stds = self.emulator.columns(shares), {**self.stds}
        left = 1.0 - min(len(shares) / len(self.root), 0.5)  # share of the degrees of freedom that the fit leaves
        for name, values in self.emulator.measured.items():
            if name not in self.emulator.stds:
                least = max(_LEAST_SHARE * float(np.abs(values).max()), SHARPEST)
                std = max(_rms(values - simulated[name]) / math.sqrt(left), least)
                stds[name] = np.full(len(values), std)
        return replace(self, stds=stds)


def _fitted(emulator: Emulator, start: Float, report: Progress) -> Identification:
    """Fit by the noise, then by the noise and the errors of the simulation."""
    simulation, data, tested = emulator.simulation, emulator.data, emulator.tested
    if data.columns:
        report.stage("first presses")
        designed = emulator.design()
        for shares in designed:
            emulator.press(shares)
        emulator.check()
        tried = [shares for shares in emulator.ends(designed) if not emulator.fails(shares[None])[0]]
        data.check_against([emulator.columns(shares) for shares in tried])
    misfit = _Misfit.of(emulator, start)
    shares, known = misfit.explored(report, 2), {}
    if data.columns:
        report.stage("errors of mesh and increments")
        known = simulation.errors(values_at(emulator.free, shares), data)
        misfit = misfit.with_errors(known)
        shares = misfit.explored(report)
    if set(emulator.stds) != set(emulator.measured):
        misfit = misfit.by_residuals(shares).with_errors(known)
        shares = misfit.explored(report)
        misfit = misfit.by_residuals(shares).with_errors(known)
    part, misfit = misfit.part_of_errors, misfit.as_far_as_it_fits(shares)
    samples = sampled(misfit.log_likelihood, len(start), _MANY)
    shares = misfit.best(samples)
    fitted = fitted_values(emulator.free, shares, samples, misfit.derivative(shares), part)
    values = fitted.values
    simulated = emulator.columns(shares) | (simulation.at(values, data) if data.columns else {})
    reduced = _reduced_chi_square(emulator, simulated, len(values))
    unknown = sorted(set(data.columns) - set(known))
    missing = [f"the error of the mesh is not known: {', '.join(unknown)}"] if unknown else []
    notes, ratio = [*fitted.untold, *missing, *tested.instability(values)], math.sqrt(reduced)
    if ratio > _MISFIT:
        notes.append(
            f"the residuals are {ratio:.2g} times their standard deviations: the scene does not explain the data"
        )
    return Identification(
        scene=simulation.scene(values),
        keys=tuple(f.key for f in simulation.free),
        fitted=fitted,
        measured=data,
        tested=tested,
        simulated=simulated,
        stds=misfit.stds,
        curve=simulation.curve(values) if data.columns else {},
        reduced_chi_square=reduced,
        notes=tuple(notes),
        presses=simulation.solved,
    )


def _reduced_chi_square(emulator: Emulator, simulated: Mapping[str, Float], keys: int) -> float:
    """Return chi-square over its degrees of freedom, of the columns with standard deviations of their own."""
    squares = [((simulated[n] - emulator.measured[n]) / std) ** 2 for n, std in emulator.stds.items()]
    if not squares:
        return math.nan
    every = np.concatenate(squares)
    return float(every.sum() / max(len(every) - keys, 1))


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
