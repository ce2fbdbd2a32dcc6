"""calibration.json: written at once, and refused in one line if it is damaged or of another version."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TypeVar

import numpy as np

from finger3d._types import Float, Tree
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import FEWEST, LARGEST_SD, LARGEST_STRAIN, Calibration, Tolerance

FORMAT, VERSION = "finger3d calibration", 2

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
    """Return the content of calibration.json, including what follows from the curve."""
    c = calibration
    fit = c.fit
    return {
        "format": FORMAT,
        "version": VERSION,
        "gauge": c.gauge,
        "verdict": c.verdict(),
        "curve": {"mu": c.mu, "strain": c.strain},
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


def write_table(calibration: Calibration, path: Path) -> None:
    """Write calibration.csv: every mu with its strain, slope, resolution and what each tolerance adds."""
    from finger3d.io import write_csv

    c = calibration
    columns: Tree = {
        "mu": c.mu,
        "strain": c.strain,
        "strain_fit": c.at(c.mu, "fit"),
        "strain_per_mu": c.slope(c.mu),
        "resolution": c.resolution(c.mu),
    }
    columns |= {f"mu_sd_{t.name}": _mu_sd(c, i) for i, t in enumerate(c.tolerances)}
    columns["outcome"] = np.array(["converged"] * len(c.mu), dtype=object)
    blank = [np.nan] * len(c.failed)
    for name in columns:
        added = {"mu": [mu for mu, _ in c.failed], "outcome": [why for _, why in c.failed]}.get(name, blank)
        columns[name] = np.concatenate([columns[name], np.array(added, dtype=columns[name].dtype)])
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
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise Finger3dError(f"{path}: no calibration; finger3d calibrate writes calibration.json")
    if data.get("version") != VERSION:
        raise Finger3dError(f"{path}: version {data.get('version')}, this finger3d reads version {VERSION}; {again}")
    try:
        return _calibration(data)
    except ValueError as error:
        raise Finger3dError(f"{path}: {error}; {again}") from None


def _calibration(data: Tree) -> Calibration:
    """Return the calibration; a ValueError names the key of a part that is missing or wrong."""
    curve, tolerances = _part(data, "curve", dict), _part(data, "tolerances", dict)
    mu = _numbers(curve, "curve.mu", 0.0, _LARGEST_MU)
    strain = _numbers(curve, "curve.strain", -LARGEST_STRAIN, LARGEST_STRAIN)
    found = [_tolerance(name, _part(tolerances, f"tolerances.{name}", dict)) for name in tolerances]
    lengths = {len(mu), len(strain), *(len(v) for t in found for v in (t.slope, t.spread))}
    if len(lengths) > 1 or len(mu) < FEWEST or (np.diff(mu) <= 0.0).any():
        raise ValueError(
            f"curve: mu must ascend from 0 up, at least {FEWEST} values with a strain and tolerances for each"
        )
    failed = _part(data, "failed", list)
    return Calibration(
        gauge=_part(data, "gauge", str),
        mu=mu,
        strain=strain,
        noise=_number(data, "noise", _LEAST_NOISE, LARGEST_STRAIN),
        limit=_number(data, "resolution_limit", 0.0, _LARGEST_LIMIT),
        tolerances=tuple(found),
        failed=tuple((_number(f, "failed.mu", 0.0, _LARGEST_MU), _part(f, "failed.why", str)) for f in failed),
        scene=_part(data, "scene", dict),
        hash=_part(data, "hash", str),
        about=_part(data, "about", dict),
    )


def _tolerance(name: str, data: Tree) -> Tolerance:
    return Tolerance(
        name=name,
        unit=_part(data, f"tolerances.{name}.unit", str),
        sd=_number(data, f"tolerances.{name}.sd", 0.0, LARGEST_SD),
        slope=_numbers(data, f"tolerances.{name}.strain_per_unit", -_STEEPEST, _STEEPEST),
        spread=_numbers(data, f"tolerances.{name}.strain_sd", 0.0, LARGEST_STRAIN),
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
