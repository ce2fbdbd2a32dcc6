"""Rows of a study: numbers compared with a reference, and their text in tables."""

from __future__ import annotations

import csv
import math
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Tree, TreeView
from finger3d.errors import MissingError

Kind = Literal["verification", "validation", "sensitivity", "statement"]
Measure = Literal["relative", "absolute", "at most", "at least"]

PAPER = "Maeno 2004"
"""Beginning of the reference of a statement of the paper."""

GOAL = "goal of this project"
ROBUST = "what a robust method does; REFERENCES.md, 8.2"
"""References of many rows."""

COLUMNS = ("what", "kind", "reference", "wanted", "got", "measure", "error", "tolerance", "reason", "verdict")
"""Columns of a results file."""


@dataclass(frozen=True)
class Row:
    """Comparison of one number with its reference.

    Attributes
    ----------
    what : quantity that was measured, with its unit
    reference : page, formula or code that `wanted` comes from
    tolerance, reason : largest error that passes, and its justification
    kind : a "statement" is reported as holding or not, and never fails
    measure : definition of the error: |got - wanted| / |wanted|, |got - wanted|, or the excess of `got` over a bound
        `wanted`
    """

    what: str
    reference: str
    wanted: float
    got: float
    tolerance: float
    reason: str
    kind: Kind = "verification"
    measure: Measure = "relative"

    @property
    def error(self) -> float:
        """Error as `measure` defines it; never negative."""
        away = self.got - self.wanted
        if self.measure == "relative":
            return abs(away) / abs(self.wanted)
        # in this order max hands NaN on; adding 0 turns -0.0 into 0.0
        return {"absolute": abs(away), "at most": max(away, 0.0), "at least": max(-away, 0.0) + 0.0}[self.measure]

    @property
    def within(self) -> bool:
        """Whether the error is within the tolerance; never for NaN."""
        return self.error <= self.tolerance

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance, or the row is a statement with a finite error."""
        return self.within or (self.kind == "statement" and math.isfinite(self.error))

    @property
    def verdict(self) -> str:
        """Return "pass", "FAIL", "holds" or "does not hold"."""
        if self.kind == "statement" and self.passed:
            return "holds" if self.within else "does not hold"
        return "pass" if self.passed else "FAIL"

    def columns(self) -> Tree:
        """Return the columns of the results file."""
        return {k: getattr(self, k) for k in COLUMNS}


def at_most(
    what: str, reference: str, bound: float, got: float, reason: str = "a bound", kind: Kind = "verification"
) -> Row:
    """Return a row of a number that must not exceed a bound."""
    return Row(what, reference, bound, got, 0.0, reason, kind, "at most")


def at_least(
    what: str, reference: str, bound: float, got: float, reason: str = "a bound", kind: Kind = "verification"
) -> Row:
    """Return a row of a number that must not fall below a bound."""
    return Row(what, reference, bound, got, 0.0, reason, kind, "at least")


def zero(what: str, reference: str, got: float, tolerance: float, reason: str, kind: Kind = "verification") -> Row:
    """Return a row of a number that should be zero."""
    return Row(what, reference, 0.0, got, tolerance, reason, kind, "absolute")


def given(file: str) -> Tree:
    """Return the data of a study, a TOML file beside it."""
    return tomllib.loads(Path(file).with_suffix(".toml").read_text("utf-8"))


def listed(file: str) -> Callable[..., Row]:
    """Return a function that makes the rows which the data of a study list by name.

    It takes the name, the number found, what is wanted and the tolerance where these are not listed, and by keyword the
    words that stand in braces in the texts.
    """
    rows: Tree = given(file)["row"]

    def judged(
        name: str, got: float, /, wanted: float | None = None, tolerance: float | None = None, **words: Any
    ) -> Row:
        given = {"wanted": wanted, "tolerance": tolerance}
        row = rows[name] | {key: value for key, value in given.items() if value is not None}
        texts = {key: row[key].format(**given, **words) for key in ("what", "reference", "reason")}
        return Row(**row | texts | {"got": float(got), "wanted": float(row["wanted"])})

    return judged


class Settled(NamedTuple):
    """Increments of all histories of a study: how many converged, of how many, and their largest residual."""

    converged: int
    increments: int
    residual: float | None

    def __str__(self) -> str:
        largest = "" if self.residual is None else f", largest residual {self.residual:.1e}"
        return f"{self.converged} of {self.increments} increments settle{largest}"


def settled(counts: Sequence[Settled]) -> Settled:
    """Return the sum over several studies or parts of one."""
    converged, increments, residuals = zip(*counts, strict=True)
    return Settled(sum(converged), sum(increments), None if None in residuals else max(residuals))


@dataclass(frozen=True)
class Result:
    """Outcome of a study.

    Attributes
    ----------
    rows, table : of its results
    figure : draws on a matplotlib Figure
    settled : of a study that counts the increments that converge
    parts : by name, of a study whose parts have a table and a figure each
    """

    rows: tuple[Row, ...]
    table: Mapping[str, ArrayLike] | None = None
    figure: Callable[[Any], None] | None = None
    settled: Settled | None = None
    parts: Mapping[str, Result] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every row passes."""
        return all(row.passed for row in self.rows)


