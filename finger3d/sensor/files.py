"""Reading and writing of calibration.json; a damaged file or another version raises an error of one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypeVar

import numpy as np

from finger3d._types import Float, Tree
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import FEWEST, LARGEST_SD, LARGEST_STRAIN, QUANTITIES, Calibration, Tolerance
from finger3d.sensor.joint import JointCalibration

FORMAT, VERSION = "finger3d calibration", 2

JOINT_FORMAT, JOINT_VERSION = "finger3d joint calibration", 1

_STEEPEST = 1e12  # strain per unit of what is not known exactly
_LARGEST_MU, _LEAST_NOISE, _LARGEST_LIMIT = 1e6, 1e-12, 1e6


_TYPES: dict[type, str] = {dict: "table", list: "list", str: "text", object: "value"}
Part = TypeVar("Part")


def save(calibration: Calibration | JointCalibration, path: str | Path) -> Path:
    """Write calibration.json."""
    from finger3d.io import write_json

    write_json(path, as_dict(calibration))
    return Path(path)


def as_dict(calibration: Calibration | JointCalibration) -> Tree:
    """Return the content of calibration.json, including what follows from the curve."""
    return _joint_dict(calibration) if isinstance(calibration, JointCalibration) else _gauge_dict(calibration)


def _joint_dict(c: JointCalibration) -> Tree:
    return {
        "format": JOINT_FORMAT,
        "version": JOINT_VERSION,
        "verdict": c.verdict(),
        "mu": c.mu,
        "readings": {
            one.name: {
                "kind": one.kind,
                "unit": QUANTITIES[one.kind][1],
                "noise": one.noise,
                "curve": one.reading,
                "tolerances": {
                    t.name: {"unit": t.unit, "sd": t.sd, "per_unit": t.slope, "reading_sd": t.spread}
                    for t in one.tolerances
                },
                "mu_sd": one.mu_sd(one.mu),
            }
            for one in c.readings
        },
        "mu_sd": c.mu_sd(c.mu),
        "variance_reductions": c.reductions(c.mu),
        "resolution_limit": c.limit,
        "trusted": [{"low": low, "high": high} for low, high in c.trusted],
        "failed": [{"mu": mu, "why": why} for mu, why in c.failed],
        "scene": c.scene,
        "hash": c.hash,
        "about": c.about,
    }


def _gauge_dict(c: Calibration) -> Tree:
    fit = c.fit
    return {
        "format": FORMAT,
        "version": VERSION,
        "gauge": c.name,
        "verdict": c.verdict(),
        "curve": {"mu": c.mu, "strain": c.reading},
        "fit": {"coefficients": fit.coefficients, "residual_rms": fit.rms, "residual_largest": fit.largest},
        "interpolation": {"kind": "PCHIP", "error": c.interpolation_error},
        "noise": c.noise,
        "resolution_limit": c.limit,
        "resolution": c.resolution(c.mu),
        "trusted": [{"low": r.low, "high": r.high} for r in c.trusted],
        "usable": [{"low": r.low, "high": r.high, "same_strain_at": r.elsewhere} for r in c.usable],
        "tolerances": {
            t.name: {
                "unit": t.unit,
                "sd": t.sd,
                "strain_per_unit": t.slope,
                "strain_sd": t.spread,
                "mu_sd": _mu_sd(c, i),
            }
            for i, t in enumerate(c.tolerances)
        },
        "mu_sd": c.mu_sd(c.mu),
        "failed": [{"mu": mu, "why": why} for mu, why in c.failed],
        "scene": c.scene,
        "hash": c.hash,
        "about": c.about,
    }


def _mu_sd(c: Calibration, number: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return c.mu_sd(c.mu, c.tolerance_sd(c.mu)[number])


def write_table(calibration: Calibration | JointCalibration, path: Path) -> None:
    """Write calibration.csv: every mu with its readings, their slopes, and standard deviations of mu."""
    from finger3d.io import write_csv

    c = calibration
    columns = _joint_columns(c) if isinstance(c, JointCalibration) else _gauge_columns(c)
    columns["outcome"] = np.array(["converged"] * len(c.mu), dtype=object)
    blank = [np.nan] * len(c.failed)
    for name in columns:
        added = {"mu": [mu for mu, _ in c.failed], "outcome": [why for _, why in c.failed]}.get(name, blank)
        columns[name] = np.concatenate([columns[name], np.array(added, dtype=columns[name].dtype)])
    write_csv(path, columns)


def _gauge_columns(c: Calibration) -> Tree:
    columns: Tree = {
        "mu": c.mu,
        "strain": c.reading,
        "strain_fit": c.at(c.mu, "fit"),
        "strain_per_mu": c.slope(c.mu),
        "resolution": c.resolution(c.mu),
    }
    return columns | {f"mu_sd_{t.name}": _mu_sd(c, i) for i, t in enumerate(c.tolerances)}


def _joint_columns(c: JointCalibration) -> Tree:
    columns: Tree = {"mu": c.mu, "mu_sd": c.mu_sd(c.mu)}
    for one in c.readings:
        columns |= {
            one.name: one.reading,
            f"{one.name}_per_mu": one.slope(one.mu),
            f"{one.name}_sd": one.reading_sd(one.mu),
            f"mu_sd_{one.name}": one.mu_sd(one.mu),
        }
    return columns


def load(path: str | Path) -> Calibration | JointCalibration:
    """Read calibration.json.

    Raises
    ------
    Finger3dError
        In one line: no such file, no JSON (cut short), no calibration, another version, or parts that do not fit.
    """
    again = "calibrate again: finger3d calibrate SCENE --gauge NAME --out DIR"
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file; finger3d calibrate writes calibration.json") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        raise Finger3dError(f"{path}: not JSON, or cut short; {again}") from None
    if not isinstance(data, dict) or data.get("format") not in (FORMAT, JOINT_FORMAT):
        raise Finger3dError(f"{path}: no calibration; finger3d calibrate writes calibration.json")
    parse, wanted = (_calibration, VERSION) if data["format"] == FORMAT else (_joint_calibration, JOINT_VERSION)
    if data.get("version") != wanted:
        raise Finger3dError(f"{path}: version {data.get('version')}, this finger3d reads version {wanted}; {again}")
    try:
        return parse(data)
    except ValueError as error:
        raise Finger3dError(f"{path}: {error}; {again}") from None


def _joint_calibration(data: Tree) -> JointCalibration:
    """Return the calibration; a ValueError names the key of a part that is missing or wrong."""
    readings = _part(data, "readings", dict)
    if not readings:
        raise ValueError("readings: there are none")
    mu, failed = _coefficients(data, "mu"), _failed(data)
    limit = _number(data, "resolution_limit", 0.0, _LARGEST_LIMIT)
    found = []
    for name in readings:
        at = f"readings.{name}"
        one = readings[name]
        kind = _part(one, f"{at}.kind", str)
        if kind not in QUANTITIES:
            raise ValueError(f"{at}.kind = {kind!r:.40}: must be {', '.join(QUANTITIES)}")
        tolerances = _part(one, f"{at}.tolerances", dict)
        calibration = Calibration(
            name=name,
            mu=mu,
            reading=_numbers(one, f"{at}.curve", -LARGEST_STRAIN, LARGEST_STRAIN),
            noise=_number(one, f"{at}.noise", _LEAST_NOISE, LARGEST_STRAIN),
            limit=limit,
            tolerances=tuple(
                _tolerance(t, _part(tolerances, f"{at}.tolerances.{t}", dict), ("per_unit", "reading_sd"))
                for t in tolerances
            ),
            failed=failed,
            kind=kind,
        )
        _check_lengths(at, calibration)
        found.append(calibration)
    return JointCalibration(
        tuple(found), limit, _part(data, "scene", dict), _part(data, "hash", str), _part(data, "about", dict)
    )


def _coefficients(data: Tree, at: str) -> Float:
    """Return ascending coefficients of friction."""
    mu = _numbers(data, at, 0.0, _LARGEST_MU)
    if len(mu) < FEWEST or (np.diff(mu) <= 0.0).any():
        raise ValueError(f"{at}: must be at least {FEWEST} values that ascend from 0 up")
    return mu


def _check_lengths(at: str, calibration: Calibration) -> None:
    """Raise a ValueError unless every value of mu has a reading and tolerances."""
    c = calibration
    lengths = {len(c.mu), len(c.reading), *(len(v) for t in c.tolerances for v in (t.slope, t.spread))}
    if len(lengths) > 1:
        raise ValueError(f"{at}: must have a reading and tolerances for each of the {len(c.mu)} values of mu")


def _failed(data: Tree) -> tuple[tuple[float, str], ...]:
    failed = _part(data, "failed", list)
    return tuple((_number(f, "failed.mu", 0.0, _LARGEST_MU), _part(f, "failed.why", str)) for f in failed)


def _calibration(data: Tree) -> Calibration:
    """Return the calibration; a ValueError names the key of a part that is missing or wrong."""
    curve, tolerances = _part(data, "curve", dict), _part(data, "tolerances", dict)
    mu = _coefficients(curve, "curve.mu")
    calibration = Calibration(
        name=_part(data, "gauge", str),
        mu=mu,
        reading=_numbers(curve, "curve.strain", -LARGEST_STRAIN, LARGEST_STRAIN),
        noise=_number(data, "noise", _LEAST_NOISE, LARGEST_STRAIN),
        limit=_number(data, "resolution_limit", 0.0, _LARGEST_LIMIT),
        tolerances=tuple(
            _tolerance(name, _part(tolerances, f"tolerances.{name}", dict), ("strain_per_unit", "strain_sd"))
            for name in tolerances
        ),
        failed=_failed(data),
        scene=_part(data, "scene", dict),
        hash=_part(data, "hash", str),
        about=_part(data, "about", dict),
    )
    _check_lengths("curve", calibration)
    return calibration


def _tolerance(name: str, data: Tree, keys: tuple[str, str]) -> Tolerance:
    """Return the tolerance of an entry with these keys of its slope and its spread."""
    slope, spread = keys
    return Tolerance(
        name=name,
        unit=_part(data, f"tolerances.{name}.unit", str),
        sd=_number(data, f"tolerances.{name}.sd", 0.0, LARGEST_SD),
        slope=_numbers(data, f"tolerances.{name}.{slope}", -_STEEPEST, _STEEPEST),
        spread=_numbers(data, f"tolerances.{name}.{spread}", 0.0, LARGEST_STRAIN),
    )


def _part(data: Tree, at: str, kind: type[Part]) -> Part:
    """Return the entry of `data` that the last word of a key names; it must be of a type."""
    key = at.rpartition(".")[2]
    if not isinstance(data, dict) or key not in data:
        raise ValueError(f"{at}: missing")
    value = data[key]
    if not isinstance(value, kind):
        raise ValueError(f"{at}: must be a {_TYPES[kind]}")
    return value


def _number(data: Tree, at: str, low: float, high: float) -> float:
    return _checked(_part(data, at, object), at, low, high)


def _checked(value: object, at: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ValueError(f"{at} = {value!r:.40}: must be a number from {low:g} to {high:g}")
    return float(value)


def _numbers(data: Tree, at: str, low: float, high: float) -> Float:
    return np.array([_checked(value, f"{at}.{i}", low, high) for i, value in enumerate(_part(data, at, list))])
