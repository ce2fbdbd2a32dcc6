"""Components, times and shrinkage of a silicone for casting; sheet_template.txt says what is the same for all.

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

from finger3d.materials.modulus import youngs_modulus
from finger3d.materials.silicones import Silicone, silicones
from finger3d.mold.cover import Ports

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
