"""A printable mold of the sensor: two halves and a lid, built from the finger's CAD by booleans.

The sensor is cast upside down: the contact surface lies at the bottom of the cavity, where no air is trapped, and the
lid closes the base. The base will be bonded to a carrier, or is cast onto one (`carrier`), so marks of the pour hole
and the vents do no harm there.

The halves open along z by default. The section of an extruded finger is constant along z, and that of a half ball
shrinks away from the middle, so neither has undercuts. The strips that carry the gauges run along z as well, and the
halves slide off along them. ``split = "x"`` serves bodies that narrow towards both ends of x. A body with undercuts
is refused, see `finger3d.mold.demould`.

The axes of the mold are those of the finger; with ``split = "x"`` they are rotated about y, so that the halves always
open along z. The lid begins at y = 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles
from finger3d.mold.body import Body, Shell, shell
from finger3d.mold.cover import Keys, Ports, base_region, key_solids, keys, openings, ports, riser_cup
from finger3d.mold.demould import Draft, check_opening, undercut_depth
from finger3d.mold.fasteners import (
    Bolts,
    Pegs,
    band_grooves,
    bolts,
    carrier_pins,
    half_pegs,
    lid_pegs,
    pry_notches,
    screws,
    seal,
)
from finger3d.mold.foils import FoilSlot, check_foils, plugs, slot
from finger3d.mold.layout import Layout, layout_of
from finger3d.mold.options import MoldOptions
from finger3d.mold.solids import Feature, added, between, common, cuts, one

if TYPE_CHECKING:
    from build123d import Solid

_OVERLAP_TOLERANCE = 1e-6  # relative volume that booleans leave between faces in contact
_MESH_OVERLAP_TOLERANCE = 1e-3  # the same where one of two bodies is tessellated
_ON_BASE_MM = 1e-6
HALVES = ("half_a", "half_b")
MAIN = "body"
"""Name of the solid without a label."""


@dataclass(frozen=True)
class Pour:
    """One pour into the mold.

    Attributes
    ----------
    label : of the solid that is poured; "" for the main body
    lid : name of the part that closes the mold
    silicone_mm3 : volume of all cavities
    ports : openings of the lid over one cavity; None where silicone is poured before the lid is pushed on
    cast : what lies in the cavities after this pour, in place
    others : names of the parts that belong to this pour only: lid, riser, inserts
    """

    label: str
    lid: str
    silicone_mm3: float
    ports: Ports | None
    cast: tuple[Body, ...]
    others: tuple[str, ...]

    @property
    def name(self) -> str:
        """Label, or "body" for the main body."""
        return self.label or MAIN


@dataclass(frozen=True)
class Mold:
    """A mold in its assembled position, build123d solids in mm.

    Attributes
    ----------
    body : what one cavity casts: the finger enlarged by the shrinkage
    layout : places of cavities, walls and pegs
    parts : half_a (z above the split), half_b (below, with the pegs), lid or carrier, riser, plugs, pins; without the
        cavities where the body has no CAD, see `shell`
    pours : in their order
    slots : the volumes of the strips, with their gaps
    pegs, lid_pegs : pegs and holes of the halves, and of the lid
    keys : keyed holes of the carrier under one cavity; None without a carrier
    draft : how the halves come off
    """

    options: MoldOptions
    body: Body
    layout: Layout
    parts: dict[str, Solid]
    pours: tuple[Pour, ...]
    slots: tuple[Solid, ...]
    foils: tuple[FoilSlot, ...]
    pegs: Pegs
    lid_pegs: Pegs | None
    keys: Keys | None
    draft: Draft

    @property
    def bodies(self) -> tuple[Body, ...]:
        """What the cavities cast, in place."""
        return tuple(self.body.at(x) for x in self.layout.places)

    @property
    def silicone_mm3(self) -> float:
        """Volume of silicone in all cavities, after all pours, without inserts."""
        return sum(pour.silicone_mm3 for pour in self.pours)

    @property
    def openings_mm3(self) -> float:
        """Volume of pour holes, risers, vents and keyed holes, of all pours."""
        cover, cavities = self.options.cover_mm, len(self.layout.places)
        held = sum(pour.ports.volume_mm3(cover) for pour in self.pours if pour.ports is not None)
        return cavities * (held + (self.keys.volume_mm3(cover) if self.keys else 0.0))

    @property
    def ports(self) -> Ports:
        """Openings of the lid of the last pour that is poured through a lid."""
        found = [pour.ports for pour in self.pours if pour.ports is not None]
        return found[-1]

    @property
    def bolts(self) -> Bolts | None:
        """Screws that hold the halves together; None without."""
        return bolts(self.layout, self.options)

    @property
    def outline(self) -> tuple[Float, Float]:
        """Low and high corner (3,), mm, of the two halves together, without lugs."""
        return self.layout.outer_low, self.layout.outer_high

    def shell(self, name: str, tolerance_mm: float, angle: float) -> Shell:
        """Return a part as closed triangles, the cavities cut out."""
        part = shell(self.parts[name], tolerance_mm, name, angle)
        if self.body.cad is None and name in HALVES:
            for body in self.bodies:
                part = body.cut_from(part)
        return part


def mold(shape: Solid | Triangles, gauges: Sequence[FoilSlot], options: MoldOptions) -> Mold:
    """Build a mold around a finger (y up, base on y = 0, mm), of CAD or of closed triangles.

    Raises
    ------
    Finger3dError
        If the split plane misses the body, the body has an undercut, a foil does not fit, the lid has no room
        for its openings, or two parts of the mold would overlap.
    """
    if options.split == "x" and gauges:
        raise Finger3dError(
            f'--split x: the strips of gauge "{gauges[0].names[0]}" run along z and would lock halves that open along '
            "x; use --split z, or a scene without gauges"
        )
    finger = Body.of(shape, options.machine.tolerance_mm)
    check_split(finger, options)
    draft = check_opening(filled(finger, options), options, may_turn=not gauges)
    body = finger.scaled(options.scale).opening_along_z(options.split)
    check_foils(body, gauges, options)
    assembled = _assembled(body, tuple(gauges), options, draft)
    check_parts(assembled)
    return assembled


def recesses(body: Body) -> list[Solid]:
    """Return what fills the recesses in the base of a CAD body, which the lid does."""
    if body.cad is None:
        return []
    low, high = body.box
    around = between([low[0] - 1.0, 0.0, low[2] - 1.0], high + 1.0)
    pieces = sorted((around - body.cad).solids(), key=lambda piece: piece.bounding_box().diagonal)
    return [piece for piece in pieces[:-1] if abs(piece.bounding_box().min.Y) < _ON_BASE_MM]


def filled(finger: Body, options: MoldOptions) -> Body:
    """Return the body that the halves enclose: the finger with the recesses in its base filled.

    Raises
    ------
    Finger3dError
        If the lid could not be pulled out of a recess.
    """
    tolerance = options.machine.tolerance_mm
    fillings = recesses(finger)
    for filling in fillings:
        depth = undercut_depth(Body.of(filling, tolerance).surface, 1, 1.0)
        if depth > max(options.undercut_mm, tolerance):
            center = ", ".join(f"{coordinate:.4g}" for coordinate in filling.center())
            raise Finger3dError(
                f"mold: the recess in the base near ({center}) mm widens inside, an undercut of {depth:.2g} mm: the "
                "lid, which fills it, cannot be pulled out; change the body, or allow it with --undercut-mm"
            )
    return Body.of(one(finger.solid.fuse(*fillings).clean(), "the finger"), tolerance) if fillings else finger


def halves_and_features(
    body: Body, foils: tuple[FoilSlot, ...], options: MoldOptions
) -> tuple[Layout, list[Feature], Pegs, tuple[Solid, ...]]:
    """Return the places, all features but those of the lid's openings, the pegs of the halves, and the slots."""
    layout = layout_of(*body.box, options)
    cast = [body.at(x) for x in layout.places]
    pegs = half_pegs(layout, options)
    slots = tuple(slot(foil, layout, options, x) for x in layout.places for foil in foils)
    fillings = [recesses(b) for b in cast]
    cavities = [solid for b, own in zip(cast, fillings, strict=True) if b.cad is not None for solid in (b.cad, *own)]
    features = [
        screws(layout, options),
        band_grooves(layout, options),
        pry_notches(layout, options),
        seal([b.surface for b in cast], layout, options),
        plugs(foils, layout, options),
        Feature(add={"half_b": pegs.pegs}, cut={"half_a": pegs.holes}),
        Feature(add={"lid": list(itertools.chain(*fillings))}),
        Feature(cut={name: [*slots, *cavities] for name in HALVES}),
    ]
    return layout, features, pegs, slots


