"""calibration.json: written at once, and refused in one line if it is damaged or of another version."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import numpy as np
from annotated_types import Ge, Gt, Le, MinLen
from pydantic import BaseModel, ConfigDict, ValidationError

from finger3d._ranges import LARGEST_SD, Friction, Noise, Strain, StrainSd
from finger3d._types import Tree
from finger3d.errors import Finger3dError
from finger3d.io import write_csv, write_json
from finger3d.sensor.curve import FEWEST, Calibration, Tolerance

FORMAT, VERSION = "finger3d calibration", 2

_STEEPEST = 1e12  # strain per unit of what is not known exactly


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class _Curve(_Part):
    mu: Annotated[list[Friction], MinLen(FEWEST)]
    strain: Annotated[list[Strain], MinLen(FEWEST)]


class _Tolerance(_Part):
    unit: str
    sd: Annotated[float, Ge(0.0), Le(LARGEST_SD)]
    strain_per_unit: list[Annotated[float, Ge(-_STEEPEST), Le(_STEEPEST)]]
    strain_sd: list[StrainSd]


class _Failed(_Part):
    mu: float
    why: str


class _File(_Part):
    gauge: str
    curve: _Curve
    noise: Noise
    resolution_limit: Annotated[float, Gt(0.0), Le(1e6)]
    tolerances: dict[str, _Tolerance]
    failed: list[_Failed]
    scene: Tree
    hash: str
    about: Tree


def save(calibration: Calibration, path: str | Path) -> Path:
    """Write calibration.json."""
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
        found = _File.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(p) for p in first["loc"])
        raise Finger3dError(f"{path}: {where}: {first['msg'].lower()}; {again}") from None
    mu, strain = np.array(found.curve.mu), np.array(found.curve.strain)
    lengths = {
        len(mu),
        len(strain),
        *(len(v) for t in found.tolerances.values() for v in (t.strain_per_unit, t.strain_sd)),
    }
    if len(lengths) > 1 or (np.diff(mu) <= 0.0).any() or mu[0] < 0.0:
        raise Finger3dError(f"{path}: curve: mu must ascend from 0 up, with a strain and tolerances for each; {again}")
    return Calibration(
        gauge=found.gauge,
        mu=mu,
        strain=strain,
        noise=found.noise,
        limit=found.resolution_limit,
        tolerances=tuple(
            Tolerance(name=k, unit=t.unit, sd=t.sd, slope=np.array(t.strain_per_unit), spread=np.array(t.strain_sd))
            for k, t in found.tolerances.items()
        ),
        failed=tuple((f.mu, f.why) for f in found.failed),
        scene=found.scene,
        hash=found.hash,
        about=found.about,
    )
