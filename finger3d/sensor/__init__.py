"""What the sensor is for: from a scene to strain against mu, and from a strain back to mu with its uncertainty."""

from finger3d.sensor.curve import Calibration, Fit, Range, Tolerance
from finger3d.sensor.files import load, save
from finger3d.sensor.inverse import Candidate, Estimate, estimate
from finger3d.sensor.run import MUS, calibrate
from finger3d.sensor.tolerances import TOLERANCES

__all__ = [
    "MUS",
    "TOLERANCES",
    "Calibration",
    "Candidate",
    "Estimate",
    "Fit",
    "Range",
    "Tolerance",
    "calibrate",
    "estimate",
    "load",
    "save",
]
