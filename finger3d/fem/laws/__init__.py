"""Laws of materials: linear elasticity, and isochoric parts of hyperelastic energies."""

from finger3d.fem.laws.base import IsochoricLaw
from finger3d.fem.laws.invariants import MooneyRivlin, NeoHooke, Yeoh
from finger3d.fem.laws.ogden import Ogden

__all__ = ["IsochoricLaw", "MooneyRivlin", "NeoHooke", "Ogden", "Yeoh"]
