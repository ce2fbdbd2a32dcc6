"""Instructions for a mold: what to print, what to cast, and in which order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from textwrap import wrap

import numpy as np

from finger3d.materials.silicones import Silicone
from finger3d.mold.body import Shell
from finger3d.mold.casting import DEGAS_MIN, MIX_MIN, silicone_lines
from finger3d.mold.foils import SLOT_GAP_MM
from finger3d.mold.options import PEG_MM
from finger3d.mold.parts import Mold
from finger3d.mold.pours import Pour, insert_name


def prepare_lines(mold: Mold) -> list[str]:
    """Return what is done to the open halves."""
    lines = ["Spray every face that silicone touches with a release agent that is safe for platinum silicones."]
    if mold.pours[-1].inserts:
        lines[0] = lines[0].replace("touches with", "touches, but not the inserts, with")
    if (bolts := mold.bolts) is not None:
        lines.append(
            f"Push {bolts.number} {mold.options.screw} nuts into the traps of half A, {bolts.trap_mm:.3g} mm deep."
        )
    if mold.foils:
        lines.append("Thread the strips of the gauges through half B and then through half A.")
    return lines


def close_lines(mold: Mold) -> list[str]:
    """Return how the halves are joined."""
    lines = ["Push half A onto the pegs of half B: one peg is thinner, so that it fits one way only."]
    if mold.foils:
        lines.append("Stretch the strips, and seal the slots with tape.")
    if (bolts := mold.bolts) is None:
        lines.append("Hold the halves together with clamps or rubber bands.")
    else:
        lines.append(f"Tighten {bolts.number} screws {mold.options.screw} x {bolts.length_mm:g} from half B, by hand.")
    return lines


def pour_lines(mold: Mold, pour: Pour) -> list[str]:
    """Return how one pour is made, from the lid to the level of the silicone."""
    what = f"{pour.silicone_mm3 / 1e3:.2f} ml"
    lid = pour.lid if len(mold.pours) > 1 else "the lid"
    lines = [
        f"Push {label}, which is printed (mold_{insert_name(label)}.stl), onto its pegs on {lid}: it stays in the "
        "finger." for label in pour.inserts
    ]  # fmt: skip
    if pour.ports is None:
        named = f" for {pour.name}" if len(mold.pours) > 1 else ""
        lines += [
            f"Stand the mold with the open side, the base, up. Pour {what} of the silicone{named}.",
            f"Push {lid} in slowly: surplus and air leave through the channels at its ends. Hold it with clamps or "
            "rubber bands.",
        ]
    else:
        lines += [
            f"Stand the mold with the open side, the base, up. Push {lid} on, and hold it with clamps or rubber "
            "bands; keep it level.",
            f"Pour {what} and what the openings take through the hole of {pour.ports.pour_mm:.3g} mm, until silicone "
            "stands in all vents and in the funnel, from which it follows as bubbles rise.",
        ]
    if pour is not mold.pours[-1]:
        lines.append(f"Let it cure, and pull {lid} off.")
    return lines


def open_lines(mold: Mold) -> list[str]:
    """Return how the mold is opened."""
    lines = ["After curing cut the silicone in the openings, and lift the lid off."]
    if mold.foils:
        lines.append("Cut the strips outside the mold.")
    return [*lines, f"Slide the halves apart along {mold.options.split}."]


SPARE = 1.15
"""Ratio of the silicone to mix to the volume of cavity and openings."""

_WIDTH = 112  # of a line, in characters

NAMES = {"half_a": "half A (holes)", "half_b": "half B (pegs)"}


def sheet(title: str, mold: Mold, printed: Mapping[str, Shell], silicone: Silicone | None = None) -> str:
    """Return the instructions.

    Parameters
    ----------
    printed : the parts as they lie on the bed
    silicone : that the scene names; None if it names none
    """
    o = mold.options
    cavity, openings = mold.silicone_mm3 / 1e3, mold.openings_mm3 / 1e3
    mixed_ml, inserts = SPARE * (cavity + openings), ", ".join(mold.pours[-1].inserts)
    steps = [*prepare_lines(mold), *close_lines(mold), *(line for p in mold.pours for line in pour_lines(mold, p))]
    parts = [f"  {NAMES.get(n, n.replace('_', ' ')):<17} {sizes(p):<20} mold_{n}.stl" for n, p in printed.items()]
    template = resources.files("finger3d.mold").joinpath("sheet_template.txt").read_text(encoding="utf-8")
    return template.format(
        title=title,
        cavity_ml=cavity,
        without=f", without what is inserted: {inserts}" if inserts else "",
        openings_ml=openings,
        mixed_ml=mixed_ml,
        spare=100 * (SPARE - 1),
        shrinkage=100 * o.shrinkage,
        scale=o.scale,
        silicone="\n".join(silicone_lines(silicone, mixed_ml, mold.ports[-1] if mold.ports else None, o.shrinkage)),
        parts="\n".join(parts),
        peg_mm=PEG_MM,
        gap_mm=o.gap_mm,
        split=o.split,
        along="x" if o.split == "z" else "z",
        gauges="\n".join(_gauge_lines(mold)),
        mix_min=MIX_MIN,
        degas_min=DEGAS_MIN,
        steps="\n".join(_numbered([*steps, *open_lines(mold)])),
    )


def _numbered(steps: Sequence[str]) -> list[str]:
    """Return steps with numbers, in lines of the width of a sheet of paper."""
    lines = []
    for i, step in enumerate(steps, 1):
        lines += wrap(step, _WIDTH, initial_indent=f"{i:>3}. ", subsequent_indent="     ")
    return lines


def _gauge_lines(mold: Mold) -> list[str]:
    if not mold.foils:
        return ["  The scene has none."]
    low, high = mold.layout.outer_low[2], mold.layout.outer_high[2]
    scale, gap = mold.options.scale, 2.0 * SLOT_GAP_MM
    lines = [
        f"  A strip carries each foil through both walls: {high - low:.4g} mm in the mold, 20 mm at either end.",
        "  Places are those in the mold, x and y as in the scene; z from half B's outer face to the foil's middle.",
    ]
    for foil in mold.foils:
        for name, z in zip(foil.names, foil.z_mm, strict=True):
            x, y, degrees = foil.x_mm * scale, foil.y_mm * scale, np.degrees(foil.angle)
            lines.append(
                f"  {name:<10} x {x:.4g}, y {y:.4g}, at {degrees:.4g} deg; "
                f"foil {foil.length_mm:g} x {foil.width_mm:g} x {foil.thickness_mm:g}, z {z * scale - low:.4g}; "
                f"slot {foil.length_mm + gap:.4g} x {foil.thickness_mm + gap:.4g}"
            )
    return lines


def sizes(part: Shell) -> str:
    """Return the size of a part in words, mm."""
    return " x ".join(f"{size:.1f}".removesuffix(".0") for size in part.extent)
