"""Messages about mistakes in a scene, each in one line: key, value, what is allowed, and the nearest name."""

from __future__ import annotations

import difflib
import json
import math
import re
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import annotated_types as at
from pydantic import ValidationError

from finger3d._ranges import Zero, number
from finger3d.errors import Finger3dError
from finger3d.scene.tables import TomlTable

Place = tuple[str | int, ...]


def dotted(place: Place) -> str:
    """``press.leg.0.depth_mm``: the way a key is written for ``--set``."""
    return ".".join(str(p) if isinstance(p, int) or p.isidentifier() else json.dumps(p) for p in place)


def shown(value: object) -> str:
    """Write a value as in TOML, short."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, list | tuple):
        text = "[" + ", ".join(shown(v) for v in value[:8]) + (", ..." if len(value) > 8 else "") + "]"
    elif isinstance(value, str):
        text = json.dumps(value, ensure_ascii=not value.isprintable())
    elif isinstance(value, int) and abs(value) >= 10**30:
        text = "a whole number of more than 30 digits"
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def message(place: Place, value: object, said: str) -> str:
    """Return a key with its value, and what is said about it."""
    return f"{dotted(place)} = {shown(value)}: {said}"


def listed(names: Iterable[str]) -> str:
    """``"a", "b" or "c"``."""
    quoted = [json.dumps(n, ensure_ascii=False) for n in names]
    return quoted[0] if len(quoted) == 1 else ", ".join(quoted[:-1]) + f" or {quoted[-1]}"


def nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the known name that `name` was probably meant to be, ignoring case and a missing unit."""
    spelling = {n.lower(): n for n in names}
    bare = {n.removesuffix("_mm").removesuffix("_deg").removesuffix("_mpa"): n for n in spelling}
    for pool in (spelling, bare):
        if matches := difflib.get_close_matches(name.lower(), pool, n=1, cutoff=0.6):
            return spelling[matches[0]] if pool is spelling else spelling[bare[matches[0]]]
    return None


def choose(place: Place, value: object, names: Sequence[str]) -> str:
    """Return the message about a value that is not one of `names`."""
    near = nearest(value, names) if isinstance(value, str) else None
    hint = f'did you mean "{near}"? ' if near else ""
    return message(place, value, f"{hint}must be {listed(names)}")


def unknown(place: Place, value: object, names: Sequence[str], kind: str = "key") -> str:
    """Return the message about a key or an effect that is not one of `names`."""
    near = nearest(str(place[-1]), names)
    hint = f'; did you mean "{near}"?' if near else ""
    holder = dotted(tuple(p for p in place[:-1] if isinstance(p, str)))
    where = f"[[{holder}]]" if isinstance(place[-2:][0], int) else f"[{holder}]" if holder else "a scene"
    key = dotted(place) if isinstance(value, Mapping) else f"{dotted(place)} = {shown(value)}"
    return f"{key}: no such {kind}{hint} ({where} takes {', '.join(names) if names else 'none'})"


def _bounds(metadata: Iterable[object]) -> str:
    low = high = ""
    for m in metadata:
        if isinstance(m, at.Gt):
            low = f"above {_number(m.gt)}"
        elif isinstance(m, at.Ge):
            low = f"from {_number(m.ge)} up"
        elif isinstance(m, at.Lt):
            high = f"below {_number(m.lt)}"
        elif isinstance(m, at.Le):
            high = f"at most {_number(m.le)}"
        elif isinstance(m, at.Interval):
            return _bounds(iter(m))
    if low.startswith("from") and high:
        low = low.removesuffix(" up")
        return f" {low} to {high.removeprefix('at most ')}" if high.startswith("at most") else f" {low} and {high}"
    return "".join(f" {b}" for b in (" and ".join(t for t in (low, high) if t),) if b)


def _number(value: object) -> str:
    return number(value) if isinstance(value, int | float) else str(value)


def _text(metadata: Sequence[object]) -> str:
    """Return a description of the texts that a type with bounds on their length allows."""
    lines = "one line of printable text" if any(isinstance(m, at.Predicate) for m in metadata) else "a text"
    longest = next((f", of at most {m.max_length} characters" for m in metadata if isinstance(m, at.MaxLen)), "")
    return lines + _filled(metadata) + longest


def _filled(metadata: Sequence[object]) -> str:
    return ", not empty" if any(isinstance(m, at.MinLen) for m in metadata) else ""


