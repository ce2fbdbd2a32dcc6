"""Half sections (x >= 0) of extruded designs: a contact curve from the axis to the edge, and a wall to the base."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float


@dataclass(frozen=True)
class Arc:
    """A circular arc centred on x = 0 (mm), from its top to `angle` radians down the side."""

    radius_mm: float
    centre_y_mm: float
    angle: float

    def at(self, u: Float) -> Float:
        """Return points (n, 2), mm, at arc-length fractions u (n,) in [0, 1]; u = 0 is the top, exactly on x = 0."""
        t = np.asarray(u, dtype=float) * self.angle
        return np.stack([self.radius_mm * np.sin(t), self.centre_y_mm + self.radius_mm * np.cos(t)], axis=-1)

    @property
    def length_mm(self) -> float:
        """Length of the curve."""
        return self.radius_mm * self.angle

    def height(self, x: Float) -> Float:
        """Return the height y (n,) at x (n,), mm; nan beyond the radius."""
        with np.errstate(invalid="ignore"):
            return self.centre_y_mm + np.sqrt(self.radius_mm**2 - np.asarray(x, dtype=float) ** 2)


@dataclass(frozen=True)
class Flat:
    """A horizontal line at y = `y_mm`, from x = 0 to `half_length_mm`."""

    half_length_mm: float
    y_mm: float

    def at(self, u: Float) -> Float:
        """Return points (n, 2), mm, at fractions u (n,) in [0, 1]."""
        u = np.asarray(u, dtype=float)
        return np.stack([u * self.half_length_mm, np.full_like(u, self.y_mm)], axis=-1)

    @property
    def length_mm(self) -> float:
        """Length of the line."""
        return self.half_length_mm

    def height(self, x: Float) -> Float:
        """Return the height y (n,) at x (n,), mm."""
        return np.full_like(np.asarray(x, dtype=float), self.y_mm)


@dataclass(frozen=True)
class Section:
    """The part x >= 0 of a section symmetric about x = 0; base on y = 0, wall at x = half_length.

    Attributes
    ----------
    contact : curve from (0, height) to (half_length, edge_height)
    half_length_mm : x of the wall
    edge_height_mm : height of the wall; 0 if the contact curve runs down to the base
    area_mm2 : closed-form area of the whole section (both halves)
    """

    contact: Arc | Flat
    half_length_mm: float
    edge_height_mm: float
    area_mm2: float

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return float(self.contact.at(np.zeros(1))[0, 1])

    def top(self, x: Float, z: Float, width_mm: float) -> Float:
        """Return the height y (n,) of the contact surface extruded to `width_mm`; nan outside the footprint."""
        x, z = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
        # Points on the rim are inside in spite of round-off.
        inside = (np.abs(x) <= self.half_length_mm * (1 + 1e-12)) & (np.abs(z) <= 0.5 * width_mm * (1 + 1e-12))
        return np.where(inside, self.contact.height(np.clip(x, -self.half_length_mm, self.half_length_mm)), np.nan)


def cylinder_section(radius_mm: float, half_length_mm: float, edge_height_mm: float) -> Section:
    """Section under a cylinder: half length <= radius, edge at `edge_height_mm` above the base (mm)."""
    angle = math.asin(min(1.0, half_length_mm / radius_mm))
    drop = radius_mm * math.cos(angle) if half_length_mm < radius_mm else 0.0
    area = 2.0 * half_length_mm * edge_height_mm + radius_mm**2 * (angle - math.sin(angle) * math.cos(angle))
    return Section(Arc(radius_mm, edge_height_mm - drop, angle), half_length_mm, edge_height_mm, area)


def block_section(half_length_mm: float, height_mm: float) -> Section:
    """Rectangle 2 half_length x height (mm) with a flat contact face."""
    return Section(Flat(half_length_mm, height_mm), half_length_mm, height_mm, 2.0 * half_length_mm * height_mm)
