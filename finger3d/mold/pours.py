"""A mold for each pour of a finger of several solids: both halves serve all pours, and each pour has a lid of its own.

The solid at the contact face is poured first. The lid of a pour carries a positive of all solids that are poured
later, so that the silicone fills its own solid only; the next lid carries less. All positives are cut from the
same CAD as the cavity, so that every solid fits the next. Solids that are printed (`inserts`) sit on pegs of the lid
and stay in the finger.

A solid that does not reach the base has no pour hole: its silicone is poured into the open halves, and the lid with
the positive is pushed in slowly. Surplus and air leave through channels at both ends of the positive, and through the
clearance between the positive and the walls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mold.body import Body
from finger3d.mold.cover import Ports, base_region, openings, ports, riser_cup
from finger3d.mold.demould import check_opening, undercut_depth
from finger3d.mold.fasteners import lid_pegs
from finger3d.mold.foils import FoilSlot, check_foils, slot
from finger3d.mold.layout import Layout
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import (
    HALVES,
    MAIN,
    Mold,
    Pour,
    check_parts,
    check_split,
    cover,
    filled,
    halves,
    halves_and_features,
    part,
)
from finger3d.mold.solids import Feature, common, cylinder, one, peg

if TYPE_CHECKING:
    from build123d import Solid

_TOUCHING = 1e-6  # of the body's height: a solid that reaches down so far stands on the base
_CHANNEL_INSET = 0.3  # distance of a channel's axis from the side of the positive, to which it is open, over its width
_SHARED_TOLERANCE = 1e-6  # relative volume that booleans leave


def poured(whole: Solid, solids: Mapping[str, Solid], gauges: Sequence[FoilSlot], options: MoldOptions) -> Mold:
    """Build a mold with a lid for each pour of a body of several solids.

    Parameters
    ----------
    whole : the whole body, y up, base on y = 0, mm
    solids : its solids by their labels; "" is the main body

    Raises
    ------
    Finger3dError
        If labels are unknown, a lid's positive cannot stand on it or cannot be pulled out, a gauge's strip would run
        through a positive, or for the reasons of `finger3d.mold.parts.mold`.
    """
    order, inserts = pour_order(solids, options)
    finger = Body.of(whole, options.machine.tolerance_mm)
    check_split(finger, options)
    if options.split == "x" and gauges:
        raise Finger3dError(f'--split x: gauge "{gauges[0].names[0]}" needs halves that open along z')
    draft = check_opening(filled(finger, options), options, may_turn=not gauges)
    body = finger.scaled(options.scale).opening_along_z(options.split)
    tolerance = options.machine.tolerance_mm
    cast = {
        label: Body.of(solid, tolerance, label or MAIN).scaled(options.scale).opening_along_z(options.split)
        for label, solid in solids.items()
    }
    check_foils(body, gauges, options)
    layout, features, pegs, slots = halves_and_features(body, tuple(gauges), options)
    upright = lid_pegs(layout, options)
    features.append(Feature(add={"lid": upright.pegs}, cut=dict.fromkeys(HALVES, upright.holes)))
    parts = halves(layout, features)
    pours: list[Pour] = []
    poured: list[Body] = []
    steps = [label for label in order if label not in inserts]
    for label in steps:
        poured.append(cast[label])
        later = order[order.index(label) + 1 :]
        placed = [] if label != steps[-1] else [name for name in later if name in inserts]
        positive = _positive([cast[name] for name in later if name not in placed], body, layout, options, label)
        lid_parts, lid_ports = _lid(
            label, cast[label], positive, [(name, cast[name]) for name in placed], layout, features, options
        )
        _check_strips(gauges, cast, label, positive, layout, options)
        parts.update(lid_parts)
        pours.append(
            Pour(label, f"lid_{label or MAIN}", cast[label].volume_mm3, lid_ports, tuple(poured), tuple(lid_parts))
        )
    if pours[-1].ports is None:
        raise Finger3dError(f"mold: {pours[-1].name} has no base to pour it through; choose another --pour-order")
    for feature in features:
        parts.update(feature.parts)
    for name, solid in parts.items():
        solid.label = name
    assembled = Mold(
        options=options,
        body=body,
        layout=layout,
        parts=parts,
        pours=tuple(pours),
        slots=slots,
        foils=tuple(gauges),
        pegs=pegs,
        lid_pegs=upright,
        keys=None,
        draft=draft,
    )
    check_parts(assembled)
    return assembled


def pour_order(solids: Mapping[str, Solid], options: MoldOptions) -> tuple[list[str], list[str]]:
    """Return the labels in the order of their pours, the highest first, and the labels that are printed."""
    label_of = {label or MAIN: label for label in solids}
    if len(solids) < 2:
        raise Finger3dError("--parts: the finger is one solid; leave --parts out, or choose a body of several solids")

    def labels(option: str, text: str) -> list[str]:
        names = [name.strip() for name in text.split(",")]
        if unknown := [name for name in names if name not in label_of]:
            raise Finger3dError(
                f"--{option} {text}: there is no solid {unknown[0]}; the finger has {', '.join(label_of)}"
            )
        return [label_of[name] for name in names]

    order = sorted(solids, key=lambda label: -float(solids[label].center().Y))
    if options.pour_order:
        order = labels("pour-order", options.pour_order)
        if sorted(order) != sorted(solids):
            raise Finger3dError(f"--pour-order {options.pour_order}: must name each once: {', '.join(label_of)}")
    inserts = labels("inserts", options.inserts) if options.inserts else []
    first = [label for label in order if label not in inserts]
    if not first:
        raise Finger3dError(f"--inserts {options.inserts}: leaves nothing to pour")
    for label in inserts:
        if order.index(label) < order.index(first[-1]):
            raise Finger3dError(
                f"--inserts {options.inserts}: {label or MAIN} must stand on the base, and be the last of the order"
            )
    return order, inserts


def _positive(later: list[Body], body: Body, layout: Layout, options: MoldOptions, label: str) -> Solid | None:
    """Return the solids poured later as one positive, clear of the walls of the cavity; None without any."""
    if not later:
        return None
    from build123d import Pos

    gap = options.gap_mm
    name = f"the positive of lid_{label or MAIN}"
    advice = "choose another --pour-order, or --inserts"
    whole = later[0].solid
    for other in later[1:]:
        whole = whole + other.solid
    for shift in ((gap, 0), (-gap, 0), (0, gap), (0, -gap)):
        whole = whole & (Pos(float(shift[0]), 0, float(shift[1])) * body.solid)
    positive = one(whole, name, advice)
    surface = Body.of(positive, options.machine.tolerance_mm, name).surface
    if surface.low[1] > _TOUCHING * body.box[1][1]:
        raise Finger3dError(f"mold: {name} does not reach the lid; {advice}")
    depth = undercut_depth(surface, 1, 1.0)
    if depth > max(options.undercut_mm, options.machine.tolerance_mm):
        raise Finger3dError(
            f"mold: {name} has an undercut of {depth:.2g} mm and cannot be pulled out of the silicone; {advice}, or "
            "allow it with --undercut-mm"
        )
    return positive


def _lid(
    label: str,
    cast: Body,
    positive: Solid | None,
    placed: list[tuple[str, Body]],
    layout: Layout,
    features: Sequence[Feature],
    options: MoldOptions,
) -> tuple[dict[str, Solid], Ports | None]:
    """Return the lid of a pour, with its riser and the inserts that stand on it, and its openings."""
    name = f"lid_{label or MAIN}"
    lid_ports = _ports(cast, layout, options)
    adds = [positive] if positive is not None else []
    tools = openings(lid_ports, 0.0, options) if lid_ports is not None else _channels(cast, positive, layout, options)
    insert_parts: dict[str, Solid] = {}
    for insert, solid in placed:
        pins, holes = _insert_pegs(insert, solid, options)
        adds += pins
        insert_parts[f"insert_{insert or MAIN}"] = one(solid.solid - holes, insert or MAIN)
    lid = part("lid", cover(layout, options), [*features, Feature(add={"lid": adds}, cut={"lid": tools})], name)
    lid_parts = {name: lid}
    if lid_ports is not None and lid_ports.riser is not None:
        lid_parts[f"riser_{label or MAIN}"] = riser_cup(lid_ports, 0.0, options)
    return {**lid_parts, **insert_parts}, lid_ports


def _ports(cast: Body, layout: Layout, options: MoldOptions) -> Ports | None:
    """Return the openings over the base of a solid; None where it has no base wide enough for them."""
    if cast.surface.low[1] > _TOUCHING * layout.high[1]:
        return None
    base = base_region(cast.surface)
    x0, z0, x1, z1 = base.bounds()
    if base.offset(-max(options.rim_mm, 0.02 * min(x1 - x0, z1 - z0))).is_empty():
        return None
    return ports(base, cast.volume_mm3, options)


def _channels(cast: Body, positive: Solid | None, layout: Layout, options: MoldOptions) -> list[Solid]:
    """Return channels along both ends of a positive, through which surplus silicone and air leave."""
    if positive is None:
        return []
    bounds = positive.bounding_box()
    low, high = np.array([*bounds.min]), np.array([*bounds.max])
    wide = min(2.0, 0.1 * float(min(high[0] - low[0], high[2] - low[2])))
    wide = wide if options.vent_mm is None else options.vent_mm
    length = float(high[1]) + options.lid_mm
    return [
        cylinder((x, -options.lid_mm, layout.split), wide, length, "y")
        for x in (float(low[0]) + _CHANNEL_INSET * wide, float(high[0]) - _CHANNEL_INSET * wide)
    ]


def _insert_pegs(label: str, solid: Body, options: MoldOptions) -> tuple[list[Solid], list[Solid]]:
    """Return two pegs on the lid that hold an insert, one thinner, and their holes in it."""
    low, high = solid.box
    d = min(options.peg_mm, 0.25 * float(high[2] - low[2]), 0.25 * float(high[0] - low[0]))
    deep = min(d, 0.5 * float(high[1]))
    if deep < 2.0 * options.machine.thinnest_mm or solid.surface.low[1] > _TOUCHING * high[1]:
        raise Finger3dError(f"--inserts {label or MAIN}: must stand on the base, and be large enough to hold two pegs")
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    along = np.array([quarter[0], 0.0, 0.0]) if quarter[0] >= quarter[2] else np.array([0.0, 0.0, quarter[2]])
    pins, holes = [], []
    for sign, size in ((-1.0, 0.7 * d), (1.0, d)):
        x, _, z = middle + sign * along
        pins.append(peg((x, 0.0, z), size, deep, "y"))
        holes.append(cylinder((x, 0.0, z), size + 2.0 * options.gap_mm, deep + options.gap_mm, "y"))
    return pins, holes


def _check_strips(
    gauges: Sequence[FoilSlot],
    cast: Mapping[str, Body],
    label: str,
    positive: Solid | None,
    layout: Layout,
    options: MoldOptions,
) -> None:
    """Raise a Finger3dError if the strip of a gauge in this solid runs through the positive of its pour."""
    for foil in gauges:
        strip = slot(foil, layout, options, 0.0)
        inside = {name: body.shared(strip) for name, body in cast.items()}
        if max(inside, key=lambda name: inside[name]) != label or positive is None:
            continue
        if common(strip, positive) > _SHARED_TOLERANCE * float(strip.volume):
            raise Finger3dError(
                f'gauge "{foil.names[0]}": its strip runs through the positive of lid_{label or MAIN}; move it into '
                "one solid, clear of the others"
            )
