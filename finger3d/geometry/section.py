"""Half sections (x >= 0) of extruded designs: a contact curve from the axis to the edge, and a wall to the base.

A section may consist of parts: a layer under the contact curve, and a rectangular core that stands on the base.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

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

    def fraction(self, x: Float) -> Float:
        """Return the arc-length fractions (n,) at x (n,), mm, of points between the axis and the end of the curve."""
        u: Float = np.arcsin(np.clip(np.asarray(x, dtype=float) / self.radius_mm, 0.0, 1.0)) / self.angle
        return np.minimum(u, 1.0)


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

    def fraction(self, x: Float) -> Float:
        """Return the fractions (n,) at x (n,), mm, of points between the axis and the end of the line."""
        return np.minimum(np.asarray(x, dtype=float) / self.half_length_mm, 1.0)


@dataclass(frozen=True)
class Core:
    """A rectangle that stands on the middle of the base, mm."""

    half_length_mm: float
    height_mm: float
    label: str = "core"

    @property
    def area_mm2(self) -> float:
        """Area of both halves."""
        return 2.0 * self.half_length_mm * self.height_mm


@dataclass(frozen=True)
class Layer:
    """A layer under the contact curve: the part of a section outside the section `below`."""

    below: Section
    label: str = "skin"


@dataclass(frozen=True)
class Section:
    """The part x >= 0 of a section symmetric about x = 0; base on y = 0, wall at x = half_length.

    Attributes
    ----------
    contact : curve from (0, height) to (half_length, edge_height)
    half_length_mm : x of the wall
    edge_height_mm : height of the wall; 0 if the contact curve runs down to the base
    area_mm2 : closed-form area of the whole section (both halves)
    layer : layer under the contact curve, if there is one
    core : core in a section without a layer; a section with one has its core in the section below the layer
    """

    contact: Arc | Flat
    half_length_mm: float
    edge_height_mm: float
    area_mm2: float
    layer: Layer | None = None
    core: Core | None = None

    @property
    def height_mm(self) -> float:
        """Height on the axis."""
        return float(self.contact.at(np.zeros(1))[0, 1])

    @property
    def inner(self) -> Section:
        """The section below the layer, or this one if there is no layer."""
        return self.layer.below if self.layer else self

    @property
    def areas_mm2(self) -> Mapping[str, float]:
        """Area of each part (both halves) by its label; "" is the main body."""
        inner = self.inner
        parts = {self.layer.label: self.area_mm2 - inner.area_mm2} if self.layer else {}
        if inner.core:
            parts[inner.core.label] = inner.core.area_mm2
        return {"": self.area_mm2 - sum(parts.values()), **parts}

    @property
    def part_labels(self) -> tuple[str, ...]:
        """Labels of the parts beside the main body, in the order of their numbers."""
        return tuple(label for label in self.areas_mm2 if label)

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


def with_layer(section: Section, thickness_mm: float) -> Section:
    """Return a section with a layer of constant thickness (mm) under its contact curve, from wall to wall.

    Where the contact curve runs down to the base, the layer ends on the base.
    See `largest_layer_mm`.
    """
    contact, length, edge = section.contact, section.half_length_mm, section.edge_height_mm
    if isinstance(contact, Flat):
        below = block_section(length, edge - thickness_mm)
        return replace(section, layer=Layer(below))
    radius, centre = contact.radius_mm - thickness_mm, contact.centre_y_mm
    if edge == 0.0:
        length = math.sqrt(radius**2 - centre**2)
    else:
        edge = centre + math.sqrt(radius**2 - length**2)
    return replace(section, layer=Layer(cylinder_section(radius, length, edge)))


def largest_layer_mm(section: Section) -> float:
    """Return the thickness (mm) that a layer must stay below."""
    contact = section.contact
    if isinstance(contact, Flat):
        return section.edge_height_mm
    # Its inner arc is to end on the walls above the base, or without walls on the base.
    foot = 0.0 if section.edge_height_mm == 0.0 else section.half_length_mm
    return contact.radius_mm - math.hypot(foot, min(contact.centre_y_mm, 0.0))


def with_core(section: Section, core: Core) -> Section:
    """Return a section with a core that stands on its base, below its layer; see `largest_core_mm`."""
    inner = replace(section.inner, core=core)
    return replace(section, layer=replace(section.layer, below=inner)) if section.layer else inner


def largest_core_mm(section: Section, half_length_mm: float) -> float:
    """Return the height (mm) that a core of this half length must stay below."""
    return float(section.inner.contact.height(np.array(half_length_mm)))
