"""Options of a mold and the checks of their values; the printers and metric screws that it is designed for."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from annotated_types import Ge, Gt, Le, Lt

from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from pydantic import TypeAdapter


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


_LEAST_WALL_MM = 8.0  # where nothing needs a thicker one


@dataclass(frozen=True, kw_only=True)
class MoldOptions:
    """Dimensions of a mold; lengths in mm.

    Parameters
    ----------
    printer
        Preset of clearance, least wall, chord tolerance and layer height.
    wall_mm
        Thickness of the mold around the sensor; None chooses the least that holds the pegs, at least 8.
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
    peg_mm
        Diameter and length of the pegs; one peg of each pattern is thinner, so that parts fit one way only.
    lid_mm
        Thickness of the lid.
    pour_mm
        Diameter of the pour hole at the sensor; None chooses what fits on the base, at most 6 and 0.3 times its shorter
        side.
    vent_mm
        Diameter of the vents; None chooses what fits on the base, at most 2 and 0.1 times its shorter side.
    screw
        Size of the screws that hold the halves together, with nuts; "none" leaves them out.
    parts
        A lid for each pour of a body of several silicones.
    pour_order
        Labels of the solids that are poured, in their order, such as skin,body,core; "body" is the unlabelled one.
        None pours from the contact face towards the base.
    foil_length_mm
        Length of a gauge's foil where the scene has length_mm = 0.
    foil_thickness_mm
        Thickness of the foil with its carrier, where the scene has no [effects.embedded_gauge].
    foil_width_mm
        Width of the foil along z, where the scene has no [effects.embedded_gauge].
    """

    printer: PrinterName = "fdm-0.4"
    wall_mm: Annotated[float, Gt(0), Le(200)] | None = None
    clearance_mm: Annotated[float, Ge(0)] | None = None
    shrinkage: Annotated[float, Ge(0), Lt(0.2)] = 0.0
    split: Literal["z", "x"] = "z"
    split_mm: float = 0.0
    undercut_mm: Annotated[float, Ge(0), Le(10)] = 0.0
    peg_mm: Annotated[float, Gt(0), Le(50)] = 4.0
    lid_mm: Annotated[float, Gt(0), Le(100)] = 4.0
    pour_mm: Annotated[float, Gt(0), Le(100)] | None = None
    vent_mm: Annotated[float, Gt(0), Le(50)] | None = None
    screw: ScrewName = "M3"
    parts: bool = False
    pour_order: str | None = None
    foil_length_mm: Annotated[float, Gt(0), Le(500)] = 5.0
    foil_thickness_mm: Annotated[float, Gt(0), Le(10)] = 0.1
    foil_width_mm: Annotated[float, Gt(0), Le(500)] = 3.0

    def __post_init__(self) -> None:
        from pydantic import ValidationError  # not for `finger3d --help`

        for name, (hint, adapter) in _adapters().items():
            try:
                adapter.validate_python(getattr(self, name))
            except ValidationError:
                from finger3d.scene.messages import described

                raise _refused(name, getattr(self, name), described(hint)) from None
        # With more clearance a full peg would fit the thin peg's hole.
        if self.clearance_mm is not None and self.clearance_mm > self.peg_mm / 10.0:
            raise _refused("clearance_mm", self.clearance_mm, f"from 0 to a tenth of the peg, {self.peg_mm / 10:g}")
        if self.lid_mm < 2.0 * self.rim_mm:
            raise _refused("lid_mm", self.lid_mm, f"at least {2.0 * self.rim_mm:g}, or the lid bends")
        least = self.least_wall_mm
        if self.wall_mm is not None and self.wall_mm < least - 1e-9:
            raise _refused(
                "wall_mm",
                self.wall_mm,
                f"at least {least:g}, to hold a peg of {self.peg_mm:g} mm with {self.rim_mm:g} mm around its hole; "
                "or a thinner --peg-mm",
            )
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
        return min(self.machine.clearance_mm, self.peg_mm / 10.0) if self.clearance_mm is None else self.clearance_mm

    @property
    def peg_hole_mm(self) -> float:
        """Diameter of the hole of a full peg."""
        return self.peg_mm + 2.0 * self.gap_mm

    @property
    def least_wall_mm(self) -> float:
        """Least thickness of the wall."""
        return round(self.peg_hole_mm + 2.0 * self.rim_mm, 9)

    @property
    def around_mm(self) -> float:
        """Thickness of the wall."""
        return max(self.least_wall_mm, _LEAST_WALL_MM) if self.wall_mm is None else self.wall_mm

    @property
    def peg_distance_mm(self) -> float:
        """Distance from the cavity to the axis of a peg."""
        return self.around_mm - self.rim_mm - self.peg_hole_mm / 2.0

    @property
    def scale(self) -> float:
        """Ratio of the cavity's lengths to those of the sensor."""
        return 1.0 / (1.0 - self.shrinkage)

    @property
    def hole_depth_mm(self) -> float:
        """Depth of a peg's hole."""
        return self.peg_mm + self.gap_mm


@functools.cache
def _adapters() -> dict[str, tuple[Any, TypeAdapter[Any]]]:
    """Return the type of every option, and its check."""
    from pydantic import ConfigDict, TypeAdapter

    config = ConfigDict(strict=True, allow_inf_nan=False)
    hints = get_type_hints(MoldOptions, include_extras=True)
    return {name: (hint, TypeAdapter(hint, config=config)) for name, hint in hints.items()}


def _refused(name: str, value: object, allowed: str) -> Finger3dError:
    return Finger3dError(f"--{name.replace('_', '-')} {value}: must be {allowed}")
