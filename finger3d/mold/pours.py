"""Pours into a mold: both halves serve all of them, and each has a lid of its own.

The solid at the contact face is poured first. The lid of a pour carries a positive of all solids that are poured
later, so that the silicone fills its own solid only; the next lid carries less. All positives are cut from the
same CAD as the cavity, so that every solid fits the next. Rigid parts are inserts: they are printed, sit on pegs of
the last lid, and stay in the finger.

A solid whose base has no room for a pour hole is poured into the open halves, and the lid with its positive or its
inserts is pushed in slowly. Surplus and air leave through channels at both ends of what is pushed in, and through the
clearance between it and the walls.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.mold.body import Body
from finger3d.mold.cover import FoilSlot, Ports, openings, ports
from finger3d.mold.demould import undercut_depth
from finger3d.mold.fasteners import Layout, pegs
from finger3d.mold.options import LID_MM, PEG_MM, MoldOptions
from finger3d.mold.regions import base_region, nearest
from finger3d.mold.solids import Feature, between, common, cylinder, one, part

if TYPE_CHECKING:
    from build123d import Solid

MAIN = "body"
"""Name of the solid without a label."""

_TOUCHING = 1e-6  # of the body's height: a solid that reaches down so far stands on the base
_CHANNEL_INSET = 0.3  # distance of a channel's axis from the end of what is pushed in, over the channel's width
_SHARED_TOLERANCE = 1e-6  # relative volume that booleans leave


@dataclass(frozen=True)
class Pour:
    """One pour into the mold.

    Attributes
    ----------
    label : of the solid that is poured; "" for the main body
    lid : name of the part that closes the mold
    silicone_mm3 : volume of the cavity
    ports : openings of the lid; None where silicone is poured before the lid is pushed on
    cast : silicone in the cavity after this pour, in place
    pushed : positive and fillings of recesses, which belong to the lid
    inserts : rigid parts on the lid, by their labels
    """

    label: str
    lid: str
    silicone_mm3: float
    ports: Ports | None
    cast: tuple[Body, ...]
    pushed: tuple[Solid, ...]
    inserts: Mapping[str, Solid]

    @property
    def name(self) -> str:
        """Label, or "body" for the main body."""
        return self.label or MAIN

    @property
    def others(self) -> tuple[str, ...]:
        """Names of the parts that belong to this pour only."""
        return (self.lid, *map(insert_name, self.inserts))

    @property
    def inside(self) -> tuple[Solid, ...]:
        """All that the lid brings into the cavity."""
        return (*self.pushed, *self.inserts.values())


def insert_name(label: str) -> str:
    """Return the name of the part that is printed for a rigid part."""
    return f"insert_{label or MAIN}"


def pour_order(solids: Mapping[str, Solid], rigid: Collection[str], options: MoldOptions) -> list[str]:
    """Return the labels of the solids that are poured, in the order of their pours, the highest first."""
    soft = [label for label in solids if label not in rigid]
    if not soft:
        raise Finger3dError("--mold: all parts of the finger are rigid, and nothing is left to pour")
    if len(solids) < 2:
        raise Finger3dError("--parts: the finger is one solid; leave --parts out, or choose a body of several solids")
    if not options.pour_order:
        return sorted(soft, key=lambda label: -float(solids[label].center().Y))
    names = [name.strip() for name in options.pour_order.split(",")]
    if sorted(names) != sorted(label or MAIN for label in soft):
        raise Finger3dError(
            f"--pour-order {options.pour_order}: must name each once: {', '.join(label or MAIN for label in soft)}"
        )
    return ["" if name == MAIN and MAIN not in soft else name for name in names]


def pours(
    silicones: Mapping[str, Body],
    inserts: Mapping[str, Body],
    fillings: Sequence[Solid],
    body: Body,
    options: MoldOptions,
) -> tuple[Pour, ...]:
    """Return the pours with the openings of their lids.

    Parameters
    ----------
    silicones : solids that are poured, in their order
    inserts : rigid parts
    fillings : what fills the recesses in the base
    body : the whole body

    Raises
    ------
    Finger3dError
        If a positive or an insert cannot stand on its lid, a positive cannot be pulled out of the silicone, or a base
        has no room for the openings.
    """
    pins: list[Solid] = []
    placed: dict[str, Solid] = {}
    for label, insert in inserts.items():
        on_lid, placed[label] = _on_pegs(label, insert, body, options)
        pins += on_lid
    made = []
    for i, (label, silicone) in enumerate(silicones.items()):
        lid = "lid" if len(silicones) == 1 else f"lid_{label or MAIN}"
        later = list(silicones.values())[i + 1 :]
        pushed = [*fillings, *([_positive([*later, *inserts.values()], body, options, lid)] if later else pins)]
        ports, cast = _ports(silicone, body, bool(pushed), options), tuple(silicones.values())[: i + 1]
        made.append(Pour(label, lid, silicone.volume_mm3, ports, cast, tuple(pushed), {} if later else placed))
    return tuple(made)


def _clear_of_walls(solids: Sequence[Body], body: Body, options: MoldOptions) -> Solid:
    """Return solids as one, with the clearance to the walls of the cavity."""
    from build123d import Pos

    gap = float(options.gap_mm)
    whole = solids[0].solid
    for other in solids[1:]:
        whole = whole + other.solid
    for x, z in ((gap, 0), (-gap, 0), (0, gap), (0, -gap)):
        whole = whole & (Pos(x, 0, z) * body.solid)
    return whole


def _positive(later: Sequence[Body], body: Body, options: MoldOptions, lid: str) -> Solid:
    """Return the solids that come later as one positive."""
    name, advice = f"the positive of {lid}", "choose another --pour-order, or make a part rigid, which is an insert"
    positive = one(_clear_of_walls(later, body, options), name, advice)
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


def _ports(cast: Body, body: Body, pushed: bool, options: MoldOptions) -> Ports | None:
    """Return the openings over the base of a solid; None where it is narrow or none, and something is pushed in."""
    base = base_region(cast.surface)
    on_base = cast.surface.low[1] <= _TOUCHING * body.box[1][1]
    wide = on_base and (options.pour_mm is not None or not base.offset(-options.rim_mm).is_empty())
    return None if pushed and not wide else ports(base, options)


def lid_parts(pour: Pour, layout: Layout, features: Sequence[Feature]) -> dict[str, Solid]:
    """Return the lid of a pour, and the inserts that stand on it."""
    channels = _channels(pour, layout) if pour.ports is None else []
    holes = openings(pour.ports) if pour.ports is not None else channels
    # Where the silicone has a base, channels in the lid alone reach it, and the inserts stay whole.
    through = channels if pour.cast[-1].surface.low[1] > _TOUCHING * layout.high[1] else []
    inserts = {insert_name(n): one(solid - through, n) if through else solid for n, solid in pour.inserts.items()}
    low, high = layout.outer_low, layout.outer_high
    plate = between([low[0], -LID_MM, low[2]], [high[0], 0.0, high[2]])
    own = Feature(add={"lid": pour.pushed}, cut={"lid": holes})
    return {pour.lid: part("lid", plate, [*features, own], pour.lid), **inserts}


def _channels(pour: Pour, layout: Layout) -> list[Solid]:
    """Return channels along both ends of what is pushed in, through which surplus silicone and air leave."""
    boxes = [solid.bounding_box() for solid in pour.inside]
    low, high = np.min([[*box.min] for box in boxes], axis=0), np.max([[*box.max] for box in boxes], axis=0)
    wide = min(2.0, 0.1 * float(min(high[0] - low[0], high[2] - low[2])))
    return [
        cylinder((x, -LID_MM, layout.split), wide, float(high[1]) + LID_MM, "y")
        for x in (float(low[0]) + _CHANNEL_INSET * wide, float(high[0]) - _CHANNEL_INSET * wide)
    ]


def _on_pegs(label: str, insert: Body, body: Body, options: MoldOptions) -> tuple[list[Solid], Solid]:
    """Return two pegs of the lid, one thinner, and the insert that sits on them."""
    (x0, _, z0), (x1, high, z1) = insert.box
    d = min(PEG_MM, 0.25 * float(x1 - x0), 0.25 * float(z1 - z0))
    deep, thinnest = min(d, 0.5 * float(high)), options.machine.thinnest_mm
    around = d / 2.0 + options.gap_mm + thinnest
    foot = base_region(insert.surface).offset(-around)
    on_base = insert.surface.low[1] <= _TOUCHING * high
    x, z, dx, dz = 0.5 * (x0 + x1), 0.5 * (z0 + z1), 0.25 * (x1 - x0), 0.25 * (z1 - z0)
    ends = [((x - dx, z), (x + dx, z)), ((x, z - dz), (x, z + dz))]
    first, second = max((tuple(nearest(foot, end) for end in pair) for pair in ends), key=lambda pair: math.dist(*pair))
    room = not foot.is_empty() and math.dist(first, second) >= 2.0 * around
    if not (on_base and room and d >= 2.0 * thinnest and deep >= thinnest):
        raise Finger3dError(
            f"[parts.{label}] rigid = true: it is an insert, which the lid holds; it must stand on the base and be "
            f"large enough for two pegs of {2.0 * thinnest:g} mm or more"
        )
    places = [(px, 0.0, pz) for px, pz in (first, second)]
    made, sockets = pegs(places, d, deep, "y", options.gap_mm)
    return made, one(_clear_of_walls([insert], body, options) - sockets, label)


def check_strips(pours: Sequence[Pour], strips: Mapping[FoilSlot, Solid]) -> None:
    """Raise a Finger3dError if the strip of a gauge runs through what the lid of its pour brings into the cavity."""
    for foil, strip in strips.items():
        home = max(pours, key=lambda pour: pour.cast[-1].shared(strip))
        if any(common(strip, solid) > _SHARED_TOLERANCE * float(strip.volume) for solid in home.inside):
            raise Finger3dError(
                f'gauge "{foil.names[0]}": its strip runs through what {home.lid} brings into the cavity; move it into '
                "one solid of silicone, clear of the others"
            )
