"""Tables of docs that a command or the package prints; ``python docs/_quoted.py`` writes them anew.

A table stands between ``<!-- from SOURCE ... -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import finger3d
from finger3d.materials import reference as silicones
from finger3d.scene import reference as keys

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = {"normal_force_N": "normal force", "gauge_g36": "gauge", "stick_area_mm2": "stick area"}


def cost_table() -> str:
    """Return the rows of ``finger3d cost geometries/fig9.toml`` that fit into memory, to two digits."""
    found = finger3d.cost(ROOT / "geometries" / "fig9.toml")
    lines = [["", "edges, mm", "unknowns", "seconds", "memory", *COLUMNS.values()]]
    for row in found.rows:
        if row.dofs:
            lines.append(
                [
                    "default" if row.error is None else f"{100.0 * row.error:g} %",
                    f"{row.mesh.size_mm:.2g} to {row.mesh.base_size_mm:.2g}",
                    f"{float(f'{row.dofs:.2g}'):,.0f}".replace(",", " "),
                    f"{float(f'{row.seconds:.2g}'):g}",
                    f"{1e-3 * row.memory_MB:.2g} GB",
                    *(f"{100.0 * row.errors[name]:.2g} %" for name in COLUMNS),
                ]
            )
    lines.insert(1, ["---"] * len(lines[0]))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


TABLES: dict[str, tuple[str, Callable[[], str]]] = {
    "docs/accuracy.md": ("finger3d cost geometries/fig9.toml", cost_table),
    "docs/scenes.md": ("finger3d.scene.reference", keys.reference),
    "docs/materials.md": ("finger3d.materials.reference", silicones.reference),
}
"""By page: what its table comes from, and the function that returns it."""


def parts(page: str) -> tuple[str, str, str]:
    """Return the text before the table of a page, the table, and the text after it."""
    source, _ = TABLES[page]
    before, table, after = re.split(
        rf"(?<=<!-- from {re.escape(source)} -->\n)(.*?)(?=<!-- end -->)",
        (ROOT / page).read_text(encoding="utf-8"),
        maxsplit=1,
        flags=re.DOTALL,
    )
    return before, table, after


if __name__ == "__main__":
    for page, (_, table) in TABLES.items():
        before, _, after = parts(page)
        (ROOT / page).write_text(before + table() + after, encoding="utf-8")
