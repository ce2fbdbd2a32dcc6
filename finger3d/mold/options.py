"""Options of a mold and the checks of their values; the printers and metric screws that it is designed for."""

from __future__ import annotations

import functools
import math
import re
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


BAND_DEPTH_MM = 1.5
"""Depth of the grooves for rubber bands."""

TONGUE_MM = 2.0
"""Width of the tongue along the parting faces."""

TONGUE_HEIGHT_MM = 1.5
"""Height of the tongue."""

CORD_SQUEEZE, CORD_GROOVE = 0.8, 1.3
"""Depth and width of the groove of a sealing cord over the cord's diameter, as for O-rings: a fifth is squeezed, and
the groove is three quarters full."""

_LEAST_WALL_MM = 8.0  # where nothing needs a thicker one


@dataclass(frozen=True, kw_only=True)
class MoldOptions:
    """Dimensions of a mold; lengths in mm.

    Parameters
    ----------
    printer
        Preset of clearance, least wall, chord tolerance, layer height and bed.
    wall_mm
        Thickness of the mold around the sensor; None chooses the least that holds pegs and seal, at least 8.
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
        Diameter of the pour hole at the sensor; None chooses 0.3 times the base's shorter side, at most 6.
    vent_mm
        Diameter of the vents; None chooses 0.1 times the base's shorter side, at most 2.
    riser
        Volume of the riser, a cup on the lid from which silicone flows as bubbles rise, over that of the cavity; 0.03
        to 0.05 is usual.
    fasten
        Screws with nuts through the halves, grooves for rubber bands around them, or none.
    screw
        Size of the screws.
    band_mm
        Width of the rubber bands.
    seal
        Seal along the parting faces: a printed tongue in a groove, a groove for a cord of silicone, or none.
    cord_mm
        Diameter of the sealing cord.
    plugs
        Plugs that close the slots of the gauges' strips.
    pry
        Notches for a screwdriver that parts the halves and lifts the lid.
    carrier
        A printed carrier in place of the lid: silicone grips its holes, and it stays on the finger as its base.
    carrier_mm
        Thickness of the carrier.
    key_mm
        Diameter of the carrier's holes at the sensor; outside they are 1.7 times wider.
    parts
        A mold for each pour of a body of several solids.
    pour_order
        Labels of the solids in the order of their pours, such as skin,body,core; "body" is the unlabelled one. None
        pours from the contact face towards the base.
    inserts
        Labels of solids that are printed and stay in the finger, such as core.
    cavities
        Number of fingers that one mold casts, side by side along the parting face.
    coupon
        Also a fit coupon: a peg, and holes with several clearances.
    button
        Also a mold of a test button, whose press determines E of the batch.
    foil_length_mm
        Length of a gauge's foil where the scene has length_mm = 0.
    foil_thickness_mm
        Thickness of the foil with its carrier, where the scene has no [effects.embedded_gauge].
    foil_width_mm
        Width of the foil along z, where the scene has no [effects.embedded_gauge].
    slot_gap_mm
        Gap on either side of the strip that carries a foil, in its slot.
    bed
        Size of the printer, length x width x height in mm; None takes the preset's.
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
    riser: Annotated[float, Ge(0), Le(0.5)] = 0.04
    fasten: Literal["screws", "bands", "none"] = "screws"
    screw: ScrewName = "M3"
    band_mm: Annotated[float, Gt(0), Le(50)] = 5.0
    seal: Literal["tongue", "cord", "none"] = "tongue"
    cord_mm: Annotated[float, Gt(0), Le(20)] = 2.0
    plugs: bool = True
    pry: bool = True
    carrier: bool = False
    carrier_mm: Annotated[float, Gt(0), Le(100)] = 5.0
    key_mm: Annotated[float, Gt(0), Le(100)] = 3.0
    parts: bool = False
    pour_order: str | None = None
    inserts: str | None = None
    cavities: Annotated[int, Ge(1), Le(20)] = 1
    coupon: bool = False
    button: bool = False
    foil_length_mm: Annotated[float, Gt(0), Le(500)] = 5.0
    foil_thickness_mm: Annotated[float, Gt(0), Le(10)] = 0.1
    foil_width_mm: Annotated[float, Gt(0), Le(500)] = 3.0
    slot_gap_mm: Annotated[float, Ge(0), Le(1)] = 0.15
    bed: str | None = None

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
                f"at least {least:g}, to hold a peg of {self.peg_mm:g} mm with {self.rim_mm:g} mm around its hole"
                + ("" if self.seal == "none" else f" and the seal ({self.seal})")
                + "; or a thinner --peg-mm",
            )
        _ = self.bed_mm
        self._check_combinations()

    def _check_combinations(self) -> None:
        if self.carrier and self.carrier_mm < 4.0 * self.rim_mm:
            raise _refused("carrier_mm", self.carrier_mm, f"at least {4.0 * self.rim_mm:g}, or its holes grip nothing")
        if (self.pour_order or self.inserts) and not self.parts:
            raise Finger3dError("--pour-order and --inserts: need --parts, a mold for each pour")
        if self.carrier and self.cavities > 1:
            raise Finger3dError("--carrier --cavities: a carrier holds one finger; leave one of them out")
        for other, chosen in (("--carrier", self.carrier), ("--cavities", self.cavities > 1)):
            if self.parts and chosen:
                raise Finger3dError(f"--parts {other}: are not made together; leave one of them out")

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
        """Clearance all around pegs, tongues and plugs."""
        return min(self.machine.clearance_mm, self.peg_mm / 10.0) if self.clearance_mm is None else self.clearance_mm

    @property
    def screw_sizes(self) -> Screw:
        """Dimensions of the screws."""
        return SCREWS[self.screw]

    @property
    def groove_mm(self) -> tuple[float, float]:
        """Width and depth of the groove of the seal; zeros without one."""
        if self.seal == "tongue":
            return TONGUE_MM + 2.0 * self.gap_mm, TONGUE_HEIGHT_MM + self.gap_mm
        return (CORD_GROOVE * self.cord_mm, CORD_SQUEEZE * self.cord_mm) if self.seal == "cord" else (0.0, 0.0)

    @property
    def peg_hole_mm(self) -> float:
        """Diameter of the hole of a full peg."""
        return self.peg_mm + 2.0 * self.gap_mm

    @property
    def seal_reach_mm(self) -> float:
        """Distance from the cavity to the outer side of the seal's groove."""
        return self.rim_mm + self.groove_mm[0] if self.groove_mm[0] else 0.0

    @property
    def least_wall_mm(self) -> float:
        """Least thickness of the wall."""
        return round(self.seal_reach_mm + self.peg_hole_mm + 2.0 * self.rim_mm, 9)

    @property
    def around_mm(self) -> float:
        """Thickness of the wall, without the grooves for bands."""
        return max(self.least_wall_mm, _LEAST_WALL_MM) if self.wall_mm is None else self.wall_mm

    @property
    def band_depth_mm(self) -> float:
        """Depth by which grooves for bands make the walls thicker."""
        return 0.0 if self.fasten == "none" else BAND_DEPTH_MM

    @property
    def peg_distance_mm(self) -> float:
        """Distance from the cavity to the axis of a peg."""
        return self.around_mm - self.rim_mm - self.peg_hole_mm / 2.0

    @property
    def bed_mm(self) -> tuple[float, float, float]:
        """Length, width and height of the printer."""
        text = self.machine.bed if self.bed is None else self.bed
        match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*[x*]\s*(\d+(?:\.\d*)?)\s*[x*]\s*(\d+(?:\.\d*)?)\s*", text)
        sizes = tuple(float(size) for size in match.groups()) if match else (0.0,)
        if min(sizes) <= 0.0:
            raise _refused("bed", text, "three sizes in mm, such as 220x220x250")
        return sizes[0], sizes[1], sizes[2]

    @property
    def scale(self) -> float:
        """Ratio of the cavity's lengths to those of the sensor."""
        return 1.0 / (1.0 - self.shrinkage)

    @property
    def hole_depth_mm(self) -> float:
        """Depth of a peg's hole."""
        return self.peg_mm + self.gap_mm

    @property
    def cover_mm(self) -> float:
        """Thickness of the lid or the carrier."""
        return self.carrier_mm if self.carrier else self.lid_mm


@functools.cache
def _adapters() -> dict[str, tuple[Any, TypeAdapter[Any]]]:
    """Return the type of every option, and its check."""
    from pydantic import ConfigDict, TypeAdapter

    config = ConfigDict(strict=True, allow_inf_nan=False)
    hints = get_type_hints(MoldOptions, include_extras=True)
    return {name: (hint, TypeAdapter(hint, config=config)) for name, hint in hints.items()}


def _refused(name: str, value: object, allowed: str) -> Finger3dError:
    return Finger3dError(f"--{name.replace('_', '-')} {value}: must be {allowed}")
