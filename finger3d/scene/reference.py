"""Reference of all keys of a scene in Markdown, from the tables that check them."""

from __future__ import annotations

import dataclasses
import re
import typing
from collections.abc import Iterator

from finger3d.effects import effect_names, effect_type
from finger3d.geometry.registry import designs
from finger3d.objects import OBJECTS, RigidObject
from finger3d.scene.messages import described, listed, shown
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

_SAID = re.compile(r"^    (\w+(?:, \w+)*) : (.+(?:\n     +\S.*)*)", flags=re.MULTILINE)


def reference() -> str:
    """Return a Markdown table: key, what is allowed, default, meaning."""
    lines = ["| key | allowed | default | meaning |", "|---|---|---|---|"]
    for title, rows in _tables():
        lines.append(f"| **`{title}`** | | | |")
        lines += [
            f"| {key and f'`{key}`'} | {allowed} | {default} | {meaning} |" for key, allowed, default, meaning in rows
        ]
    return "\n".join(lines) + "\n"


_Row = tuple[str, str, str, str]


def _tables() -> Iterator[tuple[str, list[_Row]]]:
    yield (
        "[finger]",
        [("geometry", "a design's name, or the path of a .step, .stl, .msh or .vtu file", "", "what is pressed")],
    )
    for name, design in designs().items():
        yield f'[finger] geometry = "{name}"', _rows(table_of(design), design)
    yield "[finger] with a STEP or STL file", _rows(FileTable)
    yield "[finger] with a .msh or .vtu file", _rows(MeshFileTable)
    yield "[material]", _rows(MaterialTable)
    yield "[parts.LABEL]", _rows(PartTable)
    common = _rows(table_of(RigidObject), RigidObject)
    yield "[object]", [("shape", listed(OBJECTS), '`"plane"`', "what the finger is pressed on"), *common]
    for shape, record in OBJECTS.items():
        yield f'[object] shape = "{shape}"', [row for row in _rows(table_of(record), record) if row not in common]
    yield "[friction]", _rows(FrictionTable)
    yield "[press] or [[press.leg]]", _rows(LegTable)
    yield "[grip]", _rows(GripTable)
    yield "[contact]", _rows(ContactTable)
    yield "[model]", _rows(DomainTable)
    yield "[mesh]", _rows(MeshTable)
    yield "[[gauge]]", _rows(GaugeTable)
    yield "[[marker]]", _rows(MarkerTable)
    yield "[marker_grid]", _rows(MarkerGridTable)
    yield "[[taxel]]", _rows(TaxelTable)
    yield "[labels]", _rows(LabelsTable)
    yield "[effects]", _rows(AutoTable)
    for name in effect_names():
        effect = effect_type(name)
        rows = _rows(table_of(effect), effect)
        yield f"[effects.{name}]", rows or [("", "no keys", "", (effect.__doc__ or "").split(": none. ")[-1])]


def _rows(table: type[TomlTable], documented: type | None = None) -> list[_Row]:
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


def descriptions(documented: type) -> dict[str, str]:
    """Return the description of each key in the docstrings of a class and its bases."""
    texts: dict[str, str] = {}
    for base in reversed(documented.__mro__):
        for names, text in _SAID.findall(base.__doc__ or ""):
            texts |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    missing = [f.name for f in dataclasses.fields(documented)] if dataclasses.is_dataclass(documented) else []
    return dict.fromkeys(missing, "") | texts
