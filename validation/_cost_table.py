"""The table of docs/cost.md, from the results of cost_of_accuracy: `python -m validation._cost_table` prints it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ._cost import LARGE, SECTION, SOLID
from ._rows import committed

BODIES = (SECTION, SOLID, *LARGE.values())
NUMBERS = {
    "force": "force", "friction_sum": "friction sum", "gauge_strain": "gauge strain",
    "contact_length": "extent of contact", "stick_length": "extent of the stick zone",
}  # fmt: skip
UNITS = (("h", 3600.0), ("min", 60.0))
DAY_S = 86_400.0


def markdown(lines: Sequence[Mapping[str, str]]) -> list[str]:
    """Return the lines of the table in docs/ with its legend, from those of the study's table."""
    cells: dict[tuple[str, str], list[str]] = {}
    for line in lines:
        if line["kind"] == "use" and line["body"] in BODIES:
            cells.setdefault((line["body"], line["quantity"]), []).append(_cell(line))
    head = ["| Fig. 9 finger, 10 mm | 5 % | 1 % | 0.1 % |", "|---|---|---|---|"]
    rows = [(f"{body}: {name}", cells[body, number]) for body in BODIES for number, name in NUMBERS.items()]
    legend = ", ".join(
        f"{float(line['rate']):.2g} ({NUMBERS[line['quantity']]})"
        for line in lines
        if line["kind"] == "rate of the error"
    )
    table = [f"| {' | '.join([name, *_without_repeats(row)])} |" for name, row in rows]
    return (
        [*head, *table, "", f"Powers of the edge length with which errors fall: {legend}."] if legend else head + table
    )


def _without_repeats(row: Sequence[str]) -> list[str]:
    return [row[0], *("the same" if cell == before else cell for before, cell in zip(row, row[1:], strict=False))]


def _cell(line: Mapping[str, str]) -> str:
    """Return mesh, increments, time and memory of less than a day; in italics if they are extrapolated."""
    if not line["element"]:
        return "truth too uncertain"
    if float(line["seconds"]) > DAY_S:
        return "over a day"
    mesh = f"{line['element'][0].upper()} {float(line['size_mm']):.2g} mm, {line['steps']}"
    text = f"{mesh}: {_time(float(line['seconds']))}, {_memory(float(line['peak_MB']))}"
    return f"*{text}*" if line.get("extrapolated") else text


def _time(seconds: float) -> str:
    unit, scale = next(((unit, scale) for unit, scale in UNITS if seconds >= 2.0 * scale), ("s", 1.0))
    return f"{_short(seconds / scale)} {unit}"


def _memory(megabytes: float) -> str:
    return f"{_short(1e-3 * megabytes)} GB" if megabytes >= 1e3 else f"{_short(megabytes)} MB"


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


if __name__ == "__main__":
    print("\n".join(markdown(committed("cost_of_accuracy"))))
