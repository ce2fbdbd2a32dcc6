"""Reading and writing of calibration.json; a damaged file or another version raises an error of one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypeVar

import numpy as np

from finger3d._types import Float, Tree
from finger3d.errors import Finger3dError
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.curve import FEWEST, LARGEST_SD, LARGEST_STRAIN, QUANTITIES, ReadingCurve, Tolerance

FORMAT, VERSION = "finger3d calibration", 4

_FORMER_FORMAT = "finger3d joint calibration"

_STEEPEST = 1e12  # strain per unit of what is not known exactly
_LARGEST_MU, _LEAST_NOISE, _LARGEST_LIMIT = 1e6, 1e-12, 1e6


_TYPES: dict[type, str] = {dict: "table", list: "list", str: "text", object: "value"}
Part = TypeVar("Part")


def save(calibration: Calibration, path: str | Path) -> Path:
    """Write calibration.json."""
    from finger3d.io import write_json

    write_json(path, as_dict(calibration))
    return Path(path)


def as_dict(calibration: Calibration) -> Tree:
    """Return the content of calibration.json, including what follows from the curves."""
    c = calibration
    return {
        "format": FORMAT,
        "version": VERSION,
        "verdict": c.verdict(),
        "mu": c.mu,
        "readings": {one.name: _reading_dict(one) for one in c.readings},
        "mu_sd": [e.std for e in c.judged_at_mu],
        "status": [e.status for e in c.judged_at_mu],
        "variance_reductions": c.reductions(c.mu),
        "resolution_limit": c.limit,
        "trusted": [{"low": low, "high": high} for low, high in c.trusted],
        "usable": [{"low": low, "high": high} for low, high in c.usable],
        "failed": [{"mu": mu, "why": why} for mu, why in c.failed],
        "scene": c.scene,
        "hash": c.hash,
        "about": c.about,
    }


def _reading_dict(c: ReadingCurve) -> Tree:
    return {
        "kind": c.kind,
        "unit": QUANTITIES[c.kind][1],
        "noise": c.noise,
        "curve": c.reading,
        "fit": {"coefficients": c.fit.coefficients, "residual_rms": c.fit.rms, "residual_largest": c.fit.largest},
        "resolution": c.resolution(c.mu),
        "tolerances": {
            t.name: {
                "unit": t.unit,
                "sd": t.sd,
                "per_unit": t.slope,
                "per_unit_squared": t.curvature,
                "reading_sd": t.spread,
            }
            for t in c.tolerances
        },
    }


def write_table(calibration: Calibration, path: Path) -> None:
    """Write calibration.csv: every mu with its readings, and what an estimate from them says."""
    from finger3d.io import write_csv

    c = calibration
    columns: Tree = {
        "mu": c.mu,
        "mu_sd": np.array([e.std for e in c.judged_at_mu]),
        "status": np.array([e.status for e in c.judged_at_mu], dtype=object),
    }
    for one in c.readings:
        columns |= {
            one.name: one.reading,
            f"{one.name}_fit": one.at(c.mu, "fit"),
            f"{one.name}_per_mu": one.slope(c.mu),
            f"{one.name}_sd": one.reading_sd(c.mu),
            f"{one.name}_resolution": one.resolution(c.mu),
        }
    columns["outcome"] = np.array(["converged"] * len(c.mu), dtype=object)
    blank = {"mu": [mu for mu, _ in c.failed], "outcome": [why for _, why in c.failed], "status": [""] * len(c.failed)}
    for name, values in columns.items():
        added = np.array(blank.get(name, [np.nan] * len(c.failed)), dtype=values.dtype)
        columns[name] = np.concatenate([values, added])
    write_csv(path, columns)


def load(path: str | Path) -> Calibration:
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
    if not isinstance(data, dict) or data.get("format") not in (FORMAT, _FORMER_FORMAT):
        raise Finger3dError(f"{path}: no calibration; finger3d calibrate writes calibration.json")
    if data["format"] != FORMAT or data.get("version") != VERSION:
        version = data.get("version") if data["format"] == FORMAT else f"{data.get('version')} of several readings"
        raise Finger3dError(f"{path}: version {version}, this finger3d reads version {VERSION}; {again}")
    try:
        return _calibration(data)
    except ValueError as error:
        raise Finger3dError(f"{path}: {error}; {again}") from None


def _calibration(data: Tree) -> Calibration:
    """Return the calibration; a ValueError names the key of a part that is missing or wrong."""
    readings = _part(data, "readings", dict)
    if not readings:
        raise ValueError("readings: there are none")
    mu = _numbers(data, "mu", 0.0, _LARGEST_MU)
    if len(mu) < FEWEST or (np.diff(mu) <= 0.0).any():
        raise ValueError(f"mu: must be at least {FEWEST} values that ascend")
    return Calibration(
        readings=tuple(_curve(name, _part(readings, f"readings.{name}", dict, name), mu) for name in readings),
        limit=_number(data, "resolution_limit", 0.0, _LARGEST_LIMIT),
        failed=tuple(
            (_number(f, "failed.mu", 0.0, _LARGEST_MU), _part(f, "failed.why", str))
            for f in _part(data, "failed", list)
        ),
        scene=_part(data, "scene", dict),
        hash=_part(data, "hash", str),
        about=_part(data, "about", dict),
    )


def _curve(name: str, data: Tree, mu: Float) -> ReadingCurve:
    """Return the curve of an entry of `readings` at mu (n,)."""
    at = f"readings.{name}"
    if not name.isprintable():
        raise ValueError(f"{at!r:.60}: must be a name without control characters")
    kind = _part(data, f"{at}.kind", str)
    if kind not in QUANTITIES:
        raise ValueError(f"{at}.kind = {kind!r:.40}: must be {', '.join(QUANTITIES)}")
    tolerances = _part(data, f"{at}.tolerances", dict)
    curve = ReadingCurve(
        name=name,
        mu=mu,
        reading=_numbers(data, f"{at}.curve", -LARGEST_STRAIN, LARGEST_STRAIN),
        noise=_number(data, f"{at}.noise", _LEAST_NOISE, LARGEST_STRAIN),
        tolerances=tuple(
            _tolerance(f"{at}.tolerances.{t}", t, _part(tolerances, f"{at}.tolerances.{t}", dict, t))
            for t in tolerances
        ),
        kind=kind,
    )
    lengths = {len(mu), len(curve.reading), *(len(v) for t in curve.tolerances for v in (t.slope, t.curvature))}
    if len(lengths) > 1:
        raise ValueError(f"{at}: must have a reading and tolerances for each of the {len(mu)} values of mu")
    return curve


def _tolerance(at: str, name: str, data: Tree) -> Tolerance:
    """Return the tolerance of an entry."""
    return Tolerance(
        name=name,
        unit=_part(data, f"{at}.unit", str),
        sd=_number(data, f"{at}.sd", 0.0, LARGEST_SD),
        slope=_numbers(data, f"{at}.per_unit", -_STEEPEST, _STEEPEST),
        curvature=_numbers(data, f"{at}.per_unit_squared", -_STEEPEST, _STEEPEST),
    )


def _part(data: Tree, at: str, kind: type[Part], key: str = "") -> Part:
    """Return the entry `key` of `data`, by default the last word of its place; it must be of a type."""
    key = key or at.rpartition(".")[2]
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
