"""The body of an object, as it is meshed where the object is elastic: a design turned towards the finger."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from finger3d._types import Float, freeze_arrays
from finger3d.geometry.design import Design

UPSIDE_DOWN = np.diag([1.0, -1.0, 1.0])
"""Reflection that turns a design's contact face down and leaves its symmetry planes."""

CROSSWISE = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
"""Rotation that turns a design's contact face down and its width along x."""

HALF_TURN = np.diag([-1.0, -1.0, 1.0])
"""Half a turn about z."""


@dataclass(frozen=True, kw_only=True)
class HeldBody:
    """Body of an object as a design, which is held on its base.

    A point p (3,) of the design is at ``turn @ (p - origin) + place`` in the scene.

    Attributes
    ----------
    design : its contact face is that of the object
    turn : (3, 3) array
        One of `UPSIDE_DOWN`, `CROSSWISE` and `HALF_TURN`.
    origin, place : (3,) arrays, mm
    mesher : of a solid
    is_whole : whether it is meshed whole even where only a part of the finger is
    """

    design: Design
    turn: Float = field(default_factory=UPSIDE_DOWN.copy)
    origin: Float = field(default_factory=lambda: np.zeros(3))
    place: Float = field(default_factory=lambda: np.zeros(3))
    mesher: Literal["ftetwild", "swept"] = "swept"
    is_whole: bool = False

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def to_design(self, points: Float) -> Float:
        """Return points (n, 3) of the scene in the coordinates of the design."""
        return (points - self.place) @ self.turn + self.origin

    def to_scene(self, points: Float) -> Float:
        """Return points (n, d) of the design in the scene; those of a section lie in its plane."""
        d = points.shape[1]
        return np.asarray((points - self.origin[:d]) @ self.turn[:d, :d].T + self.place[:d])

    @property
    def is_crosswise(self) -> bool:
        """Whether x and z change places."""
        return bool(self.turn[0, 2])

    @property
    def is_reflected(self) -> bool:
        """Whether the body is a mirror image of the design, whose cells must be turned."""
        return bool(np.linalg.det(self.turn) < 0.0)
