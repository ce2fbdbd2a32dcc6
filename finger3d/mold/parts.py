"""A printable mold of the sensor: two halves and a lid, built from the finger's CAD by booleans.

The sensor is cast upside down: the contact surface lies at the bottom of the cavity, where no air is trapped, and the
lid closes the base. The base will be bonded to a carrier, or stands on a rigid part that is printed, so marks of the
pour hole and the vents do no harm there.

The halves open along z by default. The section of an extruded finger is constant along z, and that of a half ball
shrinks away from the middle, so neither has undercuts. The strips that carry the gauges run along z as well, and the
halves slide off along them. ``split = "x"`` serves bodies that narrow towards both ends of x. A body with undercuts
is refused, see `finger3d.mold.demould`.

The axes of the mold are those of the finger; with ``split = "x"`` they are rotated about y, so that the halves always
open along z. The lid begins at y = 0.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.mold.body import Body, Shell, shell
from finger3d.mold.cover import FoilSlot, Ports, check_foils, slot
from finger3d.mold.demould import Undercut, check_opening, undercut_depth
from finger3d.mold.fasteners import Bolts, Layout, bolts, half_pegs, layout_of, lid_pegs, screws
from finger3d.mold.options import MoldOptions
from finger3d.mold.pours import MAIN, Pour, check_strips, lid_parts, pour_order, pours
from finger3d.mold.solids import Feature, between, one, part

if TYPE_CHECKING:
    from build123d import Solid

_ON_BASE_MM = 1e-6
HALVES = ("half_a", "half_b")


@dataclass(frozen=True)
class Mold:
    """A mold in its assembled position, build123d solids in mm.

    Attributes
    ----------
    body : what the cavity holds: the finger enlarged by the shrinkage
    layout : places of the cavity, walls and pegs
    parts : half_a (z above the split), half_b (below, with the pegs), lids, inserts; without the cavity where the body
        has no CAD, see `shell`
    pours : in their order
    undercut : the deepest, over which the silicone is stretched
    """

    options: MoldOptions
    body: Body
    layout: Layout
    parts: dict[str, Solid]
    pours: tuple[Pour, ...]
    foils: tuple[FoilSlot, ...]
    undercut: Undercut

    @property
    def silicone_mm3(self) -> float:
        """Volume of silicone in the cavity after all pours, without inserts."""
        return sum(pour.silicone_mm3 for pour in self.pours)

    @property
    def ports(self) -> tuple[Ports, ...]:
        """Openings of the lids, in the order of the pours that go through a lid."""
        return tuple(pour.ports for pour in self.pours if pour.ports is not None)

    @property
    def openings_mm3(self) -> float:
        """Volume of pour holes and vents, of all pours."""
        return sum(ports.volume_mm3 for ports in self.ports)

    @property
    def bolts(self) -> Bolts | None:
        """Screws that hold the halves together; None without."""
        return bolts(self.layout, self.options)

    def shell(self, name: str, tolerance_mm: float, angle: float) -> Shell:
        """Return a part as closed triangles, the cavity cut out."""
        made = shell(self.parts[name], tolerance_mm, name, angle)
        return self.body.cut_from(made) if self.body.cad is None and name in HALVES else made


def mold(
    shape: Solid | Triangles,
    gauges: Sequence[FoilSlot],
    options: MoldOptions,
    solids: Mapping[str, Solid] | None = None,
    rigid: Collection[str] = (),
) -> Mold:
    """Build a mold around a finger (y up, base on y = 0, mm), of CAD or of closed triangles.

    Parameters
    ----------
    solids : the finger's solids by their labels; "" is the main body
    rigid : labels of the solids that are printed and inserted

    Raises
    ------
    Finger3dError
        If the split plane misses the body, the body has an undercut, a foil does not fit, a lid has no room
        for its openings, or for the reasons of `finger3d.mold.pours.pours`.
    """
    if options.split == "x" and gauges:
        raise Finger3dError(
            f'--split x: the strips of gauge "{gauges[0].names[0]}" run along z and would lock halves that open along '
            "x; use --split z, or a scene without gauges"
        )
    solids = solids or {}
    silicones = _silicones(shape, solids, rigid, options)
    finger = Body.of(shape, options.machine.tolerance_mm)
    check_split(finger, options)

    def placed(shape: Solid | Triangles, name: str) -> Body:
        made = Body.of(shape, options.machine.tolerance_mm, name)
        return made.scaled(options.scale).opening_along_z(options.split)

    body = finger.scaled(options.scale).opening_along_z(options.split)
    check_foils(body, gauges, options)
    recessed = recesses(finger)
    fillings = [placed(filling, "a recess").solid for filling in recessed]
    cast = {label: body if one is shape else placed(one, label or MAIN) for label, one in silicones.items()}
    inserts = {label: placed(solids[label], label) for label in rigid}
    planned = pours(cast, inserts, fillings, body, options)
    layout = layout_of(*body.box, options)
    slots = {foil: slot(foil, layout, options) for foil in gauges}
    check_strips(planned, slots)
    undercut = check_opening(filled(finger, recessed, options), options, may_turn=not gauges)
    cavity = [] if body.cad is None else [body.cad, *fillings]
    hollows = Feature(cut=dict.fromkeys(HALVES, [*slots.values(), *cavity]))
    features = [screws(layout, options), half_pegs(layout, options), lid_pegs(layout, options), hollows]
    parts = halves(layout, features)
    for pour in planned:
        parts |= lid_parts(pour, layout, features)
    for name, solid in parts.items():
        solid.label = name
    return Mold(options, body, layout, parts, planned, tuple(gauges), undercut)


def _silicones(
    shape: Solid | Triangles, solids: Mapping[str, Solid], rigid: Collection[str], options: MoldOptions
) -> dict[str, Solid | Triangles]:
    """Return what is poured, in the order of the pours; all of it at once without --parts."""
    if not options.parts and not rigid:
        return {"": shape}
    order = pour_order(solids, rigid, options)
    poured = {label: solids[label] for label in order}
    if not options.parts:
        poured = {"": solids[order[0]].fuse(*(solids[label] for label in order[1:])) if order[1:] else solids[order[0]]}
    advice = "give each piece a name in the STEP file, and pour them one by one with --parts"
    return {label: one(solid, f"the silicone of {label or MAIN}", advice) for label, solid in poured.items()}


def recesses(body: Body) -> list[Solid]:
    """Return what fills the recesses in the base of a CAD body, which the lid does."""
    if body.cad is None:
        return []
    low, high = body.box
    around = between([low[0] - 1.0, 0.0, low[2] - 1.0], high + 1.0)
    pieces = sorted((around - body.cad).solids(), key=lambda piece: piece.bounding_box().diagonal)
    return [piece for piece in pieces[:-1] if abs(piece.bounding_box().min.Y) < _ON_BASE_MM]


def filled(finger: Body, fillings: Sequence[Solid], options: MoldOptions) -> Body:
    """Return the body that the halves enclose: the finger with the recesses in its base filled.

    Raises
    ------
    Finger3dError
        If the lid could not be pulled out of a recess.
    """
    tolerance = options.machine.tolerance_mm
    for filling in fillings:
        depth = undercut_depth(Body.of(filling, tolerance).surface, 1, 1.0)
        if depth > max(options.undercut_mm, tolerance):
            center = ", ".join(f"{coordinate:.4g}" for coordinate in filling.center())
            raise Finger3dError(
                f"mold: the recess in the base near ({center}) mm widens inside, an undercut of {depth:.2g} mm: the "
                "lid, which fills it, cannot be pulled out; change the body, or allow it with --undercut-mm"
            )
    return Body.of(one(finger.solid.fuse(*fillings).clean(), "the finger"), tolerance) if fillings else finger


def halves(layout: Layout, features: Sequence[Feature]) -> dict[str, Solid]:
    """Return both halves."""
    front = between([layout.outer_low[0], 0.0, layout.split], layout.outer_high)
    back = between(layout.outer_low, [layout.outer_high[0], layout.top, layout.split])
    return {name: part(name, box, features, name) for name, box in zip(HALVES, (front, back), strict=True)}


# --- refusals ---------------------------------------------------------------------------------------------------------


def check_split(finger: Body, options: MoldOptions) -> None:
    """Raise a Finger3dError if the split plane misses the finger."""
    low, high = finger.box
    axis = 0 if options.split == "x" else 2
    if not low[axis] < options.split_mm < high[axis]:
        raise Finger3dError(
            f"--split-mm {options.split_mm:g}: the split plane misses the finger; must be between {low[axis]:.6g} and "
            f"{high[axis]:.6g} mm along {options.split}"
        )