def together(size: tuple[float, ...], /, **parts: Result) -> Result:
    """Return the result of a study of several parts: their rows, and tables and figures one below the other.

    Parameters
    ----------
    size : width of the figure, and its height or that of every part, inches
    """

    def draw(figure: Any) -> None:
        width, *heights = size
        figure.set_size_inches(width, sum(heights))
        ratios = heights if len(heights) > 1 else None
        for part, panel in zip(parts.values(), figure.subfigures(len(parts), 1, height_ratios=ratios), strict=True):
            part.figure(panel)

    lines = [
        {"part": name, **dict(zip(part.table, line, strict=True))}
        for name, part in parts.items()
        for line in zip(*part.table.values(), strict=True)
    ]
    return Result(tuple(row for part in parts.values() for row in part.rows), of_records(lines), draw)


def in_parts(quick: bool, *modules: Any) -> Result:
    """Return the result of a study whose parts are modules beside it: their rows, and the table and figure of each."""
    parts = {module.__name__.rpartition(".")[2].lstrip("_"): module.run(quick) for module in modules}
    counts = [part.settled for part in parts.values() if part.settled]
    rows = tuple(row for part in parts.values() for row in part.rows)
    return Result(rows, settled=settled(counts) if counts else None, parts=parts)


def of_records(lines: Sequence[TreeView]) -> dict[str, list[Any]]:
    """Return the table of a study from lines by column; a line may lack some."""
    names = dict.fromkeys(name for line in lines for name in line)
    return {name: [line.get(name, "") for line in lines] for name in names}


def rms(values: Iterable[float]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(list(values)))))


def number(value: float) -> str:
    """Format a number with five significant digits."""
    if not math.isfinite(value) or value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.5g}"
    return f"{value:.3e}"


def words(key: str) -> str:
    """Return the name of a number in words, without its unit."""
    return re.sub("_(N|Nmm|mm|mm2|mJ)$", "", key).replace("_", " ")


def _shown(row: Row) -> list[str]:
    sign = {"at most": "<= ", "at least": ">= "}.get(row.measure, "")
    relative = row.measure == "relative"
    error, tolerance = (f"{100 * v:.2g} %" if relative else number(v) for v in (row.error, row.tolerance))
    return [
        row.what, row.kind, row.reference, sign + number(row.wanted), number(row.got), error,
        f"{tolerance}: {row.reason}", row.verdict if row.passed else "**FAIL**",
    ]  # fmt: skip


def table(found: Mapping[str, Sequence[Row]]) -> list[list[str]]:
    """Return text cells of all rows: study, what, kind, reference, wanted, got, error, tolerance, verdict."""
    return [[name, *_shown(row)] for name, rows in found.items() for row in rows]


def score(rows: Sequence[Row]) -> str:
    """Return how many rows pass, how many of the paper's statements hold, and how many others."""
    judged = [row for row in rows if row.kind != "statement"]
    said = [row for row in rows if row.kind == "statement"]
    by_paper = [row for row in said if row.reference.startswith(PAPER)]
    others = [row for row in said if not row.reference.startswith(PAPER)]
    parts = [f"{sum(row.passed for row in judged)} of {len(judged)} rows pass"] if judged or not said else []
    if by_paper:
        parts.append(f"{sum(row.within for row in by_paper)} of the paper's {len(by_paper)} statements hold")
    if others:
        parts.append(
            f"{sum(row.within for row in others)} of {len(others)} {'other ' if by_paper else ''}statements hold"
        )
    return ", ".join(parts)


def exact_columns(names: str, lines: Sequence[Sequence[Any]]) -> dict[str, list[Any]]:
    """Return the table of a study from the names of its columns and its lines."""
    return dict(zip(names.split(), map(list, zip(*lines, strict=True)), strict=True))


def columns(names: str, lines: Sequence[Sequence[Any]]) -> dict[str, list[Any]]:
    """Return the table of a study with numbers of five digits, which keep the files small."""
    short = [[float(f"{v:.5g}") if isinstance(v, float) else v for v in line] for line in lines]
    return exact_columns(names, short)


def grouped(table: Mapping[str, ArrayLike], *by: str, **where: Any) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield values of one or several columns and, as arrays, the lines that have them, of all that meet `where`."""
    arrays = {name: np.asarray(column) for name, column in table.items()}
    chosen = np.logical_and.reduce([np.full(len(arrays[by[0]]), True), *(arrays[k] == v for k, v in where.items())])
    for values in dict.fromkeys(zip(*(arrays[name][chosen].tolist() for name in by), strict=True)):
        which = np.logical_and.reduce([chosen, *(arrays[k] == v for k, v in zip(by, values, strict=True))])
        yield values if len(by) > 1 else values[0], {name: array[which] for name, array in arrays.items()}


def committed(name: str) -> list[dict[str, Any]]:
    """Return the lines of the committed table of a study, with numbers as such."""
    path = Path(__file__).resolve().parent / "results" / f"{name}_table.csv"
    if not path.is_file():
        raise MissingError(f"there are no results of {name}; run python -m validation {name}")
    with path.open(newline="", encoding="utf-8") as stream:
        return [{key: _value(text) for key, text in line.items()} for line in csv.DictReader(stream)]


def _value(text: str) -> Any:
    """Return the number that is written so, else the text."""
    for kind in (int, float):
        with suppress(ValueError):
            if str(kind(text)) == text:
                return kind(text)
    return text


def committed_instead(name: str, program: str, install: str) -> list[dict[str, Any]]:
    """Return the lines of the committed table of a study whose other `program` is missing, and say so."""
    print(f"{name}: {program} is not installed ({install}); the committed results stay", file=sys.stderr)
    return committed(name)
