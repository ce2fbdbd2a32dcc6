"""Casting instructions: components, times, cure inhibition and surface.

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
from dataclasses import dataclass
from typing import Literal

from finger3d.materials.modulus import youngs_modulus
from finger3d.materials.silicones import Silicone, silicones

CUP = 5.0
"""Volume of the cup for degassing over that of the mixture: Dow's upper bound."""

MIX_MIN, DEGAS_MIN = 3.0, 5.0
"""Minutes of mixing by hand, and of vacuum, which Dow bounds at 5."""

GRAVITY = 9.81

_SHEET = "see the data sheet"


@dataclass(frozen=True)
class PourHole:
    """Conical hole: diameter at the sensor, at the top, and length, mm."""

    narrow_mm: float
    wide_mm: float
    length_mm: float

    def flow_ml_min(self, silicone: Silicone) -> float | None:
        """Return the flow of a silicone by its own weight, ml/min; None without its density and viscosity."""
        if silicone.density_g_ml is None or silicone.viscosity_Pa_s is None:
            return None
        a, b = (0.5e-3 * d for d in (self.narrow_mm, self.wide_mm))
        integral = (a * a + a * b + b * b) / (3.0 * a**3 * b**3)  # per unit length, 1/m4
        weight = 1e3 * silicone.density_g_ml * GRAVITY  # per volume, N/m3
        return 60e6 * math.pi * weight / (8.0 * silicone.viscosity_Pa_s * integral)


def silicone_lines(silicone: Silicone | None, volume_ml: float, hole: PourHole | None, shrinkage: float) -> list[str]:
    """Return components, times and shrinkage of a silicone.

    Parameters
    ----------
    silicone : None if the scene names none
    volume_ml : of the mixture
    hole : through which it is poured; None if it is poured into the open mold
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
        *_pouring(silicone, volume_ml, hole),
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


def _pouring(silicone: Silicone, volume_ml: float, hole: PourHole | None) -> list[str]:
    """Return the pot life against the time of mixing, degassing and pouring."""
    life = silicone.pot_life_min
    if life is None:
        return [f"  pot life            {_SHEET}; mixing takes {MIX_MIN:g} min, degassing {DEGAS_MIN:g} min"]
    left = life - MIX_MIN - DEGAS_MIN
    said = f"  pot life            {life:g} min at 23 degrees, less when warmer"
    if left < 2.0:
        return [f"{said}: no time to degas it; mix slowly for {min(MIX_MIN, life / 2.0):g} min and pour at once"]
    lines = [f"{said}: mix {MIX_MIN:g} min, degas {DEGAS_MIN:g} min; {left:g} min are left to fill the mold"]
    flow = None if hole is None else hole.flow_ml_min(silicone)
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


def mixing_lines() -> list[str]:
    """Return the steps from the tins to the liquid that is poured."""
    return [
        "MIX",
        "  1. Let tins, cup and mold come to 23 degrees. Wear vinyl gloves, never latex, whose sulphur stops the cure.",
        "  2. Stir each component, then weigh both into one cup.",
        f"  3. Mix slowly for {MIX_MIN:g} min; scrape sides and bottom, where unmixed silicone stays liquid for ever.",
        f"  4. Degas at 0.91 bar below the air or more (27 inches of mercury), at most {DEGAS_MIN:g} min: it rises and",
        "     falls, and is done a minute after. Let the air in slowly.",
        "",
    ]


def inhibition_lines() -> list[str]:
    """Return the lines on cure inhibition of platinum silicones and how to prevent it."""
    return [
        "CURE INHIBITION",
        "  Sulphur (latex, some clays), tin (condensation silicones), amines (hardeners of epoxy) and uncured printing",
        "  resin poison the platinum: the silicone stays sticky where it touches them.",
        "  Filament (PLA, PETG, ABS): wipe with isopropanol and let it dry.",
        "  Resin (SLA, DLP): 1. wash until nothing is sticky; 2. post-cure by light and heat, longer than the resin",
        "  asks for; 3. seal every face of the cavity with two thin coats of clear acrylic lacquer, each dried for",
        "  30 min; 4. release agent.",
        "  Test first: a spoonful on an outer face, for the cure time. Sticky: seal once more, or print from filament.",
        "",
    ]


def surface_lines(split: Literal["z", "x"]) -> list[str]:
    """Return how printed layers mark the friction face, and how to smooth the mold there.

    Parameters
    ----------
    split : axis along which the halves open, and along which their layers are stacked
    """
    along, across = ("x", "z") if split == "z" else ("z", "x")
    return [
        "FRICTION FACE",
        "  Silicone copies every layer, and a ribbed face has another friction along the ribs than across them.",
        f"  The halves are printed with {split} up: ribs run along {along}; a slide along {across} goes across them.",
        "  Only the face that touches needs to be smooth:",
        "  1. thinnest layers there, 0.1 mm or less, the outer wall slow;",
        "  2. sand along the ribs, 220 to 600 grit, wet; or acetone vapour, on ABS and ASA only;",
        "  3. fill with two thin coats of clear acrylic lacquer. A coat of epoxy must cure fully and be sealed with",
        "     lacquer, since its amine stops the cure.",
        "  Coats make the cavity smaller: 0.05 mm of coat is 0.05 mm of height.",
        "",
    ]
