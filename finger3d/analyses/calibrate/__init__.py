"""Calibration of a sensor: readings against the friction coefficient, with its tolerances.

The help of the command line reads the table of tolerances without loading NumPy.
"""

from __future__ import annotations

TOLERANCES: dict[str, tuple[float, str]] = {
    "depth_mm": (0.1, "mm"),
    "E_percent": (5.0, "%"),
    "nu": (0.003, "1"),
    "tilt_deg": (0.5, "degree"),
    "gauge_x_mm": (0.3, "mm"),
    "gauge_y_mm": (0.3, "mm"),
    "gauge_angle_deg": (2.0, "degree"),
    "mesh": (1.0, "error bar"),
    "increments": (1.0, "error bar"),
}
"""Default standard deviation and unit of each quantity: a careful laboratory set-up and a gauge laid by hand.  For mesh
and increments the unit is the error bar of the strain due to them."""

GAUGE_PLACES = {"x_mm": "gauge_x_mm", "y_mm": "gauge_y_mm", "angle_deg": "gauge_angle_deg"}
"""The tolerance of a gauge's place, by the key of the gauge."""
