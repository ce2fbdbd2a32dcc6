"""Options of a mold and the checks of their values."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields
from typing import Literal

from finger3d.errors import Finger3dError

RIM_MM = 1.2
"""Least wall around a peg, a hole or a slot: three lines of a 0.4 mm nozzle."""


@dataclass(frozen=True, kw_only=True)
class MoldOptions:
    """Dimensions of a mold; lengths in mm.

    Parameters
    ----------
    wall_mm
        Thickness of the mold around the sensor.
    clearance_mm
        Gap all around a peg in its hole.
    shrinkage
        Relative shrinkage of lengths when the silicone cures, for instance 0.001; the cavity is larger by
        1 / (1 - shrinkage).
    split
        Axis of the finger along which the halves open. With gauges it must be z, the axis of their strips.
    split_mm
        Where along this axis the halves meet, in the finger's coordinates.
    peg_mm
        Diameter and length of the pegs; one peg of each pattern is thinner, so that parts fit one way only.
    lid_mm
        Thickness of the lid.
    pour_mm
        Diameter of the pour hole at the sensor; None chooses 0.3 times the base's shorter side, at most 6.
    vent_mm
        Diameter of the two vents; None chooses 0.1 times the base's shorter side, at most 2.
    foil_length_mm
        Length of a gauge's foil where the scene has length_mm = 0.
    foil_thickness_mm
        Thickness of the foil with its carrier, where the scene has no [effects.embedded_gauge].
    foil_width_mm
        Width of the foil along z, where the scene has no [effects.embedded_gauge].
    slot_gap_mm
        Gap on either side of the strip that carries a foil, in its slot.
    bed
        Size of the printer, length x width x height in mm.
    """

    wall_mm: float = 8.0
    clearance_mm: float = 0.2
    shrinkage: float = 0.0
    split: Literal["z", "x"] = "z"
    split_mm: float = 0.0
    peg_mm: float = 4.0
    lid_mm: float = 4.0
    pour_mm: float | None = None
    vent_mm: float | None = None
    foil_length_mm: float = 5.0
    foil_thickness_mm: float = 0.1
    foil_width_mm: float = 3.0
    slot_gap_mm: float = 0.15
    bed: str = "220x220x250"

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, (int, float)) and not math.isfinite(value):
                raise _refused(f.name, value, "a number")
        for name in ("wall_mm", "peg_mm", "lid_mm", "foil_length_mm", "foil_thickness_mm", "foil_width_mm"):
            self._within(name, 0.0, math.inf, "above 0", open_low=True)
        for name in ("pour_mm", "vent_mm"):
            if getattr(self, name) is not None:
                self._within(name, 0.0, math.inf, "above 0", open_low=True)
        if not 0.0 <= self.shrinkage < 0.2:
            raise _refused("shrinkage", self.shrinkage, "a share from 0 up to 0.2: 0.001 is a tenth of a percent")
        # With more clearance a full peg would fit the thin peg's hole.
        self._within("clearance_mm", 0.0, self.peg_mm / 10.0, f"from 0 to a tenth of the peg, {self.peg_mm / 10:g}")
        self._within("slot_gap_mm", 0.0, 1.0, "from 0 to 1")
        self._within("lid_mm", RIM_MM, math.inf, f"at least {RIM_MM:g}, or the lid bends")
        if self.split not in ("z", "x"):
            raise _refused("split", self.split, "z or x")
        need = self.peg_mm + 2.0 * self.clearance_mm + 2.0 * RIM_MM
        if self.wall_mm < need:
            raise _refused(
                "wall_mm",
                self.wall_mm,
                f"at least {need:g}, to hold a peg of {self.peg_mm:g} mm with {RIM_MM:g} mm around its hole; "
                "or a thinner --peg-mm",
            )
        _ = self.bed_mm

    def _within(self, name: str, low: float, high: float, allowed: str, open_low: bool = False) -> None:
        value = getattr(self, name)
        if not low <= value <= high or (open_low and value == low):
            raise _refused(name, value, allowed)

    @property
    def bed_mm(self) -> tuple[float, float, float]:
        """Length, width and height of the printer."""
        found = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*[x*]\s*(\d+(?:\.\d*)?)\s*[x*]\s*(\d+(?:\.\d*)?)\s*", self.bed)
        sizes = tuple(float(text) for text in found.groups()) if found else (0.0,)
        if min(sizes) <= 0.0:
            raise _refused("bed", self.bed, "three sizes in mm, such as 220x220x250")
        return sizes[0], sizes[1], sizes[2]

    @property
    def scale(self) -> float:
        """Ratio of the cavity's lengths to those of the sensor."""
        return 1.0 / (1.0 - self.shrinkage)

    @property
    def hole_depth_mm(self) -> float:
        """Depth of a peg's hole."""
        return self.peg_mm + self.clearance_mm


def _refused(name: str, value: object, allowed: str) -> Finger3dError:
    return Finger3dError(f"--{name.replace('_', '-')} {value}: must be {allowed}")
