"""Printers and metric screws: the dimensions that a mold is designed for, mm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

PrinterName = Literal["fdm-0.4", "sla"]


@dataclass(frozen=True)
class Printer:
    """What a printer can make; lengths in mm.

    Attributes
    ----------
    clearance_mm : gap all around a peg in its hole
    rim_mm : least wall around holes, grooves and slots, by design
    thinnest_mm : thinnest wall that prints at all; every part is checked against it
    tolerance_mm : largest distance of triangles from the CAD surface
    layer_mm : height of a layer
    bed : length x width x height
    """

    clearance_mm: float
    rim_mm: float
    thinnest_mm: float
    tolerance_mm: float
    layer_mm: float
    bed: str


PRINTERS: dict[str, Printer] = {
    # Extrusion through a nozzle of 0.4 mm: rims of three lines, walls of two, chords below a tenth of a line.
    "fdm-0.4": Printer(0.2, 1.2, 0.8, 0.04, 0.15, "220x220x250"),
    # Masked stereolithography with pixels of 0.05 mm: walls that survive peeling and washing.
    "sla": Printer(0.1, 1.0, 0.6, 0.02, 0.05, "143x89x175"),
}
"""Printers by name. Values are the usual ones of such machines; a fit coupon (`--coupon`) measures one's own."""


ScrewName = Literal["M2", "M2.5", "M3", "M4", "M5"]

STANDARD_LENGTHS_MM = (6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 80, 90, 100, 110, 120, 130, 140)
"""Lengths of screws that are sold, ISO 888."""


@dataclass(frozen=True)
class Screw:
    """A metric screw.

    Attributes
    ----------
    hole_mm : clearance hole, ISO 273, medium
    flats_mm : width across the flats of the nut, ISO 4032
    nut_mm : height of the nut, ISO 4032
    head_mm : diameter of the head, ISO 4762
    """

    hole_mm: float
    flats_mm: float
    nut_mm: float
    head_mm: float

    @property
    def corners_mm(self) -> float:
        """Width across the corners of the nut."""
        return self.flats_mm / math.cos(math.pi / 6.0)


SCREWS: dict[str, Screw] = {
    "M2": Screw(2.4, 4.0, 1.6, 3.8),
    "M2.5": Screw(2.9, 5.0, 2.0, 4.5),
    "M3": Screw(3.4, 5.5, 2.4, 5.5),
    "M4": Screw(4.5, 7.0, 3.2, 7.0),
    "M5": Screw(5.5, 8.0, 4.7, 8.5),
}


def standard_length(thickness_mm: float) -> float:
    """Return the longest standard length (mm) that does not reach through a mold of this thickness."""
    fitting = [length for length in STANDARD_LENGTHS_MM if length <= thickness_mm]
    return float(fitting[-1]) if fitting else float(STANDARD_LENGTHS_MM[0])
