"""Model error of a press: what an effect that is off would change, estimated from coarse presses with and without it.

The scene is pressed on a coarser mesh and in few increments, without the effect and with it.  The change d of a number
of the press is that of the coarse press; its error follows from the change d' on a mesh coarser still and in fewer
increments, and from how far the coarse number n is from the number N of the press, both without the effect ::

    error of d = max(1.5 |d - d'|, 0.15 |d|, |n - N|)

d and d' may agree by chance while neither mesh resolves the number: a friction sum of opposite slips, or the strain of
a gauge within an edge length of the contact.  Both factors were chosen for large deformation, on the 60 sections of
``validation/_drawn.py`` with the seed 2026.  In 41 other scenes on coarse meshes, 88 changes would be reported without
the last term, of whose intervals 89 % hold and the worst is 4.6 half-widths off; with it 73, 97 % and 1.6.
``validation/advice_against_truth.py`` compares the changes with those of the same press at large deformation, in other
scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from finger3d._cost import CHANGES, LARGE_DEFORMATION_S
from finger3d.accuracy.changes import ChangeEstimate, affordable_factor, attempted, changing_numbers, check_kind, judged
from finger3d.accuracy.companions import LEAST_RATIO, coarser, edge_ratio
from finger3d.accuracy.point_resolution import PointResolution
from finger3d.accuracy.richardson import kinds_of
from finger3d.effects import fill
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.history import StepResult

_STEPS = (5, 3)
"""Increments in each leg, on the coarse mesh and on the one that is coarser still."""

_SAFETY, _LEAST_ERROR = 1.5, 0.15
"""Error of a change over its difference between both meshes, and least error relative to the change."""

Enriched = Callable[[Model], Model]
"""Function that returns a model with more effects on."""


@dataclass
class CoarsePresses:
    """Presses of a model on two coarse meshes, with any effects on; each is solved once.

    Attributes
    ----------
    model : without them
    factor : edge lengths of the finer of both meshes over those of the model
    still : edge lengths of the coarser of both over those of the other; 1: the same mesh, in fewer increments
    """

    model: Model
    factor: float
    still: float = 2.0
    _known: dict[tuple[str, ...], tuple[dict[str, float], dict[str, float]]] = field(default_factory=dict)
    _zones: dict[tuple[str, ...], Mapping[str, float]] = field(default_factory=dict)

    def numbers(self, effects: Mapping[str, Enriched]) -> tuple[dict[str, float], dict[str, float]]:
        """Return the numbers by name with some effects on, on the coarse mesh and on the one that is coarser still.

        Raises
        ------
        Finger3dError
            If a mesh is too coarse, or a press does not converge.
        """
        key = tuple(sorted(effects))
        if key not in self._known:
            fine, finer, zones = self._pressed(self.factor, _STEPS[0], effects)
            coarse, coarser_still, _ = self._pressed(self.still * self.factor, _STEPS[1], effects)
            if self.still > 1.0 and edge_ratio(finer, coarser_still) < LEAST_RATIO:
                raise Finger3dError("the mesh is too coarse for a coarser one; lower mesh.size_mm")
            self._known[key], self._zones[key] = (fine, coarse), zones
        return self._known[key]

    def _pressed(
        self, factor: float, steps: int, effects: Mapping[str, Enriched]
    ) -> tuple[dict[str, float], Problem, Mapping[str, float]]:
        model = coarse_model(self.model, factor, steps)
        for name in sorted(effects):
            model = effects[name](model)
        # the strain without foils is that of a press of its own, and no other press has it
        problem = replace(build(model), without_inclusions=None)
        last = last_step(problem)
        return changing_numbers(problem, last), problem, PointResolution.of(problem, last).zone_bars

    def changes(
        self,
        effects: Mapping[str, Enriched],
        added: str,
        press: Mapping[str, float] | None = None,
        neutral: Mapping[str, Enriched] | None = None,
    ) -> ChangeEstimate:
        """Return what one of several effects changes beside the others.

        Parameters
        ----------
        effects : all that are on, the one in question among them
        added : name of the one in question
        press : numbers of the press itself without it, if they are known
        neutral : what stands in its place in the presses without it, by another name
        """
        others = {name: effects[name] for name in effects if name != added} | dict(neutral or {})
        before, before_still = self.numbers(others)
        after, after_still = self.numbers(effects)
        values = press or before
        names = [name for name in values if name in after and name in before]
        change = {name: after[name] - before[name] for name in names}
        errors = {
            name: max(
                _SAFETY * abs(change[name] - after_still[name] + before_still[name]),
                _LEAST_ERROR * abs(change[name]),
                abs(before[name] - values[name]),
            )
            for name in names
        }
        mesh = coarser(self.model, self.factor).mesh
        zones = [self._zones[tuple(sorted(chosen))] for chosen in (others, effects)]
        return ChangeEstimate(
            changes=judged({name: values[name] for name in names}, change, errors, kinds_of(self.model.columns)),
            method=f"presses with and without it, with {mesh.size_mm:.4g} and {mesh.base_size_mm:.4g} mm in "
            f"{_STEPS[0]} increments a leg; error: with {self.still:g} times these edges in {_STEPS[1]} increments,"
            " and from how far the coarse press without it is from the press",
            resolution={name: sum(bars.get(name, 0.0) for bars in zones) for name in zones[0]},
        )


@attempted
def large_deformation(problem: Problem, last: StepResult, increments: int) -> ChangeEstimate:
    """Estimate what large deformation would change in the last increment of a press in small strain."""
    check_kind(problem.model)
    factor = cheap_factor(problem.model, problem.size.press_s(increments))
    presses = CoarsePresses(problem.model, factor)
    presses.numbers({})
    on = {"large_deformation": at_large_deformation}
    return presses.changes(on, "large_deformation", changing_numbers(problem, last))


def cheap_factor(model: Model, press_s: float) -> float:
    """Return the edge lengths of the coarse mesh over those of a press that takes some seconds.

    The modelled cost is that of the press at large deformation on this mesh, at least half of the estimate.
    """
    budget = min(CHANGES.seconds(press_s), LARGE_DEFORMATION_S)
    return affordable_factor(lambda factor: at_large_deformation(coarse_model(model, factor, _STEPS[0])), budget)


def coarse_model(model: Model, factor: float, steps: int) -> Model:
    """Return a model with longer edges, none shorter at the border of stick, and few increments a leg."""
    found = coarser(model, factor)
    mesh = replace(found.mesh, borders=None)
    return replace(found, mesh=mesh, legs=tuple(replace(leg, steps=steps) for leg in model.legs))


def at_large_deformation(model: Model) -> Model:
    """Return a model at large deformation, with the neo-Hookean law of its moduli."""
    # imported here: without this estimate, a press in small strain does not need them
    from finger3d.fem.laws import NeoHooke

    return fill(model, "hyperelastic_law", NeoHooke(1.0), "large_deformation")
