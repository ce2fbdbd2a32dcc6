"""Tessellated designs, and faces on given surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.geometry.cad import cut
from finger3d.geometry.tessellate import CadFace, Tessellation, tessellate

EXACT = (0.0, 10.0, -10.0, 5.0, -5.0, 50.0, -50.0)
"""Coordinates that the points of the designs have exactly."""


def body_of(design: Any, symmetry: tuple[str, ...] = (), tolerance: float = 0.01) -> Tessellation:
    """The tessellation of a design, or of its part on one side of the planes of symmetry."""
    return tessellate(cut(design.solid(), symmetry), tolerance, exact=EXACT)


def faces_of(*surfaces: Any) -> tuple[CadFace, ...]:
    """Faces of the contact boundary on these surfaces."""
    return tuple(CadFace("contact", s, np.full(3, -9.0), np.full(3, 9.0), 1.0) for s in surfaces)
