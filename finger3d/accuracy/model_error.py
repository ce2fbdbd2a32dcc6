"""Model error of a press: what an effect that is off would change, estimated from coarse presses with and without it.

The scene is pressed on a coarser mesh and in few increments, without the effect and with it.  The change d of a number
of the press is that of the coarse press; its error follows from the change d' on a mesh coarser still and in fewer
increments, and from how far the coarse number n is from the number N of the press, both without the effect ::

    error of d = max(1.5 |d - d'|, 0.15 |d|, |n - N|)

Of what an effect changes beside large deformation, d - d' is that in small strain.  d and d' may agree by chance while
neither mesh resolves the number: a friction sum of opposite slips, or the strain of a gauge within an edge length of
the contact.  Both factors were chosen for large deformation, on the 60 sections of ``validation/_drawn.py`` with the
seed 2026.  In 41 other scenes on coarse meshes, 88 changes would be reported without the last term, of whose intervals
89 % hold and the worst is 4.6 half-widths off; with it 73, 97 % and 1.6.  ``validation/advice_against_truth.py``
compares the changes with those of the same press at large deformation, in other scenes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from finger3d._cost import CHANGES, LARGE_DEFORMATION_S
from finger3d._types import Float
from finger3d.accuracy.changes import FAILURES, ChangeEstimate, affordable_factor, changing_numbers, check_kind, judged
from finger3d.accuracy.point_resolution import PointResolution
from finger3d.accuracy.richardson import kinds_of
from finger3d.effects import fill
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import (
    MARGIN,
    build,
    candidate_points,
    with_elastic_object,
    with_object_compliance,
)
from finger3d.mechanics.discretise.companions import LEAST_RATIO, coarser, edge_ratio
from finger3d.mechanics.discretise.problem import Problem, free_surface
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import ElasticObject, Model
from finger3d.mechanics.results.history import StepResult
from finger3d.objects import Move

_STEPS = (5, 3)
"""Most increments in each leg, on the coarse mesh and on the one that is coarser still."""

_STILL = 2.0
"""Edge lengths of the mesh that is coarser still over those of the coarse one."""

_SAFETY, LEAST_ERROR = 1.5, 0.15
"""Error of a change over its difference between both meshes, and least error relative to the change."""

LARGE_DEFORMATION = "large_deformation"
"""The effect that every scene has the data for."""

Enriched = Callable[[Model], Model]
"""Function that returns a model with more effects on."""

Numbers = tuple[dict[str, float], Mapping[str, float]]
"""Numbers at the end of a press, and the resolution of its lengths and areas by the contact points, by name."""


def enriched(model: Model, effects: Mapping[str, Enriched]) -> Model:
    """Return a model with some effects on."""
    for name in sorted(effects):
        model = effects[name](model)
    return model


@dataclass
class CoarsePresses:
    """Presses of a model on two coarse meshes, with any effects on; each is solved, and each body condensed, once.

    Attributes
    ----------
    model : without them
    factor : edge lengths of the finer of both meshes over those of the model
    residual : at which increments at finite strain end, with what others leave for them; None: those of a press
    """

    model: Model
    factor: float
    residual: float | None = None
    _bodies: dict[tuple[bool, bool, bool, ElasticObject | None], Problem] = field(default_factory=dict)
    _workspaces: dict[int, Workspace] = field(default_factory=dict)
    _ends: dict[int, dict[Move, tuple[Float, Float]]] = field(default_factory=dict)
    _known: dict[tuple[bool, tuple[str, ...]], Numbers] = field(default_factory=dict)

    def check(self, effects: Mapping[str, Enriched], both: bool = True) -> None:
        """Raise an error if the finer mesh, or one of both, is too coarse.

        Raises
        ------
        Finger3dError
            If the model refuses an effect, contact is not resolved, or both meshes hardly differ.
        """
        fine = self._problem(effects, False)
        if both and edge_ratio(fine, self._problem(effects, True)) < LEAST_RATIO:
            raise Finger3dError("the mesh is too coarse for a coarser one; lower mesh.size_mm")

    def numbers(self, effects: Mapping[str, Enriched], still: bool) -> Numbers:
        """Return the numbers with some effects on, and the resolution of lengths and areas, by name.

        Parameters
        ----------
        still : whether on the coarser of both meshes

        Raises
        ------
        Finger3dError
            If the model refuses an effect, contact is not resolved, or the press does not converge.
        """
        key = still, tuple(sorted(effects))
        if key not in self._known:
            problem = self._problem(effects, still)
            last = last_step(problem, self._workspace(problem))
            self._known[key] = changing_numbers(problem, last), PointResolution.of(problem, last).zone_bars
        return self._known[key]

    def _problem(self, effects: Mapping[str, Enriched], still: bool) -> Problem:
        coarse = coarse_model(self.model, self.factor * (_STILL if still else 1.0), _STEPS[still])
        # the strain without foils is that of a press of its own, and no other press has it
        return replace(self._body(enriched(coarse, effects), still), without_inclusions=None)

    def _workspace(self, problem: Problem) -> Workspace | None:
        """Return what presses of a body at finite strain leave for each other."""
        if self.residual is None or not problem.model.finite_strain:
            return None
        body, mesh = id(problem.inclusions), id(problem.mesh)
        if body not in self._workspaces:
            empty, ends = formulation_of(problem.model).workspace(), self._ends.setdefault(mesh, {})
            self._workspaces[body] = replace(empty, target=self.residual, ends=ends)
        return self._workspaces[body]

    def _body(self, model: Model, still: bool) -> Problem:
        """Return a condensed model, from the bodies that are known if it differs in foils, object or strain only."""
        thing = model.object_compliance
        key = still, model.finite_strain, model.inclusions is not None, thing
        if key not in self._bodies:
            self._bodies[key] = self._from_others(model, *key) or build(model)
        return _with_model(self._bodies[key], model)

    def _from_others(
        self, model: Model, still: bool, finite: bool, foils: bool, thing: ElasticObject | None
    ) -> Problem | None:
        """Return a body made of those that are known; None if there are none, or other points may touch."""
        with_foils = self._bodies.get((still, finite, True, thing))
        if with_foils and with_foils.without_inclusions:
            return _softened(with_foils) if finite else with_foils.without_inclusions
        small = self._bodies.get((still, False, foils, thing))
        if finite and small and _has_points_of(small, model):
            return small
        if thing is None:
            return None
        alone = _with_model(self._body(replace(model, object_compliance=None), still), model)
        from finger3d.mechanics.discretise.elastic_object import ObjectResponse  # a press imports what its scene names

        for (*others, other), body in self._bodies.items():
            known = body.system.object_compliance
            if others == [still, finite, foils] and other and known is not None:  # its compliance is as 1/E
                return with_object_compliance(alone, ObjectResponse(other.E_MPa / thing.E_MPa * known, None, {}))
        return with_elastic_object(alone)

    def changes(
        self,
        effects: Mapping[str, Enriched],
        added: str,
        press: Mapping[str, float] | None = None,
        neutral: Mapping[str, Enriched] | None = None,
        with_error: bool = True,
    ) -> ChangeEstimate:
        """Return what one of several effects changes beside the others.

        Parameters
        ----------
        effects : all that are on, the one in question among them
        added : name of the one in question
        press : numbers of the press itself without it, if they are known
        neutral : what stands in its place in the presses without it, by another name
        with_error : whether to press on the coarser of both meshes, too; otherwise errors are as large as the changes
        """
        others = {name: effects[name] for name in effects if name != added} | dict(neutral or {})
        (before, zones), (after, more_zones) = (self.numbers(chosen, False) for chosen in (others, effects))
        values = press or before
        names = [name for name in values if name in after and name in before]
        change = {name: after[name] - before[name] for name in names}
        least, how = LEAST_ERROR, f"with {_STILL:g} times these edges in at most {_STEPS[1]}"
        if not with_error:
            least, how = 1.0, "as large as the change"
        errors = {name: max(least * abs(change[name]), abs(before[name] - values[name])) for name in names}
        if with_error:  # of what changes beside large deformation, in small strain
            both = [{n: some[n] for n in some if n == added or n != LARGE_DEFORMATION} for some in (others, effects)]
            self.check(both[1])
            (a, b), (c, d) = ([self.numbers(some, still)[0] for some in both] for still in (False, True))
            apart = {name: abs(b[name] - a[name] - d[name] + c[name]) for name in names}
            errors = {name: max(errors[name], _SAFETY * apart[name]) for name in names}
        mesh = coarser(self.model, self.factor).mesh
        return ChangeEstimate(
            changes=judged({name: values[name] for name in names}, change, errors, kinds_of(self.model.columns)),
            method=f"presses with and without it, with {mesh.size_mm:.4g} and {mesh.base_size_mm:.4g} mm in "
            f"at most {_STEPS[0]} increments a leg; error: {how}"
            ", and from how far the coarse press without it is from the press",
            resolution={name: bar + more_zones.get(name, 0.0) for name, bar in zones.items()},
        )


def _has_points_of(small: Problem, model: Model) -> bool:
    """Return whether the points that may touch at finite strain are those of a body in small strain."""
    rigid = replace(model, object_compliance=None)
    free = free_surface(rigid, small.mesh, small.body.thickness)
    found = candidate_points(rigid, free, small.system.first_contact_mm, MARGIN)
    return np.array_equal(found.nodes, small.surface.nodes)


def _softened(problem: Problem) -> Problem:
    """Return a problem whose foils have no stiffness: gauges read the same places of the mesh as with it."""
    inclusions = problem.inclusions
    assert inclusions.bars is not None
    bars = replace(inclusions.bars, stiffness=1e-9 * inclusions.bars.stiffness)
    return replace(problem, inclusions=replace(inclusions, bars=bars))


def _with_model(problem: Problem, model: Model) -> Problem:
    """Return a problem with another model of the same body."""
    body = problem.without_inclusions
    return replace(problem, model=model, without_inclusions=body and replace(body, model=model))


def large_deformation(problem: Problem, last: StepResult, increments: int) -> ChangeEstimate:
    """Estimate what large deformation would change in the last increment of a press in small strain.

    Where that fails, the estimate is without changes and states why.
    """
    start, on = time.perf_counter(), {LARGE_DEFORMATION: at_large_deformation}
    try:
        check_kind(problem.model)
        factor = cheap_factor(lambda _: problem.model, problem.size.press_s(increments))
        presses = CoarsePresses(problem.model, factor)
        presses.check({})
        found = presses.changes(on, LARGE_DEFORMATION, changing_numbers(problem, last))
    except FAILURES as error:
        found = ChangeEstimate(method=f"no estimate: {error}")
    return replace(found, seconds=time.perf_counter() - start)


def cheap_factor(model: Callable[[float], Model], press_s: float, first: Sequence[float] = ()) -> float:
    """Return the edge lengths of the coarse mesh over those of a press that takes some seconds.

    The modelled cost is that of the press at large deformation on this mesh, at least half of the estimate.

    Parameters
    ----------
    model : function of this factor that returns the model whose edges are to be multiplied
    first : factors to be tried before those of a coarse mesh
    """
    budget = min(CHANGES.seconds(press_s), LARGE_DEFORMATION_S)
    return affordable_factor(lambda f: at_large_deformation(coarse_model(model(f), f, _STEPS[0])), budget, first)


def coarse_model(model: Model, factor: float, steps: int) -> Model:
    """Return a model with longer edges, none shorter at the border of stick, and few increments a leg."""
    found = coarser(model, factor)
    mesh = replace(found.mesh, borders=None)
    legs = (replace(leg, steps=steps if leg.steps == "auto" else min(leg.steps, steps)) for leg in model.legs)
    return replace(found, mesh=mesh, legs=tuple(legs))


def at_large_deformation(model: Model) -> Model:
    """Return a model at large deformation, with the neo-Hookean law of its moduli."""
    # imported here: without this estimate, a press in small strain does not need them
    from finger3d.fem.laws import NeoHooke

    return fill(model, "hyperelastic_law", NeoHooke(1.0), LARGE_DEFORMATION)
