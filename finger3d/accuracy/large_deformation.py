"""Change of the numbers of a press by large deformation, estimated from coarse presses with and without it.

The scene is pressed on a coarser mesh and in few increments, in small strain and at large deformation (neo-Hookean).
The change d of a number of the press is that of the coarse press; its error follows from the change d' on a mesh
coarser still and in fewer increments, and from how far the coarse number n is from the number N of the press, both in
small strain ::

    error of d = max(1.5 |d - d'|, 0.15 |d|, |n - N|)

d and d' may agree by chance while neither mesh resolves the number: a friction sum of opposite slips, or the strain of
a gauge within an edge length of the contact.  Both factors were chosen on the 60 sections of ``validation/_drawn.py``
with the seed 2026.  In 41 other scenes on coarse meshes, 88 changes would be reported without the last term, of whose
intervals 89 % hold and the worst is 4.6 half-widths off; with it 73, 97 % and 1.6.
``validation/advice_against_truth.py`` compares the changes with those of the same press at large deformation, in other
scenes.
"""

from __future__ import annotations

from dataclasses import replace

from finger3d._cost import CHANGES, LARGE_DEFORMATION_S
from finger3d.accuracy.changes import ChangeEstimate, affordable_factor, attempted, changing_numbers, check_kind, judged
from finger3d.accuracy.companions import LEAST_RATIO, built_like, coarser, edge_ratio
from finger3d.effects import fill
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.history import StepResult

_COARSER_STILL = 2.0
"""Edge lengths of the coarser of both meshes over those of the other."""

_STEPS = (5, 3)
"""Increments in each leg, on the coarse mesh and on the one that is coarser still."""

_SAFETY, _LEAST_ERROR = 1.5, 0.15
"""Error of a change over its difference between both meshes, and least error relative to the change."""


@attempted
def large_deformation(problem: Problem, last: StepResult, increments: int) -> ChangeEstimate:
    """Estimate what large deformation would change in the last increment of a press in small strain."""
    check_kind(problem.model)
    budget = min(CHANGES.seconds(problem.size.press_s(increments)), LARGE_DEFORMATION_S)
    factor = affordable_factor(lambda f: _at_large_deformation(_coarse(problem.model, f, _STEPS[0])), budget)
    coarse, change, other = _on_both_meshes(problem, factor)
    numbers = changing_numbers(problem, last)
    errors = {
        name: max(_SAFETY * abs(d - other[name]), _LEAST_ERROR * abs(d), abs(coarse[name] - numbers[name]))
        for name, d in change.items()
    }
    mesh = coarser(problem.model, factor).mesh
    return ChangeEstimate(
        changes=judged(numbers, change, errors),
        method=f"presses with and without it, with {mesh.size_mm:.4g} and {mesh.base_size_mm:.4g} mm in {_STEPS[0]} "
        f"increments a leg; error: with {_COARSER_STILL:g} times these edges in {_STEPS[1]} increments, and from how "
        "far the coarse press in small strain is from the press",
    )


def _on_both_meshes(problem: Problem, factor: float) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Return the numbers in small strain by name on the coarse mesh, their changes there and on the coarser mesh."""
    numbers, found, finer = [], [], problem
    for times, steps in zip((factor, _COARSER_STILL * factor), _STEPS, strict=True):
        model = _coarse(problem.model, times, steps)
        small, large = (built_like(problem, m) for m in (model, _at_large_deformation(model)))
        if edge_ratio(finer, small) < LEAST_RATIO:
            raise Finger3dError("the mesh is too coarse for a coarser one; lower mesh.size_mm")
        before, after = (changing_numbers(p, last_step(p)) for p in (small, large))
        numbers.append(before)
        found.append({name: after[name] - before[name] for name in before})
        finer = small
    return numbers[0], found[0], found[1]


def _coarse(model: Model, factor: float, steps: int) -> Model:
    return replace(coarser(model, factor), legs=tuple(replace(leg, steps=steps) for leg in model.legs))


def _at_large_deformation(model: Model) -> Model:
    # imported here: without this estimate, a press in small strain does not need them
    from finger3d.fem.laws import NeoHooke

    return fill(model, "hyperelastic_law", NeoHooke(1.0), "large_deformation")
