"""A test button of the same batch of silicone, and the scene of the press that determines its Young's modulus.

The button is a cylinder of the standard sizes of compression tests, ISO 815-1: 29 mm in diameter and 12.5 mm high
(type A), or 13 mm and 6.3 mm (type B). It is cast in a ring on a floor, levelled with a straight edge, glued to a
plate with its lower face, and pressed by a greased plate. The scene models just that: the base is fixed, and the
plate has no friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d._types import Tree
from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import cylinder, one

if TYPE_CHECKING:
    from build123d import Solid

SIZES = ((29.0, 12.5), (13.0, 6.3))
"""Diameters and heights, mm, of the types A and B."""

_COMPRESSION = 0.1  # depth of the press over the height, where rubbers are still nearly linear
_STEPS = 5
_RANGE = 5.0  # bounds of the search: Young's modulus over and times this factor
_RECESS_MM = 1.5  # of the floor, in which the ring stands
_EDGE = 0.1  # edge length of the mesh over the diameter
_RING_RIMS = 2.5  # wall of the ring over the least rim


@dataclass(frozen=True)
class Button:
    """Diameter and height of a button, mm."""

    diameter_mm: float
    height_mm: float

    @property
    def volume_mm3(self) -> float:
        """Volume."""
        return math.pi * self.diameter_mm**2 / 4.0 * self.height_mm


def button_for(silicone_mm3: float) -> Button:
    """Return type A if it needs no more silicone than the fingers, else type B."""
    large, small = (Button(*size) for size in SIZES)
    return large if large.volume_mm3 <= silicone_mm3 else small


def button_parts(button: Button, options: MoldOptions) -> dict[str, Solid]:
    """Return the ring in which the button is cast and the floor on which it stands, as they lie on the bed (z up)."""
    d, h = button.diameter_mm * options.scale, button.height_mm * options.scale
    rim = options.rim_mm
    outer = d + 2.0 * _RING_RIMS * rim
    ring = cylinder((0.0, 0.0, 0.0), outer, h + _RECESS_MM, "z") - cylinder((0.0, 0.0, 0.0), d, h + _RECESS_MM, "z")
    recess, plate = outer + 2.0 * options.gap_mm, 2.0 * rim
    # A step in the floor fills the ring as far as the recess is deep, so that the button is as high as it should be.
    floor = cylinder((0.0, 0.0, 0.0), recess + 4.0 * rim, plate + _RECESS_MM, "z")
    floor -= cylinder((0.0, 0.0, plate), recess, _RECESS_MM, "z")
    floor += cylinder((0.0, 0.0, plate), d - 2.0 * options.gap_mm, _RECESS_MM, "z")
    return {"button_ring": one(ring, "button_ring"), "button_floor": one(floor, "button_floor")}


def button_solid(button: Button) -> Solid:
    """Return the button on y = 0, y up."""
    return cylinder((0.0, 0.0, 0.0), button.diameter_mm, button.height_mm, "y")


def button_scene(button: Button, title: str, E_MPa: float, nu: float) -> Tree:
    """Return the scene of the button's press; the measured curve goes down to a tenth of the height."""
    return {
        "title": f"Test button {button.diameter_mm:g} x {button.height_mm:g} mm: {title}"[:200],
        "finger": {"geometry": "button.step"},
        "material": {"E_MPa": E_MPa, "nu": nu},
        "object": {"shape": "plane"},
        "press": {"depth_mm": round(_COMPRESSION * button.height_mm, 3), "steps": _STEPS},
        "mesh": {"size_mm": round(_EDGE * button.diameter_mm, 3), "base_size_mm": round(_EDGE * button.diameter_mm, 3)},
    }


def identify_command(folder: str, E_MPa: float) -> str:
    """Return the command that turns the measured press, button.csv, into Young's modulus of the batch."""
    return (
        f"finger3d identify {folder}/button.toml --measured {folder}/button.csv "
        f"--free material.E_MPa={E_MPa / _RANGE:.3g}:{E_MPa * _RANGE:.3g} --out {folder}/button"
    )
