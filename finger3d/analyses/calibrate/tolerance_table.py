"""What a calibration takes to be not known exactly: a table apart, which the help of the command line reads."""

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
"""Standard deviations assumed unless others are given: a careful laboratory set-up and a hand-laid gauge; of the mesh
its error bar, from a coarser companion, and of the increments theirs, from presses of more or fewer."""
