"""A block on objects that yield, and half a ball of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Plane
from tests.bodies import ball
from tests.models import block


def pad(**changes: Any) -> Model:
    """A block 6 mm wide on a plane, unless something else is given."""
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=6.0)
    usual = {"mesh": MeshOptions(0.6, 1.2, "swept"), "object": Plane(), "friction": Coulomb(0.3)}
    return block(**{"design": body, "legs": (Leg(0.3, steps=2),)} | usual | changes)


def half_ball(radius: float) -> Triangles:
    """The lower half of a ball, closed by a level lid."""
    whole = ball(radius, 28, 56)
    keep = whole.corners[:, :, 1].max(axis=1) <= 1e-9
    rim = np.flatnonzero(np.abs(whole.points[:, 1]) < 1e-9)
    rim = rim[np.argsort(np.arctan2(whole.points[rim, 2], whole.points[rim, 0]))]
    lid = np.stack([np.full(len(rim), len(whole.points)), np.roll(rim, -1), rim], axis=1)
    return Triangles(np.vstack([whole.points, [[0.0, 0.0, 0.0]]]), np.vstack([whole.faces[keep], lid]))
