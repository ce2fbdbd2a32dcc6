"""Triangulated surfaces of imported bodies and objects: heights, distances, and what makes a surface unusable."""

from finger3d.triangles.mistakes import crossings, mistake
from finger3d.triangles.surface import Triangles

__all__ = ["Triangles", "crossings", "mistake"]
