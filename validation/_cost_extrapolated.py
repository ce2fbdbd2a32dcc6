"""What an error costs where no run shows it: mesh, increments, time and memory from the rates that were measured.

The error that a mesh causes falls as a power of its edge length.  The power of a number is the median of those of all
series of meshes with at least three errors that are known, which means larger than twice the uncertainty of the truth;
an error counts as that of a finer mesh if that is larger.  No error of a series above the uncertainty of the truth is
larger than its law.  Errors of the increments fall with their number beyond the last one but one that was tried, to
first order.  Beyond the finest mesh the unknowns grow with its inverse edge length to the power of the dimension, and
time and memory as a power of the unknowns, which the last three meshes show; between meshes both are interpolated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ._cost import LARGE, SOLID, Case
from ._cost_truth import Advice, Known, Truth, pace_of, seconds, step_errors

Errors = Mapping[Case, Mapping[str, float]]

SOLIDS = (SOLID, LARGE[SOLID])
_FEWEST = 3
"""Known errors that a rate is taken from."""

EMPTY = 0.95
"""Share of the least peak memory of all runs that the program itself and its libraries take."""

_DOUBLINGS = 16
"""Of the largest number of increments that was tried."""


def rate(quantity: str, series: Sequence[tuple[Sequence[Case], Truth]], errors: Errors) -> float:
    """Return the power of the edge length with which errors of a number fall, the median over series; NaN for none."""
    found = []
    for cases, truth in series:
        sizes, bound = np.array([c.size for c in cases]), no_finer_is_larger([errors[c][quantity] for c in cases])
        known = bound > 2.0 * truth.uncertainty
        if known.sum() >= _FEWEST:
            found.append(float(np.polyfit(np.log(sizes[known]), np.log(bound[known]), 1)[0]))
    return float(np.median(found)) if found else math.nan


def no_finer_is_larger(errors: Sequence[float]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return errors of a series of meshes, coarse to fine, each at least as large as those of finer meshes."""
    return np.maximum.accumulate(np.array(errors)[::-1])[::-1]


def constant(quantity: str, cases: Sequence[Case], errors: Errors, truth: Truth, power: float) -> float:
    """Return the error of a series over the edge length to a power: the largest; or what the uncertainty allows."""
    found = [e / c.size**power for c in cases if (e := errors[c][quantity]) > truth.uncertainty]
    return max(found, default=truth.uncertainty / cases[-1].size ** power)


def at(place: float, places: Sequence[float], values: Sequence[float]) -> float:
    """Return a value at a place from those at ascending places, in logarithms; beyond by the power of the last three.

    Examples
    --------
    >>> round(at(8.0, (1.0, 2.0, 4.0), (1.0, 2.0, 4.0)), 9)
    8.0
    """
    x, y = np.log(places), np.log(values)
    if place <= places[-1]:
        return float(np.exp(np.interp(math.log(place), x, y)))
    power = np.polyfit(x[-3:], y[-3:], 1)[0]
    return float(values[-1] * (place / places[-1]) ** power)


def unknowns(size: float, cases: Sequence[Case], dofs: Sequence[float]) -> float:
    """Return the unknowns of a mesh of an edge length, from those of a series of meshes, coarse to fine."""
    if size >= cases[-1].size:
        return at(1.0 / size, [1.0 / c.size for c in cases], dofs)
    return float(dofs[-1] * (cases[-1].size / size) ** (3 if cases[-1].body in SOLIDS else 2))


def memory_mb(dofs: float, all_dofs: Sequence[float], peaks: Sequence[float], empty: float) -> float:
    """Return the peak memory with so many unknowns, of which `empty` is that of the program and its libraries."""
    return empty + at(dofs, all_dofs, [peak - empty for peak in peaks])


def _increments(quantity: str, ladder: Mapping[str, Any], counts: Sequence[int]) -> Iterator[tuple[int, float, float]]:
    """Yield numbers of increments, the error due to them, and the time over that of ten."""
    errors = step_errors(ladder, quantity, counts)
    for k, count in enumerate(counts[:-1]):
        yield count, max(errors[n] for n in counts[k:]), pace_of(ladder, count)
    known, last = counts[-2:]
    for double in range(_DOUBLINGS):
        count = last * 2**double
        yield count, errors[known] * known / count, pace_of(ladder, last) * count / last


def extrapolate(unknown: Advice, groups: Sequence[Sequence[Case]], known: Known, power: float) -> Advice:
    """Return the cheapest mesh and increments that are expected to meet a target that no run is known to meet.

    Parameters
    ----------
    unknown : the number and the target
    groups : series of meshes, coarse to fine
    power : of the edge length; see `rate`
    """
    best, empty = unknown, EMPTY * min(run["peak_MB"] for run in known.runs.values())
    for cases in groups:
        here = [known.runs[c] for c in cases]
        dofs = [run["dofs"] for run in here]
        error = constant(unknown.quantity, cases, known.errors, known.truth, power)
        before = [seconds(run, pace=0.0) for run in here]
        contact = [seconds(run) - seconds(run, pace=0.0) for run in here]
        for count, by_steps, longer in _increments(unknown.quantity, known.ladder, known.counts):
            if by_steps >= unknown.target or math.isnan(power):
                continue
            size = min(((unknown.target - by_steps) / error) ** (1.0 / power), cases[0].size)
            size = float(f"{size:.2g}")
            many = unknowns(size, cases, dofs)
            took = at(many, dofs, before) + longer * at(many, dofs, contact)
            if best.case is None or took < best.seconds:
                case = replace(cases[-1], size=size, base=4.0 * size)
                meshing = at(many, dofs, [run["processor_seconds"]["mesh"] for run in here])
                peak = memory_mb(many, dofs, [run["peak_MB"] for run in here], empty)
                best = replace(unknown, case=case, steps=count, seconds=took, mesh_seconds=meshing, peak_mb=peak,
                               dofs=round(many), extrapolated=True)  # fmt: skip
    return best
