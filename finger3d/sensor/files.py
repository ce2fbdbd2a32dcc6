"""Reading and writing of calibration.json; another version, or a file that its checksum does not fit, is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from finger3d._types import Tree
from finger3d.errors import Finger3dError
from finger3d.io import checksum, write_csv, write_json
from finger3d.sensor.calibration import Calibration
from finger3d.sensor.curve import QUANTITIES, ReadingCurve, Tolerance

FORMAT, VERSION = "finger3d calibration", 5


def save(calibration: Calibration, path: str | Path) -> Path:
    """Write calibration.json."""
    write_json(path, as_dict(calibration))
    return Path(path)


def as_dict(calibration: Calibration) -> Tree:
    """Return the content of calibration.json, including what follows from the curves, and its checksum."""
    c = calibration
    data = {
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
    return data | {"checksum": checksum(data)}


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
    c = calibration
    columns: Tree = {
        "mu": c.mu,
        "mu_sd": np.array([e.std for e in c.judged_at_mu]),
        "status": np.array([e.status for e in c.judged_at_mu], dtype=object),
    }
    for one in c.readings:
        columns |= {
            one.name: one.reading,
            f"{one.name}_fit": one.fit.at(c.mu),
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
        In one line: no such file, no JSON (cut short), no calibration, another version, or changed since.
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
    if data.pop("checksum", None) != checksum(data):
        raise Finger3dError(f"{path}: is damaged or was changed, by its checksum; {again}")
    return Calibration(
        readings=tuple(_curve(name, one, data["mu"]) for name, one in data["readings"].items()),
        limit=data["resolution_limit"],
        failed=tuple((one["mu"], one["why"]) for one in data["failed"]),
        scene=data["scene"],
        hash=data["hash"],
        about=data["about"],
    )


def _curve(name: str, data: Tree, mu: list[float]) -> ReadingCurve:
    """Return the curve of an entry of `readings` at mu (n,)."""
    tolerances = tuple(
        Tolerance(t, one["unit"], one["sd"], np.array(one["per_unit"]), np.array(one["per_unit_squared"]))
        for t, one in data["tolerances"].items()
    )
    return ReadingCurve(name, np.array(mu), np.array(data["curve"]), data["noise"], tolerances, data["kind"])
