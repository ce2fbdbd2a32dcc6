"""Instructions for a mold: what to print, what to cast, and in which order.

Under its own weight alone, a Newtonian liquid of density rho and viscosity eta flows through a vertical cone of length
L, whose radius grows linearly from a to b, at the rate ::

    Q = pi rho g L / (8 eta I),    I = L (a^2 + a b + b^2) / (3 a^3 b^3)

by Hagen and Poiseuille's law with the integral I of 1 / r^4 along the cone.

References
----------
Dow. Tips for successful moldmaking with silicone rubbers: a container of three to five times the volume, vacuum of 27
to 29 inches of mercury, for at most 5 min.
Polytek. What is vacuuming and why should I do it: a container of about four times the volume; vacuum above 20 Pa s.
Smooth-On. FAQ 129, Why didn't my mold rubber cure: seal, and let the sealer dry for 30 min.
Venzac, B. et al. 2021. PDMS curing inhibition on 3D-printed molds: why? Also, how to avoid it? Anal. Chem. 93,
7180-7187: photoinitiators of phosphine oxide leach out and poison the platinum; post-curing by light or heat stops it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import resources
from textwrap import wrap

import numpy as np

from finger3d.materials.modulus import youngs_modulus
from finger3d.materials.silicones import Silicone, silicones
from finger3d.mold.body import Shell
from finger3d.mold.cover import SLOT_GAP_MM, Ports
from finger3d.mold.options import PEG_MM
from finger3d.mold.parts import Mold
from finger3d.mold.pours import Pour, insert_name

CUP = 5.0
"""Volume of the cup for degassing over that of the mixture: Dow's upper bound."""

MIX_MIN, DEGAS_MIN = 3.0, 5.0
"""Minutes of mixing by hand, and of vacuum, which Dow bounds at 5."""

GRAVITY = 9.81

_SHEET = "see the data sheet"


def flow_ml_min(ports: Ports, silicone: Silicone) -> float | None:
    """Return the flow of a silicone through a pour hole by its own weight, ml/min; None without its properties."""
    if silicone.density_g_ml is None or silicone.viscosity_Pa_s is None:
        return None
    a, b = 0.5e-3 * ports.pour_mm, 0.5e-3 * ports.funnel_mm
    integral = (a * a + a * b + b * b) / (3.0 * a**3 * b**3)  # per unit length, 1/m4
    weight = 1e3 * silicone.density_g_ml * GRAVITY  # per volume, N/m3
    return 60e6 * math.pi * weight / (8.0 * silicone.viscosity_Pa_s * integral)


def silicone_lines(silicone: Silicone | None, volume_ml: float, ports: Ports | None, shrinkage: float) -> list[str]:
    """Return components, times and shrinkage of a silicone.

    Parameters
    ----------
    silicone : None if the scene names none
    volume_ml : of the mixture
    ports : of the lid through which it is poured; None if it is poured into the open mold
    shrinkage : relative, that the cavity allows for
    """
    cup = f"  cup to degas        at least {CUP * volume_ml:.0f} ml: under vacuum it foams to 3 to 5 times its volume"
    if silicone is None:
        return [
            cup,
            '  With [material] silicone = "NAME" in the scene there are grams, mix ratio and times here; names are in',
            "  docs/materials.md.",
        ]
    modulus = youngs_modulus(silicone)
    hardness = f"Shore A {silicone.shore:g}" if silicone.scale == "A" else f"Shore 00-{silicone.shore:g}"
    spread = 100.0 * (modulus.spread or 0.0)
    return [
        f"  {silicone.name:<19} {silicone.maker}, {hardness}, E = {modulus.E_MPa:.3g} MPa +- {spread:.0f} %",
        *_components(silicone, volume_ml),
        cup,
        *_pouring(silicone, volume_ml, ports),
        f"  out of the mold     {_hours(silicone.cure_h)}",
        *([f"  post-cure           {silicone.post_cure}"] if silicone.post_cure else []),
        *_shrinkage(silicone, shrinkage),
        *([f"  note                {silicone.note}"] if silicone.note else []),
    ]


def _components(silicone: Silicone, volume_ml: float) -> list[str]:
    """Return the amount of each component; too much where the density is not known."""
    density = silicone.density_g_ml
    grams = volume_ml * (density or max(one.density_g_ml or 0.0 for one in silicones().values()))
    mixed = f"  weigh               {grams:.1f} g in all" + (
        "" if density else ", with the largest density of the table"
    )
    if silicone.mix is None:
        return [f"{mixed}; mix ratio: {_SHEET}"]
    fraction_a = silicone.mix.share_a
    if "weight" in silicone.mix.by:
        parts = f"{fraction_a * grams:.1f} g of A and {(1.0 - fraction_a) * grams:.1f} g of B"
        return [f"{mixed}: {parts} ({silicone.mix})"]
    parts = f"{fraction_a * volume_ml:.1f} ml of A and {(1.0 - fraction_a) * volume_ml:.1f} ml of B"
    return [f"  measure             {volume_ml:.1f} ml in all: {parts} ({silicone.mix})"]


def _pouring(silicone: Silicone, volume_ml: float, ports: Ports | None) -> list[str]:
    """Return the pot life against the time of mixing, degassing and pouring."""
    life = silicone.pot_life_min
    if life is None:
        return [f"  pot life            {_SHEET}; mixing takes {MIX_MIN:g} min, degassing {DEGAS_MIN:g} min"]
    left = life - MIX_MIN - DEGAS_MIN
    said = f"  pot life            {life:g} min at 23 degrees, less when warmer"
    if left < 2.0:
        return [f"{said}: no time to degas it; mix slowly for {min(MIX_MIN, life / 2.0):g} min and pour at once"]
    lines = [f"{said}: mix {MIX_MIN:g} min, degas {DEGAS_MIN:g} min; {left:g} min are left to fill the mold"]
    flow = None if ports is None else flow_ml_min(ports, silicone)
    if flow is None:
        return lines
    minutes = float(f"{volume_ml / flow:.2g}")
    lines.append(f"  flow                {flow:.2g} ml a minute through the hole by its own weight: {minutes:g} min")
    if minutes > 0.5 * left:
        lines.append(
            "                      too slow: press it in through the hole with a syringe, until it stands in the vents,"
            " or widen the hole with --pour-mm"
        )
    return lines


def _hours(hours: float | None) -> str:
    if hours is None:
        return f"after the cure time ({_SHEET})"
    return f"after {hours:g} h" + (f" ({60.0 * hours:g} min)" if hours < 1.0 else "") + " at 23 degrees"


def _shrinkage(silicone: Silicone, allowed: float) -> list[str]:
    if silicone.shrinkage is None:
        return []
    bound = f"  shrinkage           below {100.0 * silicone.shrinkage:g} % of every length by the data sheet"
    if allowed > silicone.shrinkage:
        return [f"{bound}; the mold allows for more"]
    return [bound]


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
