"""Options of a mold and the checks of their values; the printers and metric screws that it is designed for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from finger3d.errors import Finger3dError

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
    """

    clearance_mm: float
    rim_mm: float
    thinnest_mm: float
    tolerance_mm: float
    layer_mm: float


PRINTERS: dict[str, Printer] = {
    # Extrusion through a nozzle of 0.4 mm: rims of three lines, walls of two, chords below a tenth of a line.
    "fdm-0.4": Printer(0.2, 1.2, 0.8, 0.04, 0.15),
    # Masked stereolithography with pixels of 0.05 mm: walls that survive peeling and washing.
    "sla": Printer(0.1, 1.0, 0.6, 0.02, 0.05),
}
"""Printers by name. Values are the usual ones of such machines."""


ScrewName = Literal["M2", "M2.5", "M3", "M4", "M5", "none"]

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


PEG_MM = 4.0
"""Diameter and length of the pegs; one peg of each pattern is thinner, so that parts fit one way only."""

WALL_MM = 8.0
"""Thickness of the wall around the sensor: it holds a peg with the widest clearance, and a rim around its hole."""

LID_MM = 4.0
"""Thickness of the lid."""


@dataclass(frozen=True, kw_only=True)
class MoldOptions:
    """Dimensions of a mold; lengths in mm.

    Parameters
    ----------
    printer
        Preset of clearance, least wall, chord tolerance and layer height.
    clearance_mm
        Gap all around a peg in its hole; None takes the printer's.
    shrinkage
        Relative shrinkage of lengths when the silicone cures, for instance 0.001; the cavity is larger by
        1 / (1 - shrinkage).
    split
        Axis of the finger along which the halves open. With gauges it must be z, the axis of their strips.
    split_mm
        Where along this axis the halves meet, in the finger's coordinates.
    undercut_mm
        Largest undercut that is accepted: soft silicone can be stretched over a small one.
    pour_mm
        Diameter of the pour hole at the sensor; None chooses what fits on the base, at most 6 and 0.3 times its shorter
        side.
    screw
        Size of the screws that hold the halves together, with nuts; "none" leaves them out.
    parts
        A lid for each pour of a body of several silicones.
    pour_order
        Labels of the solids that are poured, in their order, such as skin,body,core; "body" is the unlabelled one.
        None pours from the contact face towards the base.
    """

    printer: PrinterName = "fdm-0.4"
    # With more clearance a full peg would fit the thin peg's hole.
    clearance_mm: Annotated[float, Ge(0), Le(PEG_MM / 10.0)] | None = None
    shrinkage: Annotated[float, Ge(0), Lt(0.2)] = 0.0
    split: Literal["z", "x"] = "z"
    split_mm: float = 0.0
    undercut_mm: Annotated[float, Ge(0), Le(10)] = 0.0
    pour_mm: Annotated[float, Gt(0), Le(100)] | None = None
    screw: ScrewName = "M3"
    parts: bool = False
    pour_order: str | None = None

    def __post_init__(self) -> None:
        from pydantic import ConfigDict, TypeAdapter, ValidationError  # not for `finger3d --help`

        for name, hint in get_type_hints(MoldOptions, include_extras=True).items():
            value = getattr(self, name)
            try:
                TypeAdapter(hint, config=ConfigDict(strict=True, allow_inf_nan=False)).validate_python(value)
            except ValidationError:
                from finger3d.scene.messages import described

                raise Finger3dError(f"--{name.replace('_', '-')} {value}: must be {described(hint)}") from None
        if self.pour_order and not self.parts:
            raise Finger3dError(f"--pour-order {self.pour_order}: needs --parts, a lid for each pour")

    @property
    def machine(self) -> Printer:
        """The printer's preset."""
        return PRINTERS[self.printer]

    @property
    def rim_mm(self) -> float:
        """Least wall around holes, grooves and slots."""
        return self.machine.rim_mm

    @property
    def gap_mm(self) -> float:
        """Clearance all around pegs."""
        return self.machine.clearance_mm if self.clearance_mm is None else self.clearance_mm

    @property
    def peg_hole_mm(self) -> float:
        """Diameter of the hole of a full peg."""
        return PEG_MM + 2.0 * self.gap_mm

    @property
    def peg_distance_mm(self) -> float:
        """Distance from the cavity to the axis of a peg."""
        return WALL_MM - self.rim_mm - self.peg_hole_mm / 2.0

    @property
    def scale(self) -> float:
        """Ratio of the cavity's lengths to those of the sensor."""
        return 1.0 / (1.0 - self.shrinkage)
