"""Friction coefficient from readings of a calibrated sensor; this needs no library but NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import LARGEST_STRAIN, QUANTITIES, Calibration, Shape
from finger3d.sensor.files import load
from finger3d.sensor.inverse import Estimate, gauge_estimates
from finger3d.sensor.joint import JointCalibration
from finger3d.sensor.likelihood import JointEstimate, estimator


@overload
def estimate(
    calibration: Calibration,
    strain: ArrayLike,
    std: ArrayLike | None = None,
    curve: Shape = "interpolation",
    tolerances: bool = True,
) -> list[Estimate]: ...


@overload
def estimate(
    calibration: JointCalibration,
    strain: Mapping[str, ArrayLike],
    std: Mapping[str, ArrayLike] | float | None = None,
    curve: Shape = "interpolation",
    tolerances: bool = True,
) -> list[JointEstimate]: ...


@overload
def estimate(
    calibration: Calibration | JointCalibration | str | Path,
    strain: ArrayLike | Mapping[str, ArrayLike],
    std: ArrayLike | Mapping[str, ArrayLike] | None = None,
    curve: Shape = "interpolation",
    tolerances: bool = True,
) -> list[Estimate] | list[JointEstimate]: ...


def estimate(
    calibration: Calibration | JointCalibration | str | Path,
    strain: ArrayLike | Mapping[str, ArrayLike],
    std: ArrayLike | Mapping[str, ArrayLike] | None = None,
    curve: Shape = "interpolation",
    tolerances: bool = True,
) -> list[Estimate] | list[JointEstimate]:
    """Estimate the friction coefficient from readings.

    Parameters
    ----------
    calibration : what `finger3d.calibrate` returned, or the path of its calibration.json
    strain : one reading, or (m,) of them; of several calibrated readings a mapping with those of each by its name,
        where readings of broken sensors may be left out
    std : standard deviation of each, 0 allowed; None: the noise of the calibration
    curve : whether to invert the monotone interpolation or the second-order fit, of a single gauge
    tolerances : whether tolerances count; they do not for a sensor whose own curve was measured

    Returns
    -------
    list
        An Estimate for each reading, or a JointEstimate for each set of readings, with ``mu``, ``std`` and ``status``.

    Raises
    ------
    Finger3dError
        For a reading that is no finite number, a name that was not calibrated, or a std that is not from 0 up.
    """
    if isinstance(calibration, str | Path):
        calibration = load(calibration)
    if isinstance(calibration, JointCalibration):
        return _joint_estimates(calibration, strain, std, tolerances)
    name = calibration.name
    return gauge_estimates(calibration, _of_gauge(strain, name), _of_gauge(std, name), curve, tolerances)


def _of_gauge(values: ArrayLike | Mapping[str, ArrayLike] | None, name: str) -> ArrayLike | None:
    """Return the values of the only gauge, which may be given by its name."""
    if not isinstance(values, Mapping):
        return values
    for other in values:
        if other != name:
            raise Finger3dError(f"{other}: not calibrated; the gauge is {name}")
    return values.get(name)


def _joint_estimates(
    calibration: JointCalibration,
    readings: ArrayLike | Mapping[str, ArrayLike],
    std: ArrayLike | Mapping[str, ArrayLike] | None,
    tolerances: bool,
) -> list[JointEstimate]:
    if not isinstance(readings, Mapping) or not readings:
        raise Finger3dError(
            f"a reading without a name: {', '.join(calibration.names)} are calibrated, so that every reading needs its "
            f"name, for instance {calibration.names[0]}=0.05"
        )
    names = tuple(n for n in calibration.names if n in readings)
    chosen = calibration if set(readings) == set(calibration.names) else calibration.of(list(readings)).of(names)
    rows = [_row(name, readings[name], -LARGEST_STRAIN) for name in names]
    stds = [_row(f"std of {c.name}", _std(c, chosen, std), 0.0) for c in chosen.readings]
    count = len(rows[0])
    for name, row, own in zip(names, rows, stds, strict=True):
        if len(row) != count:
            raise Finger3dError(f"{name}: {len(row)} readings, but {count} of {names[0]}; a set has one of each")
        if len(own) not in (1, count):
            raise Finger3dError(f"std of {name}: {len(own)} for {count} readings; give one for all, or each")
    noises = [tuple(float(own[min(i, len(own) - 1)]) for own in stds) for i in range(count)]
    return [
        estimator(chosen, noise, tolerances).estimate(np.array(reading))
        for reading, noise in zip(zip(*rows, strict=True), noises, strict=True)
    ]


def _std(one: Calibration, every: JointCalibration, std: ArrayLike | Mapping[str, ArrayLike] | None) -> ArrayLike:
    """Return the standard deviation of a reading."""
    if std is None:
        return one.noise
    if isinstance(std, Mapping):
        for name in std:
            if name not in every.names:
                raise Finger3dError(f"std of {name}: no such reading; there are {', '.join(every.names)}")
        return std.get(one.name, one.noise)
    if len({c.kind for c in every.readings}) > 1:
        units = ", ".join(f"{c.name} in {QUANTITIES[c.kind][1].replace('1', 'strain')}" for c in every.readings)
        raise Finger3dError(f"std: the readings have several units ({units}); give one with its name for each")
    return std


def _row(name: str, values: ArrayLike, least: float) -> Float:
    """Return values (m,), all from `least` to `LARGEST_STRAIN`."""
    row = np.atleast_1d(np.asarray(values, dtype=float)).ravel()
    bad = ~((row >= least) & (row <= LARGEST_STRAIN))
    if bad.any():
        i = int(np.argmax(bad))
        where = f" (reading {i + 1} of {len(row)})" if len(row) > 1 else ""
        raise Finger3dError(f"{name} = {row[i]}{where}: must be a finite number from {least:g} to {LARGEST_STRAIN:g}")
    return row
