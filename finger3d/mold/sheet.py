"""Instructions for a mold: what to print, what to cast, and in which order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from finger3d.materials.silicones import Silicone
from finger3d.mold import casting
from finger3d.mold.body import Shell
from finger3d.mold.parts import Mold, Pour


def prepare_lines(mold: Mold) -> list[str]:
    """Return what is done to the open halves."""
    o = mold.options
    lines = ["Spray every face that silicone touches with a release agent that is safe for platinum silicones."]
    if o.seal == "cord":
        lines.append(f"Lay a silicone cord of {o.cord_mm:g} mm into the groove of half A, and one around the base.")
    if (bolts := mold.bolts) is not None:
        lines.append(f"Push {bolts.number} {o.screw} nuts into the traps of half A, {bolts.trap_mm:.3g} mm deep.")
    return lines


def thread_lines(mold: Mold) -> list[str]:
    """Return how the strips of gauges come into the mold; nothing without gauges."""
    if not mold.foils:
        return []
    return ["Thread the strips through half B and then through half A."]


def close_lines(mold: Mold) -> list[str]:
    """Return how the halves are joined."""
    o = mold.options
    lines = ["Push half A onto the pegs of half B: one peg is thinner, so that it fits one way only."]
    if mold.foils and o.plugs:
        lines.append("Stretch the strips. Push the plugs over them, open ends of the slits first, into the pockets.")
    elif mold.foils:
        lines.append("Stretch the strips, and seal the slots with tape.")
    if (bolts := mold.bolts) is not None:
        lines.append(f"Tighten {bolts.number} screws {o.screw} x {bolts.length_mm:g} from half B, by hand.")
    if o.fasten == "bands":
        lines.append(f"Put rubber bands up to {o.band_mm:g} mm wide into the grooves around the halves.")
    return lines


def pour_lines(mold: Mold, pour: Pour) -> list[str]:
    """Return how one pour is made, from the lid to the level of the silicone."""
    what = f"{pour.silicone_mm3 / 1e3:.2f} ml"
    lid = pour.lid if len(mold.pours) > 1 else "carrier, with its pins," if mold.options.carrier else "lid"
    lines = []
    if any(name.startswith("insert") for name in pour.others):
        lines.append("Push the inserts onto the pegs of the lid: they stay in the finger.")
    if pour.ports is None:
        lines += [
            f"Stand the mold with the open side, the base, up. Pour {what} of the silicone for {pour.name}.",
            f"Push {pour.lid} in slowly: surplus and air leave through the channels at its ends. Let it cure, and pull "
            "the lid off.",
        ]
        return lines
    riser = " and the riser into it" if pour.ports.riser is not None else ""
    bands = ", and hold them with rubber bands" if mold.options.fasten != "none" else ""
    lines.append(f"Stand the mold with the open side, the base, up. Push the {lid} on{riser}{bands}; keep it level.")
    until = "every hole of the carrier" if mold.options.carrier else "all vents"
    lines.append(
        f"Pour {what} and what the openings take through the hole of {pour.ports.pour_mm:.3g} mm, until silicone "
        f"stands in {until}{' and in the riser' if riser else ''}."
    )
    return lines


def open_lines(mold: Mold) -> list[str]:
    """Return how the mold is opened."""
    if mold.options.carrier:
        lines = ["After curing pull the pins out, and cut the silicone below the riser; the carrier stays on."]
    else:
        lines = ["After curing cut the silicone below the riser and in the vents, and lift the lid off."]
    if mold.foils:
        lines.append("Cut the strips outside the mold.")
    along = f"lide the halves apart along {mold.options.split}."
    lines.append(f"Turn a screwdriver in the notches, and s{along}" if mold.options.pry else f"S{along}")
    return lines


Sizes = tuple[float, float, float] | NDArray[np.float64]

SPARE = 1.15
"""Ratio of the silicone to mix to the volume of cavity and openings."""

_WIDTH = 112  # of a line, in characters

NAMES = {"half_a": "half A (holes)", "half_b": "half B (pegs)"}


def oversize(part: Shell, bed: Sizes) -> str:
    """Return why a part does not fit the printer in either orientation on the bed; empty if it fits."""
    long, short = sorted(part.extent[:2], reverse=True)
    most, least = sorted(bed[:2], reverse=True)
    if long <= most and short <= least and part.extent[2] <= bed[2]:
        return ""
    return f"{_sizes(part.extent)} mm is too large for {_sizes(bed)} mm"


def sheet(title: str, mold: Mold, printed: Mapping[str, Shell], plate: Sizes, silicone: Silicone | None = None) -> str:
    """Return the instructions.

    Parameters
    ----------
    printed : the parts as they lie on the bed
    plate : length, width and height of all parts together, as in the 3MF file
    silicone : that the scene names; None if it names none
    """
    o = mold.options
    ports = mold.openings_mm3
    cavity = mold.silicone_mm3
    mixed_ml = SPARE * (cavity + ports) / 1e3
    hole = casting.PourHole(mold.ports.pour_mm, mold.ports.outside_mm, o.cover_mm)
    lines = [
        f"Mold of {title}",
        "",
        "Sizes are mm.",
        "",
        "SILICONE",
        f"  cavity              {cavity / 1e3:.2f} ml",
        f"  openings, riser     {ports / 1e3:.2f} ml",
        f"  mix about           {mixed_ml:.1f} ml ({100 * (SPARE - 1):.0f} % more than both)",
        f"  shrinkage allowed   {100 * o.shrinkage:g} % of every length: the cavity is the sensor times {o.scale:.6g}",
        *casting.silicone_lines(silicone, mixed_ml, hole, o.shrinkage),
        "",
        "PARTS",
    ]
    for name, part in printed.items():
        why = oversize(part, o.bed_mm)
        called = NAMES.get(name, name.replace("_", " "))
        lines.append(f"  {called:<17} {_sizes(part.extent):<20} {f'mold_{name}.stl':<16} {why or 'fits the bed'}")
    fits = _fits(plate, o.bed_mm)
    lines += [
        f"  all, on the bed   {_sizes(plate):<20} {'mold.3mf':<16} "
        + ("fit the bed together" if fits else "do not fit the bed: print them one by one"),
        f"  bed               {_sizes(o.bed_mm)}",
        "",
        "PRINT",
        "  The files lie as they should be printed: outer faces down, pegs up, no support needed.",
        f"  Pegs of {o.peg_mm:g} mm have {o.gap_mm:g} mm of room all around; one of each pattern is thinner, so",
        "  that no part fits the wrong way round.",
        "",
        *casting.surface_lines(o.split),
        *casting.inhibition_lines(),
        *_gauge_lines(mold),
        *casting.mixing_lines(),
        "POUR",
        *_numbered(
            [
                *prepare_lines(mold),
                *thread_lines(mold),
                *close_lines(mold),
                *(line for pour in mold.pours for line in pour_lines(mold, pour)),
                *open_lines(mold),
            ]
        ),
        "",
    ]  # fmt: skip
    return "\n".join(lines)


def _numbered(steps: Sequence[str]) -> list[str]:
    """Return steps with numbers, in lines of the width of a sheet of paper."""
    lines = []
    for i, step in enumerate(steps, 1):
        lines += wrap(step, _WIDTH, initial_indent=f"{i:>3}. ", subsequent_indent="     ")
    return lines


def _gauge_lines(mold: Mold) -> list[str]:
    if not mold.foils:
        return ["GAUGES", "  The scene has none.", ""]
    low, high = mold.outline
    scale, gap = mold.options.scale, 2.0 * mold.options.slot_gap_mm
    lines = [
        "GAUGES",
        f"  A strip carries each foil through both walls: {high[2] - low[2]:.4g} mm in the mold, 20 mm at either end.",
        "  Places are those in the mold, x and y as in the scene; z from half B's outer face to the foil's middle.",
    ]
    for foil in mold.foils:
        for name, z in zip(foil.names, foil.z_mm, strict=True):
            x, y, degrees = foil.x_mm * scale, foil.y_mm * scale, np.degrees(foil.angle)
            lines.append(
                f"  {name:<10} x {x:.4g}, y {y:.4g}, at {degrees:.4g} deg; "
                f"foil {foil.length_mm:g} x {foil.width_mm:g} x {foil.thickness_mm:g}, z {z * scale - low[2]:.4g}; "
                f"slot {foil.length_mm + gap:.4g} x {foil.thickness_mm + gap:.4g}"
            )
    return [*lines, ""]


def _fits(size: Sizes, bed: Sizes) -> bool:
    return bool(np.all(np.sort(size[:2]) <= np.sort(bed[:2])) and size[2] <= bed[2])


def _sizes(size: Sizes) -> str:
    return " x ".join(f"{s:.1f}".removesuffix(".0") for s in size)
