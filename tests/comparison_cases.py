"""Cases of a comparison that nobody pressed."""

from __future__ import annotations

from finger3d.errors import Outcome
from finger3d.results.summary import FORCE, Case


def case(model: str, width: float, force: float, error: float = 0.0, **more: float) -> Case:
    numbers = {
        FORCE: force, "contact_length_mm": 70.0, "stick_length_mm": 10.0, "friction_sum_N_per_mm": 1.0,
        "friction_along_x_N_per_mm": 1.0, "friction_along_z_N_per_mm": 0.5, "peak_pressure_MPa": 0.3,
    }  # fmt: skip
    return Case(model, width, 2.0, "swept", Outcome.CONVERGED, numbers | more, {FORCE: error})
