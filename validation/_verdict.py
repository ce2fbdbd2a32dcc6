"""Verdict on the paper's claims: one table that is made from the rows of the studies."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ._rows import Row

STRESS, STRAIN, WIDE, LARGE = "plane stress", "plane strain", "20 mm wide", "20 mm wide, large deformation"
COLUMNS = (STRESS, STRAIN, WIDE, LARGE)
HOLDS, PARTLY, FAILS = "holds", "holds partly", "fails"


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and the rows that judge it.

    Attributes
    ----------
    text, where : what the paper says, and its figure or section
    measure : the number of the cells, and its bound
    rows : for every column that is judged, a study, a pattern that finds its rows by what they measure, and the figure,
        if it is not named as the study
    """

    text: str
    where: str
    measure: str
    rows: Mapping[str, tuple[str, ...]]

    def found(self, column: str, kept: Mapping[str, Sequence[Row]]) -> list[Row]:
        """Return the rows that judge the claim in a column; none where it is not judged."""
        study, pattern, *_ = self.rows.get(column, ("", ""))
        return [row for row in kept.get(study, ()) if re.search(pattern, row.what)]

    def figure(self, column: str) -> str:
        """Return the name of the figure of a column that is judged."""
        study, _, *own = self.rows[column]
        return own[0] if own else study


def verdict(rows: Sequence[Row]) -> str:
    """Return whether all, some or none of the rows hold."""
    held = sum(row.within for row in rows)
    return HOLDS if held == len(rows) else PARTLY if held else FAILS


CLAIMS = tuple(
    Claim(**claim) for claim in tomllib.loads(Path(__file__).with_name("claims.toml").read_text("utf-8"))["claim"]
)


def lines(kept: Mapping[str, Sequence[Row]], figures: str) -> list[str]:
    """Return the table in Markdown, with a link to the figure of its study in each cell; `figures` is their folder."""
    out = [
        "| the paper's claim | measured by | " + " | ".join(COLUMNS) + " |",
        "|---|---" + "|---" * len(COLUMNS) + "|",
    ]
    for claim in CLAIMS:
        cells = [_cell(claim, column, kept, figures) for column in COLUMNS]
        out.append("| " + " | ".join((f"{claim.text} ({claim.where})", claim.measure, *cells)) + " |")
    return out


def _cell(claim: Claim, column: str, kept: Mapping[str, Sequence[Row]], figures: str) -> str:
    rows = claim.found(column, kept)
    if not rows:
        return "–"
    return f"**{verdict(rows)}**: [{_numbers(rows)}]({figures}/{claim.figure(column)}.png)"


def _numbers(rows: Sequence[Row]) -> str:
    """Return the number of a cell, or the range of several; that of a ratio is relative to what is wanted."""
    values = sorted(row.got / row.wanted if row.measure == "relative" else row.got for row in rows)
    low, high = (f"{value:.2g}" if abs(value) < 1.0 else f"{value:.3g}" for value in (values[0], values[-1]))
    return low if low == high else f"{low} to {high}"


def summary(kept: Mapping[str, Sequence[Row]]) -> str:
    """Return a sentence with the numbers of claims that hold, hold partly and fail in every column."""
    parts = []
    for column in COLUMNS:
        told = [verdict(rows) for claim in CLAIMS if (rows := claim.found(column, kept))]
        numbers = ", ".join(str(told.count(state)) for state in (HOLDS, PARTLY, FAILS))
        parts.append(f"{column} {numbers}")
    return f"Claims that hold, hold partly and fail: {'; '.join(parts)}."