def part(name: str, base: Solid, features: Sequence[Feature], label: str) -> Solid:
    """Return a part: a box, with what features add to it, without what they cut from it."""
    whole = base + added(features, name) if added(features, name) else base
    tools = cuts(features, name)
    solid = one(whole - tools if tools else whole, label)
    solid.label = label
    return solid


def halves(layout: Layout, features: Sequence[Feature]) -> dict[str, Solid]:
    """Return both halves."""
    front = between([layout.outer_low[0], 0.0, layout.split], layout.outer_high)
    back = between(layout.outer_low, [layout.outer_high[0], layout.top, layout.split])
    return {name: part(name, box, features, name) for name, box in zip(HALVES, (front, back), strict=True)}


def cover(layout: Layout, options: MoldOptions) -> Solid:
    """Return the plate of a lid or a carrier."""
    low, high = layout.outer_low, layout.outer_high
    return between([low[0], -options.cover_mm, low[2]], [high[0], 0.0, high[2]])


def _assembled(body: Body, foils: tuple[FoilSlot, ...], options: MoldOptions, draft: Draft) -> Mold:
    layout, features, pegs, slots = halves_and_features(body, foils, options)
    base = base_region(body.surface)
    lid_ports = ports(base, body.volume_mm3, options, vented=not options.carrier)
    gripped = keys(base, lid_ports, options) if options.carrier else None
    upright = None if options.carrier else lid_pegs(layout, options)
    if upright is None:
        features.append(carrier_pins(layout, options))
    else:
        features.append(Feature(add={"lid": upright.pegs}, cut=dict.fromkeys(HALVES, upright.holes)))
    holes = [solid for x in layout.places for solid in openings(lid_ports, x, options)]
    if gripped is not None:
        holes += [solid for x in layout.places for solid in key_solids(gripped, x, options)]
    features.append(Feature(cut={"lid": holes}))
    name = "carrier" if options.carrier else "lid"
    parts = {**halves(layout, features), name: part("lid", cover(layout, options), features, name)}
    if lid_ports.riser is not None:
        for i, x in enumerate(layout.places, 1):
            parts[_numbered("riser", i, layout)] = riser_cup(lid_ports, x, options)
    for feature in features:
        parts.update(feature.parts)
    for label, solid in parts.items():
        solid.label = label
    return Mold(
        options=options,
        body=body,
        layout=layout,
        parts=parts,
        pours=(
            Pour(
                "",
                name,
                body.volume_mm3 * len(layout.places),
                lid_ports,
                tuple(body.at(x) for x in layout.places),
                tuple(part for part in parts if part not in HALVES),
            ),
        ),
        slots=slots,
        foils=foils,
        pegs=pegs,
        lid_pegs=upright,
        keys=gripped,
        draft=draft,
    )


