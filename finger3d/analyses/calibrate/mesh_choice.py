"""Mesh of a calibration: refined until it makes less than a tenth of the variance of mu."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from finger3d._cost import CALIBRATION_S
from finger3d.accuracy.cost import forecast
from finger3d.accuracy.richardson import ORDER
from finger3d.analyses.calibrate.curve_points import CurvePoints
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.progress import Progress
from finger3d.sensor.calibration import Calibration

SHARE = 0.1
"""Largest share of the mesh in the variance of mu."""

_FINER, _FINEST, _COARSEST = 0.9, 0.3, 0.8
"""Edge length of the next mesh relative to that from the order of convergence, and bounds relative to the last mesh."""


@dataclass(frozen=True)
class CalibratedMesh:
    """A calibration, its presses, and a note on its mesh, which is empty if the mesh is fine enough."""

    curve: CurvePoints
    calibration: Calibration
    note: str


def mesh_share(calibration: Calibration) -> float:
    """Return the largest share of the mesh in the variance of mu, over all calibrated mu."""
    return float(np.max(calibration.reductions(calibration.mu).get("mesh", 0.0)))


def choose_mesh(
    model: Model,
    automatic: bool,
    calibrated: Callable[[Model], tuple[CurvePoints, Calibration]],
    report: Progress,
    longest_s: float = CALIBRATION_S,
) -> CalibratedMesh:
    """Calibrate on finer and finer meshes, until the mesh matters little or the next one would take too long.

    Parameters
    ----------
    automatic : whether the mesh may be refined; otherwise a finer one is only named
    calibrated : calibrates a model
    longest_s : estimated time of a calibration, s, beyond which a finer mesh is only named
    """
    found: CalibratedMesh | None = None
    while True:
        begin = time.perf_counter()
        try:
            curve, calibration = calibrated(model)
        except Finger3dError as error:
            if found is None:
                raise
            return replace(found, note=f"{found.note}; that mesh was tried: {error}")
        share = mesh_share(calibration)
        if share <= SHARE:
            return CalibratedMesh(curve, calibration, "")
        finer = _finer(model, share)
        before, after = (float(forecast(m)["total_s"]) for m in (model, finer))
        seconds = (time.perf_counter() - begin) * after / before
        sizes = f"mesh.size_mm = {finer.mesh.size_mm:.3g} and base_size_mm = {finer.mesh.base_size_mm:.3g}"
        note = (
            f"the mesh makes up to {100.0 * share:.0f} % of the variance of mu; {sizes} would make it less, "
            f"in about {seconds:.2g} s"
        )
        found = CalibratedMesh(curve, calibration, note)
        if not automatic or seconds > longest_s:
            return found
        report.say(f"{note}; calibrating again")
        model = finer


def _finer(model: Model, share: float) -> Model:
    """Return the model with edges for which the mesh error has its allowed share, by the order of convergence."""
    excess = share * (1.0 - SHARE) / (SHARE * max(1.0 - share, 1e-6))
    ratio = min(max(_FINER * excess ** (-0.5 / ORDER), _FINEST), _COARSEST)
    mesh = replace(model.mesh, size_mm=ratio * model.mesh.size_mm, base_size_mm=ratio * model.mesh.base_size_mm)
    return replace(model, mesh=mesh)
