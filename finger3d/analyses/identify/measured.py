"""Measured presses: CSV files whose columns are named as those of history.csv, checked line by line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.csv_table import read_table
from finger3d.errors import Finger3dError
from finger3d.scene.messages import listed, nearest

SLIDES = ("slide_x_mm", "slide_z_mm")

INDEX = ("step", "time_s", "depth_mm", *SLIDES)
"""Columns that say when a row was measured; the first of them that changes in one direction counts."""

CLOCKS = ("step", "time_s")
"""Columns that are never fitted, unlike the depth, which is fitted if it does not locate the rows."""

_NO_MEASUREMENTS = ("iterations", "residual", "method", "outcome")
"""Columns of history.csv that tell of the solver, and are passed over."""

STD = "_std"

_FEWEST = 2
"""Least number of rows of a measured press."""

_OPPOSITE = -0.5
"""Cosine between a measured and a simulated column below which they have opposite signs."""

_LEAST_STD, _LARGEST_STD = 1e-12, 1e12
"""Standard deviations, in the unit of their column: squares of the residuals over them neither overflow nor vanish."""

SHARPEST = 1e-9
"""Least standard deviation that a column without one is given, in its unit; numbers below it are round-off of zero."""

_UNIT_RATIO = 30.0
"""Ratio of a measured column to the simulated one beyond which its unit is in doubt; 100 is a percentage."""


@dataclass(frozen=True)
class MeasuredPress:
    """Measured press of n rows.

    Attributes
    ----------
    path : of the file
    index : name of the column that says when a row was measured, one of `INDEX`
    at : (n,) its values, ascending; a slide may also descend
    columns : (n,) values by name
    stds : (n,) standard deviations by name, of the columns that have them
    lines : (n,) numbers of the lines of the file
    """

    path: Path
    index: str
    at: Float
    columns: Mapping[str, Float]
    stds: Mapping[str, Float]
    lines: tuple[int, ...]

    @property
    def direction(self) -> float:
        """1 if the index ascends, -1 if it descends."""
        return _direction(self.index, self.at)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return len(self.at) * len(self.columns)

    def check_against(self, simulated: Sequence[Mapping[str, Float]]) -> None:
        """Raise an error for a column whose sign or magnitude is far from those of all simulated ones (n,), by name."""
        for name, values in self.columns.items():
            row = int(np.argmax(np.abs(values)))
            found, extents = abs(float(values[row])), [float(np.abs(one[name]).max()) for one in simulated]
            least, most = min(extents), max(extents)
            opposed = found > SHARPEST and all(
                values @ one[name] < _OPPOSITE * np.linalg.norm(values) * np.linalg.norm(one[name]) for one in simulated
            )
            if opposed or not least / _UNIT_RATIO - SHARPEST <= found <= most * _UNIT_RATIO + SHARPEST:
                raise Finger3dError(
                    f"{self.path}: line {self.lines[row]}: {name} = {values[row]:g}: the scene gives up to "
                    f"{least:.2g} to {most:.2g}{', of the opposite sign' * opposed}; are unit and sign those of the "
                    "name (strain is a plain number, not percent; forces that press are positive), and is it this "
                    "sensor?"
                )


def read_measured(path: Path, known: Sequence[str]) -> MeasuredPress:
    """Read a measured press.

    Parameters
    ----------
    path : CSV file with a line of names, then a line for each row
    known : names that columns may have, besides those of `INDEX`

    Raises
    ------
    Finger3dError
        In one line: for a file that cannot be read, an unknown column, a gap, a value that is no number, rows out of
        order.
    """
    every = {*known, *INDEX}
    table = read_table(path, lambda cell: cell.removesuffix(STD) in every)
    names = [name for name in table.names if name not in _NO_MEASUREMENTS]
    indices = [name for name in INDEX if name in names]
    if not indices:
        has = ", ".join(repr(name)[:40] for name in table.names) or "no line of names"
        raise Finger3dError(
            f"{path}: must have a column {listed(INDEX)}, which says when a row was measured; it has {has}"
        )
    for base in (name.removesuffix(STD) for name in names):
        if base not in every:
            near = next((n for n in known if n.endswith(f"_{base}")), None) or nearest(base, list(known))
            hint = f'did you mean "{near}"? ' if near else ""
            raise Finger3dError(
                f'{path}: column "{base}": {hint}it is none of the forces, lengths, areas, energies and readings of '
                "history.csv, which are fitted; leave out other columns"
            )
    values = table.numbers(names)
    index = next((name for name in indices if not len(_turns(name, values[name]))), indices[0])
    at, columns = values[index], [n for n in names if n not in (index, *CLOCKS) and not n.endswith(STD)]
    if not columns:
        raise Finger3dError(f"{path}: has no measured column beside {index}; for instance normal_force_N")
    for name in names:
        if name.endswith(STD) and name.removesuffix(STD) not in columns:
            raise Finger3dError(f'{path}: column "{name}" has no column "{name.removesuffix(STD)}"')
    if len(turns := _turns(index, at)):
        line = table.lines[turns[0] + 1]
        more = "; of a press that goes back, give time_s or step" if index not in CLOCKS else ""
        raise Finger3dError(f"{path}: line {line}: {index} = {at[turns[0] + 1]:g}: must be larger than before{more}")
    if len(at) < _FEWEST:
        raise Finger3dError(f"{path}: has {len(at)} rows; at least {_FEWEST} are needed")
    stds = {n: values[n + STD] for n in columns if n + STD in values}
    for name, own in stds.items():
        check_stds(path, table.lines, name, own)
    return MeasuredPress(path, index, at, {n: values[n] for n in columns}, stds, table.lines)


NO_PRESS = MeasuredPress(Path(), "", np.empty(0), {}, {}, ())
"""Where material tests alone are given."""


def check_stds(path: Path, lines: Sequence[int], name: str, stds: Float) -> None:
    """Raise an error for the first standard deviation (n,) of a column that is out of range."""
    bad = np.flatnonzero((stds < _LEAST_STD) | (stds > _LARGEST_STD))
    if len(bad):
        raise Finger3dError(
            f"{path}: line {lines[int(bad[0])]}: {name}{STD} = {stds[bad[0]]:g}: must be from {_LEAST_STD:g} to "
            f"{_LARGEST_STD:g}"
        )


def _direction(index: str, at: Float) -> float:
    return -1.0 if index in SLIDES and at[-1:] < at[:1] else 1.0


def _turns(index: str, at: Float) -> NDArray[np.int64]:
    """Return the rows after which an index does not go on in its direction."""
    return np.flatnonzero(_direction(index, at) * np.diff(at) <= 0.0)