def described(hint: Any) -> str:
    """Return a description of what a type with bounds allows, for instance ``a number from 0 to 0.5``."""
    origin = typing.get_origin(hint)
    if hint == Zero:
        return "0"
    if origin is Annotated:
        kind, *metadata = typing.get_args(hint)
        if kind is str:
            return _text(metadata)
        return described(kind) + _bounds(metadata) + _filled(metadata)
    if origin is typing.Literal:
        return listed(str(a) for a in typing.get_args(hint))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(described(a) for a in typing.get_args(hint) if a is not type(None))
    if origin is tuple:
        items = typing.get_args(hint)
        if items[-1] is Ellipsis:
            tables = _is_table(items[0])
            return "a list of tables under double brackets" if tables else f"a list, each item {described(items[0])}"
        return "[" + ", ".join(described(a) for a in items) + "]"
    if _is_table(hint):
        required = ", ".join(n for n, f in hint.model_fields.items() if f.is_required())
        needed = getattr(hint, "needed", required)
        return "a table" + (f" with {needed}" if needed else "")
    names = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
    return names.get(hint, "a table")


def _is_table(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, TomlTable)


def _target(table: type[TomlTable], place: Place) -> tuple[Place, type[TomlTable], Any]:
    """Follow `place` from `table`: the part of it that a user typed, the table that holds its key, the key's type."""
    holder: type[TomlTable] = table
    hint: Any = table
    typed: list[str | int] = []
    for part in place:
        origin = typing.get_origin(hint)
        if origin in (typing.Union, types.UnionType):
            hint = next((a for a in typing.get_args(hint) if _is_table(a)), hint)
        if origin is Annotated:
            hint = typing.get_args(hint)[0]
        if _is_table(hint) and isinstance(part, str):
            holder, hint = hint, typing.get_type_hints(hint, include_extras=True).get(part)
        elif typing.get_origin(hint) is tuple and isinstance(part, int) and _is_table(typing.get_args(hint)[0]):
            hint = typing.get_args(hint)[0]
        elif typing.get_origin(hint) is dict and isinstance(part, str) and _is_table(typing.get_args(hint)[1]):
            hint = typing.get_args(hint)[1]
        else:
            break  # what follows is the checker's own name for a branch of a union, or a place within a list
        typed.append(part)
    return tuple(typed), holder, hint


def _value(tree: Any, place: Place) -> object:
    for part in place:
        tree = tree[part]
    return tree


def messages_from(
    error: ValidationError, table: type[TomlTable], tree: object, under: Place, also: Sequence[str] = ()
) -> dict[Place, str]:
    """Return a message for every finding of a check of `tree` (which stands at `under` in the file) against `table`.

    Parameters
    ----------
    also : keys that this table takes besides the checked ones, for instance ``geometry``
    """
    lines: dict[Place, str] = {}
    meant: set[Place] = set()
    findings = error.errors(include_url=False)
    # Misspelt keys first: a key that is then missing is the same mistake.
    for finding in sorted(findings, key=lambda f: f["type"] != "extra_forbidden"):
        place, holder, hint = _target(table, finding["loc"])
        full = (*under, *place)
        if full in lines or full in meant:
            continue
        if finding["type"] == "extra_forbidden":
            names = [*(also if len(place) == 1 else ()), *holder.model_fields]
            lines[full] = unknown(full, _value(tree, place), names)
            if near := nearest(str(place[-1]), names):
                meant.add((*full[:-1], near))
        elif finding["type"] == "missing" and len(place) == len(finding["loc"]):
            lines[full] = f"{dotted(full)} is missing: {described(hint)} is required"
        else:
            value = _value(tree, place)
            finite = isinstance(value, float) and not math.isfinite(value)
            allowed = described(hint).replace("a number", "a finite number", 1) if finite else described(hint)
            lines[full] = message(full, value, f"must be {allowed}")
    # A list that shrank because of the mistakes in it is not itself a mistake.
    return {p: line for p, line in lines.items() if not any(q != p and q[: len(p)] == p for q in lines)}


def refusal(lines: list[str], path: Path | None, set_keys: Iterable[str] | Mapping[str, str]) -> Finger3dError:
    """Return the error of a scene: its first mistake, the number of the others, and where the key came from."""
    first, more = lines[0], len(lines) - 1
    source = str(path) if path else "scene"
    place = re.split(r"[: ]", first, maxsplit=1)[0] + "."
    if key := next((k for k in set_keys if place.startswith(f"{k}.") or f"{k}.".startswith(place)), None):
        option = set_keys[key] if isinstance(set_keys, Mapping) else "--set"
        source += f" with {option} {key}"
    rest = f" (and {more} more mistake{'s' if more > 1 else ''})" if more else ""
    return Finger3dError(f"{source}: {first}{rest}")
