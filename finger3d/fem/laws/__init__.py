"""Isochoric parts of hyperelastic energies."""

from finger3d.fem.laws.base import IsochoricLaw
from finger3d.fem.laws.mooney_rivlin import MooneyRivlin
from finger3d.fem.laws.neo_hooke import NeoHooke
from finger3d.fem.laws.ogden import Ogden
from finger3d.fem.laws.yeoh import Yeoh

__all__ = ["IsochoricLaw", "MooneyRivlin", "NeoHooke", "Ogden", "Yeoh"]
