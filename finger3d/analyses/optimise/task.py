"""Problem of a design search: free keys, bounds and evaluations; checked before anything is solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.free_keys import FreeKey, check_distinct, scene_with
from finger3d.errors import Finger3dError
from finger3d.results.journal import Row, number_in
from finger3d.scene import Scene, files, parse, tree
from finger3d.sensor.curve import LARGEST_STRAIN

MUS = tuple(float(v) for v in np.round(np.linspace(0.05, 1.0, 9), 5))


def sensitivity(mu: Float, strain: Float, noise: float) -> float:
    """Return the criterion of Maeno 2004, Sec. III-B: sensitive to mu throughout a large range.

    It is the smallest change of strain per mu between neighbouring values of mu, in units of the noise, which is the
    inverse of the worst resolution of mu.  It is negative where the strain is not monotone.

    Parameters
    ----------
    mu, strain : (n,)
    noise : standard deviation of a strain reading
    """
    slope = np.diff(strain) / np.diff(mu)
    return float((slope * np.sign(strain[-1] - strain[0])).min() / noise)


@dataclass(frozen=True)
class OptimisationProblem:
    """Problem of a design search.

    Attributes
    ----------
    given : the scene as written, overrides included
    gauge : name of the gauge that is designed; None: the first
    budget : designs, or bodies where keys of both body and gauges are free
    """

    given: TreeView
    free: tuple[FreeKey, ...]
    path: Path | None = None
    gauge: str | None = None
    mus: tuple[float, ...] = MUS
    noise: float = 1.5e-4
    budget: int = 60
    seed: int = 0

    def keys(self) -> tuple[str, ...]:
        """Return the keys as they are set, with the numbers of gauges."""
        return tuple(f.numbered(self.given) for f in self.free)

    def scene(self, values: Sequence[float]) -> Scene:
        """Return the scene with these values of the free keys."""
        return scene_with(self.given, self.keys(), values, self.path)

    def identity(self) -> Tree:
        """Return what two runs must have in common to continue each other's evaluations; the budget may differ."""
        return {
            "scene": tree.plain(self.given),
            "files": files.contents(self.given, self.path),
            "free": [[f.key, f.low, f.high] for f in self.free],
            "gauge": self.gauge,
            "mu": list(self.mus),
            "noise": self.noise,
            "seed": self.seed,
        }


def check_readings(mus: Sequence[float], fewest: int, noise: float) -> None:
    """Raise an error for values of mu that are too few or do not ascend, or for a noise out of range."""
    if len(mus) < fewest or any(b <= a for a, b in pairwise(mus)):
        raise Finger3dError(f"--mu: must be at least {('two', 'three')[fewest - 2]} numbers, ascending")
    if not 1e-12 <= noise <= LARGEST_STRAIN:
        raise Finger3dError(f"--noise {noise:g}: must be a finite number from 1e-12 to {LARGEST_STRAIN:g}")


def checked_start(problem: OptimisationProblem) -> tuple[float, ...]:
    """Return the values of the scene, or the middle of the bounds where they lie outside."""
    if problem.budget < 1:
        raise Finger3dError(f"--budget {problem.budget}: must be at least 1")
    keys = problem.keys()
    if not keys:
        raise Finger3dError("optimise: nothing is free; give at least one --free, such as finger.radius_mm=60:200")
    check_distinct(keys)
    check_readings(problem.mus, 2, problem.noise)
    if problem.seed < 0:
        raise Finger3dError(f"--seed {problem.seed}: must be a whole number from 0 up")
    names = [g.name for g in parse(problem.given, problem.path).tables.gauge]
    if not names:
        raise Finger3dError("optimise: the objective reads a gauge, and the scene has no [[gauge]]; add one")
    if problem.gauge is not None and problem.gauge not in names:
        raise Finger3dError(f"--gauge {problem.gauge}: no such gauge; the scene has {', '.join(names)}")
    values = [free.start(problem.given) for free in problem.free]
    # a key that no scene has is refused now, a design that cannot be built is a line of the table
    try:
        problem.scene(values)
    except Finger3dError as error:
        if "no such key" in str(error) or "must be a " in str(error):
            raise
    return tuple(values)


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of one design.

    Attributes
    ----------
    values : values of the free keys
    value : objective, NaN where it is undefined
    outcome : "converged", or the reason why there is no objective
    """

    values: tuple[float, ...]
    value: float
    outcome: str


def evaluation_of(row: Row) -> Evaluation:
    """Return the evaluation of a line of evaluations.jsonl."""
    values = row["values"]
    assert isinstance(values, list)
    return Evaluation(tuple(values), number_in(row, "objective"), str(row["outcome"]))
