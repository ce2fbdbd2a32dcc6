"""Tables of docs that a command or the package prints; ``python docs/_quoted.py`` writes them anew.

A table stands between ``<!-- from SOURCE ... -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import itertools
import re
import typing
from collections.abc import Callable, Iterator
from pathlib import Path

import finger3d
from finger3d.effects import effect_names, effect_type
from finger3d.geometry.design import designs
from finger3d.materials.modulus import youngs_modulus
from finger3d.materials.silicones import Silicone, silicones, sources
from finger3d.objects import OBJECTS, RigidObject
from finger3d.scene.messages import described, listed, shown
from finger3d.scene.schema import descriptions
from finger3d.scene.tables import (
    AutoTable,
    ContactTable,
    DomainTable,
    FileTable,
    FrictionTable,
    GaugeTable,
    GripTable,
    LabelsTable,
    LegTable,
    MarkerGridTable,
    MarkerTable,
    MaterialTable,
    MeshFileTable,
    MeshTable,
    PartTable,
    TaxelTable,
    TomlTable,
    table_of,
)

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


def keys() -> str:
    """Return a table for every table of a scene: keys, what is allowed, default, meaning."""
    lines = []
    for title, rows in _tables():
        lines += [f"### `{title}`", "", "| key | allowed | default | meaning |", "|---|---|---|---|"]
        for said, alike in itertools.groupby(rows, key=lambda row: row[1:]):
            names = ", ".join(f"`{key}`" for key, *_ in alike if key)
            lines.append(f"| {names} | {' | '.join(said)} |")
        lines.append("")
    return "\n".join(lines)


_Row = tuple[str, str, str, str]


def _tables() -> Iterator[tuple[str, list[_Row]]]:
    yield (
        "[finger]",
        [("geometry", "a design's name, or the path of a .step, .stl, .msh or .vtu file", "", "what is pressed")],
    )
    for name, design in designs().items():
        yield f'[finger] geometry = "{name}"', _rows_of(table_of(design), design)
    yield "[finger] with a STEP or STL file", _rows_of(FileTable)
    yield "[finger] with a .msh or .vtu file", _rows_of(MeshFileTable)
    yield "[material]", _rows_of(MaterialTable)
    yield "[parts.LABEL]", _rows_of(PartTable)
    common = _rows_of(table_of(RigidObject), RigidObject)
    yield "[object]", [("shape", listed(OBJECTS), '`"plane"`', "what the finger is pressed on"), *common]
    for shape, record in OBJECTS.items():
        yield f'[object] shape = "{shape}"', [row for row in _rows_of(table_of(record), record) if row not in common]
    yield "[friction]", _rows_of(FrictionTable)
    yield "[press] or [[press.leg]]", _rows_of(LegTable)
    yield "[grip]", _rows_of(GripTable)
    yield "[contact]", _rows_of(ContactTable)
    yield "[model]", _rows_of(DomainTable)
    yield "[mesh]", _rows_of(MeshTable)
    yield "[[gauge]]", _rows_of(GaugeTable)
    yield "[[marker]]", _rows_of(MarkerTable)
    yield "[marker_grid]", _rows_of(MarkerGridTable)
    yield "[[taxel]]", _rows_of(TaxelTable)
    yield "[labels]", _rows_of(LabelsTable)
    yield "[effects]", _rows_of(AutoTable)
    for name in effect_names():
        effect = effect_type(name)
        rows = _rows_of(table_of(effect), effect)
        yield f"[effects.{name}]", rows or [("", "no keys", "", (effect.__doc__ or "").split(": none. ")[-1])]


def _rows_of(table: type[TomlTable], documented: type | None = None) -> list[_Row]:
    hints = typing.get_type_hints(table, include_extras=True)
    said = descriptions(documented or table)
    return [
        (
            name,
            described(hints[name]).replace("|", "\\|"),
            _default(field),
            said.get(name) or said[name.removesuffix("_deg")],
        )
        for name, field in table.model_fields.items()
    ]


def _default(field: typing.Any) -> str:
    if field.is_required():
        return "required"
    return "" if field.default is None else f"`{shown(field.default)}`"


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


def silicone_table() -> str:
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


TABLES: dict[str, tuple[str, Callable[[], str]]] = {
    "docs/accuracy.md": ("finger3d cost geometries/fig9.toml", cost_table),
    "docs/scenes.md": ("the tables of finger3d.scene", keys),
    "docs/materials.md": ("finger3d/materials/silicones.toml", silicone_table),
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