def _numbered(name: str, i: int, layout: Layout) -> str:
    return name if len(layout.places) == 1 else f"{name}_{i}"


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


def overlaps(mold: Mold) -> dict[str, float]:
    """Return the common volume (mm3) of each pair of parts in the assembled position, the cast bodies included.

    Parts of different pours are never in the mold together.
    """
    boxes = {}
    for name, solid in mold.parts.items():
        box = solid.bounding_box()
        boxes[name] = np.array([*box.min]), np.array([*box.max])
    shared: dict[str, float] = {}
    for pour in mold.pours:
        names = [name for name in mold.parts if name in pour.others or not any(name in p.others for p in mold.pours)]
        for a, b in itertools.combinations(names, 2):
            apart = (boxes[a][0] > boxes[b][1]).any() or (boxes[b][0] > boxes[a][1]).any()
            if f"{a}, {b}" not in shared:
                shared[f"{a}, {b}"] = 0.0 if apart else common(mold.parts[a], mold.parts[b])
        for name in names:
            if pour.cast[0].cad is None and name in HALVES:
                continue  # cut from each other by a boolean of triangles
            volume = sum(body.shared(mold.parts[name]) for body in pour.cast)
            shared[f"{name}, sensor"] = max(volume, shared.get(f"{name}, sensor", 0.0))
    return shared


def check_parts(mold: Mold) -> None:
    """Raise a Finger3dError if two parts overlap, or a part and what is cast."""
    tolerance = _OVERLAP_TOLERANCE if mold.body.cad is not None else _MESH_OVERLAP_TOLERANCE
    bad = {pair: v for pair, v in overlaps(mold).items() if v > tolerance * mold.silicone_mm3}
    if bad:
        pair = max(bad, key=lambda p: bad[p])
        raise Finger3dError(f"mold: {pair} would overlap by {bad[pair]:.3g} mm3; choose other sizes of wall or pegs")
