"""Mesh of a calibration: refined until it makes less than a tenth of the variance of mu."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from finger3d._cost import CALIBRATION_PRESSES, CALIBRATION_S
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.analyses.calibrate.curve_points import CurvePoints
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import ORDER
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
    """Return the largest share of the mesh in the variance of mu, over the calibrated mu that noise lets tell.

    Where all points stick, a reading hardly depends on mu, and any error outweighs its noise.
    """
    mu = calibration.mu
    told = np.array([any(low <= one <= high for low, high in calibration.usable) for one in mu])
    share = np.broadcast_to(calibration.reductions(mu).get("mesh", 0.0), mu.shape)
    return float(np.max(share, where=told, initial=0.0))


def choose_mesh(
    model: Model,
    automatic: bool,
    calibrated: Callable[[Model], tuple[CurvePoints, Calibration]],
    report: Progress,
    longest_s: float = CALIBRATION_S,
) -> CalibratedMesh:
    """Calibrate on finer and finer meshes, until the mesh matters little or the forecast of the next one is too long.

    Parameters
    ----------
    automatic : whether the mesh may be refined; otherwise a finer one is only named
    calibrated : calibrates a model
    longest_s : forecast time of a calibration, s, beyond which a finer mesh is only named
    """
    found: CalibratedMesh | None = None
    while True:
        try:
            curve, calibration = calibrated(model)
        except Finger3dError as error:
            if found is None:
                raise
            return replace(found, note=f"{found.note}; that mesh was tried: {error}")
        share = mesh_share(calibration)
        if share <= SHARE:
            return CalibratedMesh(curve, calibration, "")
        model = _finer(model, share)
        sizes = f"mesh.size_mm = {model.mesh.size_mm:.3g} and base_size_mm = {model.mesh.base_size_mm:.3g}"
        note = f"the mesh makes up to {100.0 * share:.0f} % of the variance of mu; {sizes} would make it less"
        try:
            seconds = CALIBRATION_PRESSES * without_output_s(forecast(model))
        except Finger3dError as error:  # for want of memory
            return CalibratedMesh(curve, calibration, f"{note}; {error}")
        found = CalibratedMesh(curve, calibration, f"{note}, in about {seconds:.2g} s")
        if not automatic or seconds > longest_s:
            return found
        report.say(f"{found.note}; calibrating again")


def _finer(model: Model, share: float) -> Model:
    """Return the model with edges for which the mesh error has its allowed share, by the order of convergence."""
    excess = share * (1.0 - SHARE) / (SHARE * max(1.0 - share, 1e-6))
    ratio = min(max(_FINER * excess ** (-0.5 / ORDER), _FINEST), _COARSEST)
    mesh = replace(model.mesh, size_mm=ratio * model.mesh.size_mm, base_size_mm=ratio * model.mesh.base_size_mm)
    return replace(model, mesh=mesh)
