"""Solids of which a mold is made: boxes, cylinders, pegs, hexagons, and the features that parts gain and lose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from finger3d._types import Float

if TYPE_CHECKING:
    from build123d import Shape, Solid


Place = tuple[float, float, float]
Axis = Literal["y", "z", "-z"]

_ROTATIONS = {
    "z": (0, 0, 0),
    "-z": (180, 0, 0),
    "y": (-90, 0, 0),
}  # degrees that turn z onto the axis

LEAD_IN = 0.15
"""Height and width of the chamfer at the tip of a peg, over its diameter."""


def between(low: Sequence[float] | Float, high: Sequence[float] | Float) -> Solid:
    """Return the box between two corners."""
    from build123d import Box, Pos

    first, last = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return Pos(*map(float, 0.5 * (first + last))) * Box(*map(float, last - first))


def cylinder(start: Place, diameter: float, length: float, axis: Axis) -> Solid:
    """Return the cylinder that starts at a point and runs along an axis."""
    from build123d import Align, Cylinder

    return _placed(start, axis) * Cylinder(diameter / 2.0, length, align=(Align.CENTER, Align.CENTER, Align.MIN))


def cone(start: Place, first: float, last: float, length: float, axis: Axis) -> Solid:
    """Return the frustum that starts at a point with the diameter `first` and ends with `last`."""
    from build123d import Align, Cone

    if abs(first - last) < 1e-9:
        return cylinder(start, first, length, axis)
    return _placed(start, axis) * Cone(first / 2.0, last / 2.0, length, align=(Align.CENTER, Align.CENTER, Align.MIN))


def peg(start: Place, diameter: float, length: float, axis: Axis) -> Solid:
    """Return a cylinder whose tip has a lead-in chamfer of 45 degrees."""
    chamfer = LEAD_IN * diameter
    tip = _along(start, length - chamfer, axis)
    return one(
        cylinder(start, diameter, length - chamfer, axis) + cone(tip, diameter, 0.7 * diameter, chamfer, axis), "peg"
    )


def hexagon(start: Place, flats: float, length: float, axis: Axis) -> Solid:
    """Return the hexagonal prism that starts at a point; `flats` is its width across the flats."""
    from build123d import RegularPolygon, extrude

    prism = extrude(RegularPolygon(flats / 2.0, 6, major_radius=False), amount=length)
    return (_placed(start, axis) * prism).solids()[0]


def _placed(start: Place, axis: Axis):  # type: ignore[no-untyped-def]  # a build123d location
    from build123d import Pos, Rot

    return Pos(*map(float, start)) * Rot(*_ROTATIONS[axis])


def _along(start: Place, distance: float, axis: Axis) -> Place:
    moved = list(start)
    moved["xyz".index(axis[-1])] += -distance if axis.startswith("-") else distance
    return moved[0], moved[1], moved[2]


def one(shape: Shape, name: str, advice: str = "change the body, or choose another --split") -> Solid:
    """Return the one valid solid of a shape.

    Raises
    ------
    Finger3dError
        If there are several solids, none, or an invalid one.
    """
    from finger3d.errors import Finger3dError

    solids = shape.solids()
    if len(solids) != 1 or not solids[0].is_valid:
        raise Finger3dError(f"mold: {name} falls into {len(solids)} pieces; {advice}")
    return solids[0]


def common(a: Shape, b: Shape) -> float:
    """Return the common volume of two solids, mm3."""
    shared = a & b
    return sum(float(s.volume) for s in shared.solids()) if shared is not None else 0.0


@dataclass(frozen=True)
class Feature:
    """Solids that are added to half_a, half_b and lid, and solids that are then cut from them, by the part's name."""

    add: Mapping[str, Sequence[Solid]] = field(default_factory=dict)
    cut: Mapping[str, Sequence[Solid]] = field(default_factory=dict)


def part(name: str, base: Solid, features: Sequence[Feature], label: str) -> Solid:
    """Return a part: a box, with what features add to it, without what they cut from it."""
    add = [solid for feature in features for solid in feature.add.get(name, ())]
    cut = [solid for feature in features for solid in feature.cut.get(name, ())]
    whole = base + add if add else base
    return one(whole - cut if cut else whole, label)
