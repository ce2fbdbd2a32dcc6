"""Calibration curves of readings, and the friction coefficient from readings with its uncertainty."""

from finger3d.sensor.curve import Calibration, Fit, Range, Tolerance
from finger3d.sensor.estimate import estimate
from finger3d.sensor.files import load, save
from finger3d.sensor.inverse import Candidate, Estimate
from finger3d.sensor.joint import JointCalibration
from finger3d.sensor.likelihood import JointEstimate

__all__ = [
    "Calibration",
    "Candidate",
    "Estimate",
    "Fit",
    "JointCalibration",
    "JointEstimate",
    "Range",
    "Tolerance",
    "estimate",
    "load",
    "save",
]
