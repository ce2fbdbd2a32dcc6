"""Search along derivatives, with the numbers of a design linearised within a box.

Objectives have kinks where the least of several numbers changes, but the numbers themselves have derivatives by the
free keys.  Each step therefore maximises the objective h of the linearised numbers F, ``h(F(x) + J d)`` over d in a box
around the design (composite optimisation: Fletcher 1987, Ch. 14), which costs no press; the box shrinks where h rises
less than was foretold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.analyses.free_keys import FIRST_BOX, LEAST_GAIN, next_box
from finger3d.analyses.optimise.task import Objective, ObjectiveTable
from finger3d.analyses.pressed_body import under
from finger3d.analyses.sensitivity import varied
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.sensitivity import Numbers, derivatives, tangents
from finger3d.mechanics.small_strain.variations import VariedBody
from finger3d.scene import Scene
from finger3d.scene.material import with_moduli_only

_LEAST_BOX = 1e-3
"""Half edge of the last box, over the ranges of the keys."""

_CHANGE = 2e-3
"""Foretold rise of the objective, over it, at which the search ends."""

Slopes = Sequence[Sequence[Numbers]]
"""Derivatives of the numbers at each mu (m) by each key (k)."""


def slopes_of(scene: Scene, problem: Problem, mus: Sequence[float], keys: Sequence[str]) -> Slopes:
    """Return the derivatives of the numbers at the end of a press with each mu.

    Raises
    ------
    Finger3dError
        If the numbers have no derivative by a key.
    """
    given, body = with_moduli_only(scene.as_dict()), VariedBody(problem)
    try:
        variations = [varied(given, scene.path, body, key) for key in keys]
    except Finger3dError as error:
        raise Finger3dError(f"--method gradient: {error}") from None
    found = []
    for mu in mus:
        friction = problem.model.friction.with_mu(mu)
        at_mu = [replace(v, ends=(under(v.ends[0], friction), under(v.ends[1], friction))) for v in variations]
        *_, (step, _, sides) = tangents(under(problem, friction), at_mu)
        found.append(derivatives(step, at_mu, sides))
    return found


@dataclass(frozen=True)
class LinearTable:
    """What an objective reads of a design, linearised by k keys."""

    table: ObjectiveTable
    slopes: Slopes

    def at(self, change: Float) -> ObjectiveTable:
        """Return the table where the keys have changed (k,)."""
        moved = [self._changed(by_key, change) for by_key in self.slopes]
        strain = {
            name: own + np.array([one.get(f"gauge_{name}", math.nan) for one in moved])
            for name, own in self.table.strain.items()
        }
        pairs = zip(self.table.steps, moved, strict=True)
        steps = [{**own, **{n: own[n] + by for n, by in one.items() if n in own}} for own, one in pairs]
        return replace(self.table, strain=strain, steps=steps)

    @staticmethod
    def _changed(by_key: Sequence[Numbers], change: Float) -> Mapping[str, float]:
        common = set.intersection(*(set(row) for row in by_key))
        return {name: sum(row[name] * t for row, t in zip(by_key, change.tolist(), strict=True)) for name in common}


def climb(
    start: Float,
    value: float,
    bounds: tuple[Float, Float],
    value_at: Callable[[Float], float],
    linear_at: Callable[[Float], LinearTable],
    objective: Objective,
    largest: Callable[[Callable[[Float], float], Float, Float], Float],
) -> None:
    """Follow the derivatives from a design (k,) until the objective rises no further.

    Parameters
    ----------
    value : its objective
    bounds : lower and upper ones of the keys (k,)
    value_at : objective of a design, very low where it cannot be built
    linear_at : the linearised numbers of a design that can be
    largest : finds where a function is largest, between lower and upper bounds (k,)
    """
    x, here, box, width = start, value, FIRST_BOX, bounds[1] - bounds[0]
    while box > _LEAST_BOX:
        linear = linear_at(x)
        gain = -1.0
        while gain < LEAST_GAIN and box > _LEAST_BOX:
            low, high = np.maximum(bounds[0], x - box * width), np.minimum(bounds[1], x + box * width)
            after = largest(lambda y, one=linear, at=x: objective(one.at(y - at)), low, high)  # type: ignore[misc]
            foretold = objective(linear.at(after - x)) - here
            if not foretold > _CHANGE * abs(here):
                return
            found = value_at(after)
            gain = (found - here) / foretold
            box = next_box(box, float(np.abs((after - x) / width).max()), gain)
        if gain >= LEAST_GAIN:
            x, here = after, found
