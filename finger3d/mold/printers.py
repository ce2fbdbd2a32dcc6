"""Printers: the clearances, walls, layers and bed that a mold is designed for."""

from __future__ import annotations

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
