"""Isochoric parts of hyperelastic energies."""

from finger3d.fem.laws.base import IsochoricLaw
from finger3d.fem.laws.ogden import Ogden
from finger3d.fem.laws.polynomial import MooneyRivlin, NeoHooke, Yeoh

__all__ = ["IsochoricLaw", "MooneyRivlin", "NeoHooke", "Ogden", "Yeoh"]
