"""Calibration of one or more readings: curves, tolerances, and where the readings determine mu.

Where mu is determined is what an estimate says of readings without an error: a calibration and the estimates from it
have one definition of the standard deviation of mu, of its interval, and of what is out of range.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.errors import Finger3dError, MissingError
from finger3d.io import checksum, file_bytes, write_csv, write_json
from finger3d.sensor.curve import FEWEST, QUANTITIES, ReadingCurve, SensorModel, Tolerance
from finger3d.sensor.likelihood import Estimate, estimator, ranges_text

_CUTS = 4  # of the distance between two calibrated mu, for the ends of the ranges


@dataclass(frozen=True, repr=False, eq=False)
class Calibration(SensorModel):
    """Readings (k) of gauges, markers and taxels at ascending mu (n,), of the presses that converged.

    Attributes
    ----------
    readings : a curve for each reading, all at the same mu
    limit : standard deviation of mu beyond which an estimate is called coarse
    failed : (mu, why) of the presses that did not converge
    scene, hash : what was pressed, and 16 digits that identify the scene
    about : domain, effects, dofs, seconds, versions
    """

    limit: float
    failed: tuple[tuple[float, str], ...] = ()
    scene: TreeView = field(default_factory=dict)
    hash: str = ""
    about: TreeView = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raise an error if there are too few points."""
        if len(self.mu) < FEWEST:
            raise MissingError(
                f"calibrate: only {len(self.mu)} of {len(self.mu) + len(self.failed)} values of mu converged, {FEWEST} "
                f"are needed; first failure: {self.failed[0][1] if self.failed else 'none'}"
            )

    @property
    def title(self) -> str:
        """The readings in words."""
        one = self.readings[0]
        return f"{one.kind} {one.name}" if len(self.readings) == 1 else f"readings {', '.join(self.names)} together"

    def __repr__(self) -> str:
        """Return one line: readings, range of mu, number of points."""
        return f"<Calibration of {self.title}: {len(self.mu)} values of mu, {self.mu[0]:g} to {self.mu[-1]:g}>"

    def _repr_html_(self) -> str:
        from finger3d._notebook import card

        rows = [(name.strip(), str(said)) for name, said in summary(self)]
        return card(self.title.capitalize(), f"{len(self.mu)} values of mu", rows, [self.verdict()])

    def estimates(self, readings: Float, noise: Float | None = None, tolerances: bool = True) -> list[Estimate]:
        """Return an estimate for each set of readings (m, k); `noise` (m, k) has their standard deviations."""
        stds = np.broadcast_to(self.noise if noise is None else noise, readings.shape)
        model = self if tolerances else self.without_tolerances
        estimators = (estimator(model, self.limit, tuple(std.tolist())) for std in stds)
        return [one.estimate(reading) for one, reading in zip(estimators, readings, strict=True)]

    @cached_property
    def without_tolerances(self) -> Calibration:
        """Return the calibration of a sensor of which all is known exactly but the noise."""
        return replace(self, readings=tuple(replace(c, tolerances=()) for c in self.readings))

    @cached_property
    def judged_mu(self) -> Float:
        """Mu (m,) at which readings without an error are judged: the calibrated ones and three between any two."""
        every = np.arange(_CUTS * (len(self.mu) - 1) + 1) / _CUTS
        return np.asarray(np.interp(every, np.arange(len(self.mu)), self.mu))

    @cached_property
    def judged(self) -> list[Estimate]:
        """Estimates (m,) from the readings at `judged_mu`, with all tolerances."""
        return self.estimates(self.at(self.judged_mu))

    @cached_property
    def judged_by_noise(self) -> list[Estimate]:
        """Estimates (m,) from the same readings with the noise alone."""
        return self.estimates(self.at(self.judged_mu), tolerances=False)

    @cached_property
    def judged_at_mu(self) -> list[Estimate]:
        """Estimates (n,) from the calibrated readings, with all tolerances."""
        return self.judged[::_CUTS]

    @cached_property
    def trusted(self) -> tuple[tuple[float, float], ...]:
        """Intervals in which estimates are within the limit, with all tolerances, the widest first."""
        return self._ranges(self.judged)

    @cached_property
    def usable(self) -> tuple[tuple[float, float], ...]:
        """The same with the noise alone."""
        return self._ranges(self.judged_by_noise)

    def _ranges(self, judged: Sequence[Estimate]) -> tuple[tuple[float, float], ...]:
        good = np.array([False, *(one.status == "ok" for one in judged), False]).astype(int)
        ends = np.flatnonzero(np.diff(good)).reshape(-1, 2)
        ranges = [(float(self.judged_mu[a]), float(self.judged_mu[b - 1])) for a, b in ends if b - a > 1]
        return tuple(sorted(ranges, key=lambda pair: pair[0] - pair[1]))

    @property
    def best(self) -> int | None:
        """Number, among the calibrated mu, of the one that is known best; None if none is determined."""
        determined = [i for i, one in enumerate(self.judged_at_mu) if one.is_determined]
        return min(determined, key=lambda i: self.judged_at_mu[i].std, default=None)

    def verdict(self) -> str:
        """Return in one sentence where the readings determine mu."""
        text = (
            f"{self.title}: mu is found to {self.limit:g} or better, with all tolerances, {_from(self.trusted)}, and "
            f"by the noise alone {_from(self.usable)}"
        )
        if self.best is None:
            return text
        mu = self.mu[self.best]
        reductions = {name: float(values[0]) for name, values in self.reductions([mu]).items()}
        cause = max(reductions, key=lambda name: reductions[name])
        return (
            f"{text}; to +- {self.judged_at_mu[self.best].std:.2g} at best (mu = {mu:.2g}; without the uncertainty of "
            f"{cause} the variance would be {100.0 * reductions[cause]:.0f} % smaller)"
        )


