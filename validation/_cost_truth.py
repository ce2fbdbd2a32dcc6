"""Errors of the runs of cost_of_accuracy: reference values by extrapolation, and the cheapest run within a tolerance.

The reference is extrapolated in the mesh and in the increments.  The error of a run is taken as that of its mesh, at
ten increments, plus that of its increments, on one mesh.  A mesh meets a tolerance only if all finer meshes of its
series meet it too, so that an error that passes through zero by chance does not count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._corner import extrapolated, observed
from ._cost import QUANTITIES, Case

LENGTHS = {"contact_length": 0.04, "stick_length": 0.2}
"""Error of the place of an end over the distance of the points."""

Runs = Mapping[Case, dict[str, Any]]


@dataclass(frozen=True)
class Truth:
    """Value at zero size under ten increments, and how far it may be off, relative.

    `check` is how far the finest run is from what was extrapolated without it, relative.
    """

    value: float
    uncertainty: float
    check: float


def value(run: Mapping[str, Any], quantity: str, count: int = 10) -> float:
    """A number of a run."""
    return float(run["numbers"][str(count)][quantity])


def truth(cases: Sequence[Case], runs: Runs, quantity: str) -> Truth:
    """From a series of meshes, coarse to fine.

    Extrapolated at the rate that the last three show, if that is one (between .6 and 4); else the finest stands.
    """
    sizes, found = [c.size for c in cases], [value(runs[c], quantity) for c in cases]
    with_finest, without = _limit(sizes, found), _limit(sizes[:-1], found[:-1])
    off = max(abs(with_finest - without), 0.25 * abs(found[-1] - with_finest), LENGTHS.get(quantity, 0.0) * sizes[-1])
    return Truth(with_finest, off / abs(with_finest), abs(found[-1] / without - 1.0))


def _limit(sizes: Sequence[float], found: Sequence[float]) -> float:
    """Return the limit of a series at the rate that its last three show, or the last of them."""
    steps = np.diff(found[-3:])
    if len(steps) < 2 or steps[0] * steps[1] <= 0.0 or abs(steps[1]) >= abs(steps[0]):
        return found[-1]
    try:
        rate = observed(sizes, found)
    except ValueError:  # no rate between .05 and 12
        return found[-1]
    return extrapolated(found[-2], found[-1], rate, sizes[-2] / sizes[-1]) if 0.6 <= rate <= 4.0 else found[-1]


def step_errors(run: Mapping[str, Any], quantity: str, counts: Sequence[int]) -> dict[int, float]:
    """Relative error by increments on one mesh; the limit is in 1/N^2 from the two finest, lengths apart."""
    fine, finest = counts[-2], counts[-1]
    last = value(run, quantity, finest)
    if quantity not in LENGTHS:
        last += (last - value(run, quantity, fine)) * fine**2 / (finest**2 - fine**2)
    return {n: abs(value(run, quantity, n) / last - 1.0) for n in counts}


def mesh_errors(cases: Sequence[Case], runs: Runs, truths: Mapping[str, Truth]) -> dict[Case, dict[str, float]]:
    """Relative error of every quantity of every case, under ten increments."""
    return {
        c: {q: abs(v / truths[q].value - 1.0) for q in QUANTITIES if (v := runs[c]["numbers"]["10"].get(q)) is not None}
        for c in cases
    }


def seconds(run: Mapping[str, Any], count: int = 10, pace: float = 1.0) -> float:
    """Processor time to the last increment; `pace` times the ten increments, where `count` was not run."""
    parts = run["processor_seconds"]
    before = sum(v for k, v in parts.items() if not k.startswith("contact"))
    return float(before + (parts[f"contact {count}"] if pace == 1.0 else pace * parts["contact 10"]))


def pace_of(ladder: Mapping[str, Any], count: int) -> float:
    """Time of so many increments over that of ten, on one mesh."""
    parts = ladder["processor_seconds"]
    return float(parts[f"contact {count}"] / parts["contact 10"])


@dataclass(frozen=True)
class Known:
    """Runs of one body, their errors, the truth of one number, and a mesh that was pressed in several counts."""

    runs: Runs
    errors: Mapping[Case, Mapping[str, float]]
    truth: Truth
    ladder: Mapping[str, Any]
    counts: Sequence[int]


@dataclass(frozen=True)
class Advice:
    """The cheapest of the runs, and increments, that meets a target for a quantity; no case if none does.

    If it is extrapolated, the case was not run, or its error is not known that well.
    """

    quantity: str
    target: float
    case: Case | None
    steps: int
    seconds: float
    mesh_seconds: float
    peak_mb: float
    dofs: int
    uncertainty: float
    extrapolated: bool = False


def advise(quantity: str, target: float, groups: Sequence[Sequence[Case]], known: Known) -> Advice:
    """Search series of meshes (coarse to fine) and increments for the cheapest way below a target."""
    by_steps, uncertainty = step_errors(known.ladder, quantity, known.counts), known.truth.uncertainty
    best = Advice(quantity, target, None, 0, float("nan"), float("nan"), float("nan"), 0, uncertainty)
    if uncertainty > target:
        return best
    for cases in groups:
        bound = np.maximum.accumulate([known.errors[c][quantity] for c in reversed(cases)])[::-1]
        for case, mesh_error in zip(cases, bound, strict=True):
            for k, count in enumerate(known.counts):
                if mesh_error + max(by_steps[n] for n in known.counts[k:]) > target:
                    continue
                run = known.runs[case]
                cost, meshing = seconds(run, pace=pace_of(known.ladder, count)), run["processor_seconds"]["mesh"]
                if best.case is None or cost < best.seconds:
                    size = run["peak_MB"], run["dofs"]
                    best = Advice(quantity, target, case, count, cost, meshing, *size, uncertainty)
                break
    return best
