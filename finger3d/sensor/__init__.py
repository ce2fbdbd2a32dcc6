"""Calibration curves of readings, and the friction coefficient from readings with its uncertainty."""

from finger3d.sensor.calibration import Calibration, load, save
from finger3d.sensor.curve import Fit, ReadingCurve, Tolerance
from finger3d.sensor.given_readings import estimate
from finger3d.sensor.likelihood import Estimate

__all__ = ["Calibration", "Estimate", "Fit", "ReadingCurve", "Tolerance", "estimate", "load", "save"]