def _from(intervals: Sequence[tuple[float, float]]) -> str:
    return f"from {ranges_text(intervals)}" if intervals else "nowhere"


def summary(calibration: Calibration) -> list[tuple[str, str]]:
    """Return the table that concludes a calibration."""
    c = calibration
    i = c.best if c.best is not None else len(c.mu) // 2
    mu = float(c.mu[i])
    rows = [(one.name, _curve_text(one)) for one in c.readings]
    if mesh := c.about.get("mesh"):
        note = f"; {mesh['note']}" if mesh["note"] else ""
        rows.append(("mesh", f"edges of {mesh['size_mm']:.3g} and {mesh['base_size_mm']:.3g} mm{note}"))
    left = [(t.spread.max() / one.noise) for one in c.readings for t in one.tolerances if t.name == "increments"]
    if left:
        steps = ", ".join(str(n) for n in c.about.get("increments", {}).get("steps", ()))
        rows.append((f"increments {steps}".strip(), f"leave an error of up to {max(left):.2g} times the noise"))
    rows += [
        (f"mu within {c.limit:g}", f"{ranges_text(c.trusted)}, with all tolerances"),
        ("", f"{ranges_text(c.usable)}, by the noise alone"),
        (f"at mu = {mu:.3g}", c.judged_at_mu[i].verdict),
    ]
    if len(c.readings) > 1:
        rows += [(f"  {name} alone", c.of([name]).judged_at_mu[i].verdict) for name in c.names]
    shares = sorted(c.reductions([mu]).items(), key=lambda item: -float(item[1][0]))
    rows.append(("variance of mu", "would fall there by so much if one of these were known exactly"))
    rows += [(f"  {name}", f"{100.0 * float(part[0]):.1f} %") for name, part in shares]
    if c.failed:
        rows.append(("failed", ", ".join(f"mu = {at:.4g}" for at, _ in c.failed)))
    return rows


def _curve_text(curve: ReadingCurve) -> str:
    """Return the ends of a curve, its noise, and the residual of its second-order fit."""
    quantity, unit = QUANTITIES[curve.kind]
    unit = "" if unit == "1" else f" {unit}"
    return (
        f"{quantity} {curve.reading[0]:.4g}{unit} at mu = {curve.mu[0]:g} to {curve.reading[-1]:.4g}{unit} at mu = "
        f"{curve.mu[-1]:g}; noise {curve.noise:g}{unit}; second-order fit within {curve.fit.rms:.2g}{unit} rms"
    )


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
    content = file_bytes(path, "; finger3d calibrate writes calibration.json")
    try:
        data = json.loads(content.decode("utf-8"))
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
