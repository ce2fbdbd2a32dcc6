"""Points of a sweep that are no grid: the rows of a table, or random samples within ranges."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from finger3d.analyses.sweep.points import MOST, Vary
from finger3d.errors import Finger3dError
from finger3d.scene.messages import shown

SAMPLERS = ("lhs", "random")
"""Latin hypercube samples, of which each of n equal parts of every range holds one; and independent ones."""

_EXAMPLE = "--sample lhs:200 --range friction.mu=0.05:1"


def rows_of(path: Path) -> tuple[Vary, ...]:
    """Read points from a CSV file: a column for each key, which the first line names, and a row for each point.

    Raises
    ------
    Finger3dError
        If it cannot be read, or a cell is missing.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise Finger3dError(f"--points {path}: cannot be read: {reason}") from None
    (_, head), *rows = [line for line in lines if any(line[1])] or [(0, [])]
    if not head or not all(head):
        raise Finger3dError(f"--points {path}: its first line must name a key in every column, such as friction.mu")
    if twice := next((key for i, key in enumerate(head) if key in head[:i]), ""):
        raise Finger3dError(f"--points {path}: the column {shown(twice)} occurs twice")
    if not rows:
        raise Finger3dError(f"--points {path}: has no row below its first line")
    for number, row in rows:
        if len(row) != len(head) or not all(row):
            raise Finger3dError(f"--points {path}, line {number}: must have a value in each of {len(head)} columns")
    return tuple(Vary(key, texts) for key, texts in zip(head, zip(*(row for _, row in rows), strict=True), strict=True))


def columns_of(columns: Mapping[str, Sequence[str]]) -> tuple[Vary, ...]:
    """Return points from a column of values for each key.

    Raises
    ------
    Finger3dError
        If there is none, or if their lengths differ.
    """
    lengths = {key: len(texts) for key, texts in columns.items()}
    if not lengths or min(lengths.values()) < 1 or len(set(lengths.values())) > 1:
        raise Finger3dError(f"sweep: a list of points needs as many values of every key; it has {lengths}")
    return tuple(Vary(key, tuple(texts)) for key, texts in columns.items())


def drawn(sample: str, ranges: Sequence[str], seed: int) -> tuple[Vary, ...]:
    """Return samples within ranges; the same ones for the same arguments.

    Parameters
    ----------
    sample : ``lhs:NUMBER``, a Latin hypercube, or ``random:NUMBER``
    ranges : ``KEY=LOW:HIGH`` each
    seed : of the random numbers

    Raises
    ------
    Finger3dError
        If an argument is not as described.
    """
    kind, _, text = sample.partition(":")
    count = int(text) if text.isdecimal() else 0
    if kind not in SAMPLERS or not 1 <= count <= MOST:
        raise Finger3dError(f"--sample {shown(sample)}: must be lhs:NUMBER or random:NUMBER, for instance {_EXAMPLE}")
    if not ranges:
        raise Finger3dError(f"--sample {sample}: nothing varies; give at least one range, for instance {_EXAMPLE}")
    if seed < 0:
        raise Finger3dError(f"--seed {seed}: must be 0 or more")
    bounds = [_range(text) for text in ranges]
    keys = [key for key, *_ in bounds]
    if twice := next((key for i, key in enumerate(keys) if key in keys[:i]), ""):
        raise Finger3dError(f"--range {twice}: given twice")
    random = np.random.default_rng(seed)
    columns = []
    for key, low, high in bounds:
        share = random.random(count)
        if kind == "lhs":
            share = (random.permutation(count) + share) / count
        columns.append(Vary(key, tuple(map(repr, (low + (high - low) * share).tolist()))))
    return tuple(columns)


def _range(text: str) -> tuple[str, float, float]:
    key, _, bounds = text.partition("=")
    try:
        low, high = (float(part) for part in bounds.split(":"))
    except ValueError:
        low = high = math.nan
    if not key.strip() or not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise Finger3dError(f"--range {shown(text)}: must be KEY=LOW:HIGH with LOW below HIGH, as in {_EXAMPLE}")
    return key.strip(), low, high
