"""Tables of the silicones in Markdown, for docs/materials.md."""

from __future__ import annotations

from finger3d.materials.modulus import youngs_modulus
from finger3d.materials.silicones import Silicone, silicones, sources

_HEAD = {
    "silicone": "---",
    "Shore": "---",
    "E (MPa)": "---:",
    "spread": "---:",
    "100 % modulus (psi)": "---:",
    "tension (MPa)": "---:",
    "compression (MPa)": "---:",
    "density (g/ml)": "---:",
    "viscosity (Pa s)": "---:",
    "mix": "---",
    "pot life (min)": "---:",
    "cure (h)": "---:",
    "shrinkage": "---",
    "sources": "---",
}


def reference() -> str:
    """Return the table of silicones, a row each, and the list of sources by number."""
    numbers = {key: number for number, key in enumerate(sources(), start=1)}
    lines = [_row(list(_HEAD)), _row(list(_HEAD.values()))]
    lines += [_row(_cells(one, numbers)) for one in silicones().values()]
    lines += ["", *(f"{number}. {sources()[key]}" for key, number in numbers.items())]
    return "\n".join(lines) + "\n"


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _cells(one: Silicone, numbers: dict[str, int]) -> list[str]:
    modulus = youngs_modulus(one)
    return [
        one.name,
        f"{one.shore:g} A" if one.scale == "A" else f"00-{one.shore:g}",
        f"{modulus.E_MPa:.3g}",
        f"{100.0 * (modulus.spread or 0.0):.0f} %",
        _number(one.modulus_100_psi),
        _number(one.tangent_tension_MPa),
        _number(one.modulus_compression_MPa),
        _number(one.density_g_ml),
        _number(one.viscosity_Pa_s),
        "" if one.mix is None else str(one.mix),
        _number(one.pot_life_min),
        _number(one.cure_h),
        "" if one.shrinkage is None else f"below {100.0 * one.shrinkage:g} %",
        ", ".join(str(numbers[key]) for key in one.sources),
    ]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
