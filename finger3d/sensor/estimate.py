"""Friction coefficient from readings of a calibrated sensor; this needs no library but NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.sensor.calibration import Calibration, load
from finger3d.sensor.curve import LARGEST_STRAIN, QUANTITIES
from finger3d.sensor.likelihood import Estimate


def estimate(
    calibration: Calibration | str | Path,
    strain: ArrayLike | Mapping[str, ArrayLike],
    std: ArrayLike | Mapping[str, ArrayLike] | None = None,
    tolerances: bool = True,
) -> list[Estimate]:
    """Estimate the friction coefficient from readings.

    Parameters
    ----------
    calibration : what `finger3d.calibrate` returned, or the path of its calibration.json
    strain : one reading, or (m,) of them; of several calibrated readings a mapping with those of each by its name,
        where readings of broken sensors may be left out
    std : standard deviation of each, 0 allowed; None: the noise of the calibration
    tolerances : whether tolerances count; they do not for a sensor whose own curve was measured

    Returns
    -------
    list of Estimate
        For each reading, or set of readings, with ``mu``, ``std`` and ``status``.

    Raises
    ------
    Finger3dError
        For a reading that is no finite number, a name that was not calibrated, or a std that is not from 0 up.
    """
    if isinstance(calibration, str | Path):
        calibration = load(calibration)
    named = _named(calibration, strain)
    names = tuple(name for name in calibration.names if name in named)
    chosen = calibration if len(names) == len(calibration.names) else calibration.of(names)
    rows = [_row(name, named[name], -LARGEST_STRAIN) for name in names]
    stds = [_row(f"std of {name}", values, 0.0) for name, values in zip(names, _stds(chosen, std), strict=True)]
    count = len(rows[0])
    for name, row, std_row in zip(names, rows, stds, strict=True):
        if len(row) != count:
            raise Finger3dError(f"{name}: {len(row)} readings, but {count} of {names[0]}; a set has one of each")
        if len(std_row) not in (1, count):
            raise Finger3dError(f"std of {name}: {len(std_row)} for {count} readings; give one for all, or each")
    noise = np.stack([np.broadcast_to(std_row, count) for std_row in stds], axis=-1)
    return chosen.estimates(np.stack(rows, axis=-1), noise, tolerances)


def _named(calibration: Calibration, readings: ArrayLike | Mapping[str, ArrayLike]) -> Mapping[str, ArrayLike]:
    """Return the readings by name; that of a single calibrated reading may be given without."""
    if not isinstance(readings, Mapping) and len(calibration.names) == 1:
        return {calibration.names[0]: readings}
    if not isinstance(readings, Mapping) or not readings:
        raise Finger3dError(
            f"a reading without a name: {', '.join(calibration.names)} are calibrated, so that every reading needs its "
            f"name, for instance {calibration.names[0]}=0.05"
        )
    for name in readings:
        calibration[name]  # an unknown name raises an error
    return readings


def _stds(calibration: Calibration, std: ArrayLike | Mapping[str, ArrayLike] | None) -> list[ArrayLike]:
    """Return the standard deviations of every reading."""
    if isinstance(std, Mapping):
        for name in std:
            if name not in calibration.names:
                raise Finger3dError(f"std of {name}: no such reading; there are {', '.join(calibration.names)}")
        return [std.get(c.name, c.noise) for c in calibration.readings]
    if std is None:
        return [c.noise for c in calibration.readings]
    if len({c.kind for c in calibration.readings}) > 1:
        units = ", ".join(f"{c.name} in {QUANTITIES[c.kind][1].replace('1', 'strain')}" for c in calibration.readings)
        raise Finger3dError(f"std: the readings have several units ({units}); give one with its name for each")
    return [std for _ in calibration.readings]


def _row(name: str, values: ArrayLike, least: float) -> Float:
    """Return values (m,), all from `least` to `LARGEST_STRAIN`."""
    row = np.atleast_1d(np.asarray(values, dtype=float)).ravel()
    bad = ~((row >= least) & (row <= LARGEST_STRAIN))
    if bad.any():
        i = int(np.argmax(bad))
        where = f" (reading {i + 1} of {len(row)})" if len(row) > 1 else ""
        raise Finger3dError(f"{name} = {row[i]}{where}: must be a finite number from {least:g} to {LARGEST_STRAIN:g}")
    return row
