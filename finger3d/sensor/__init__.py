"""Calibration curves of gauges, and the friction coefficient from a strain with its uncertainty."""

from finger3d.sensor.curve import Calibration, Fit, Range, Tolerance
from finger3d.sensor.files import load, save
from finger3d.sensor.inverse import Candidate, Estimate, estimate

__all__ = [
    "Calibration",
    "Candidate",
    "Estimate",
    "Fit",
    "Range",
    "Tolerance",
    "estimate",
    "load",
    "save",
]
