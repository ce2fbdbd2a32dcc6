"""Model error of a press: what effects that are off would change, and which effects it calls for.

The scene is pressed on a coarse mesh and in few increments with all effects and without one of them; both presses take
the same increments, so that these leave the same error in both.  The error of a change d follows from the change d' in
fewer increments on a mesh with twice the edges ::

    error of d = max(1.5 |d - d'|, 0.15 |d|)

If the press is so cheap that its own mesh takes the place of the coarse one, a decision needs fewer increments only:
what an effect changes on that mesh is what it changes in the press.

An effect is called for if the change of a number and its error exceed a tolerance times the number's natural scale
(`finger3d.accuracy.changes.natural_scales`).  Lengths and areas, which change by whole contact points on a coarse mesh,
count only if they change by more than these resolve.  Where presses at large deformation cost too much, the strain of a
press of linear elasticity decides on large deformation, and the other effects are judged without it.
``validation/effects_by_need.py`` measures how often both are right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from finger3d._cost import JUDGEMENT_S, JUDGEMENT_SHARE
from finger3d._types import Float
from finger3d.accuracy.changes import Change, ChangeEstimate, changing_numbers, natural_scales, two_digits, unresolved
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.contact.friction import TwoCoefficients
from finger3d.effects import LARGE_DEFORMATION, fill
from finger3d.errors import FAILURES, Finger3dError, UnresolvedError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarser
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.step_halving import rough_steps
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import of_kind

_LARGE_STRAIN = 0.1
"""Principal strain from which large deformation is advised without an estimate."""

_QUANTILE = 0.99  # leaves out the clamped corners, where the strain is singular

_MOST_GAUGES = 3
"""Gauges that a line of advice names, those that change most."""

_NAMES = {"normal_force_N": "the normal force", "friction_sum_N": "the friction sum"}


def largest_principal_strain(strain: Float) -> float:
    """Return the largest principal strain of nodal strains (n, 3, 3), without the singular corners."""
    return float(np.quantile(np.abs(np.linalg.eigvalsh(strain)).max(axis=1), _QUANTILE))


def advise(model: Model, strain: float, large: ChangeEstimate | None = None) -> list[str]:
    """Return lines of advice for a finished press.

    Parameters
    ----------
    strain : largest principal strain
    large : what large deformation would change, if it was estimated
    """
    out = []
    if not model.finite_strain:
        if large and (said := _changes(large.significant, {c.key for c in of_kind(model.columns, "gauge")})):
            out.append(f"large deformation would change {said}: switch on [effects.large_deformation]")
        elif strain >= _LARGE_STRAIN:
            what = f"principal strains reach {strain:.2g}, large for linear elasticity"
            out.append(f"{what}: switch on [effects.large_deformation]")
    return out + _width(model)


def _changes(changes: dict[str, Change], gauges: set[str]) -> str:
    """Return forces and the gauges that change most, each with its change and the interval of the change."""
    forces = [name for name in changes if name in _NAMES]
    strains = sorted(gauges & set(changes), key=lambda name: -abs(changes[name].change))
    if not (forces or strains):
        return ""
    said = [f"{_NAMES.get(name, name)} by {_change(changes[name])}" for name in forces + strains[:_MOST_GAUGES]]
    return " and ".join(part for part in (", ".join(said[:-1]), said[-1]) if part)


def _change(change: Change) -> str:
    """Return a change and its interval: relative to the number, or absolute where it is larger than the number."""
    if abs(change.change) > abs(change.value):
        return f"{change.change:+.2g} ({change.low:+.2g} to {change.high:+.2g})"
    ends = sorted((change.low / change.value, change.high / change.value))
    middle, low, high = (two_digits(100.0 * x) for x in (change.change / change.value, *ends))
    return f"{middle} % ({low} to {high} %)"


def _width(model: Model) -> list[str]:
    if model.domain == "solid":
        return []
    ratio = model.design.width_mm / model.design.height_mm
    return [f"a section stands for a finger of width/height = {ratio:.2g}: finger3d compare says by how much it errs"]


STRAIN_TOLERANCE = 0.02
"""Principal strain of linear elasticity from which large deformation is used where its change is not known: stresses
change by about their strain."""

_CERTAIN = 0.1
"""Principal strain of linear elasticity from which large deformation changes a number by more than a few percent."""

_BY_STRAIN = 4.0
"""Change of a number over the strain of linear elasticity, at most, where the strain alone is known."""

_STEPS = (5, 3)
"""Most increments in each leg, on the coarse mesh and on the one that is coarser still."""

_STILL = 2.0
"""Edge lengths of the mesh that is coarser still over those of the coarse one."""

_FACTORS = (1.0, math.sqrt(2.0), 2.0, 2.0 * math.sqrt(2.0), 4.0, 4.0 * math.sqrt(2.0))
"""Edge lengths of the coarse mesh over those of the press; the first that is cheap enough is taken."""

_SAFETY, _LEAST_ERROR = 1.5, 0.15
"""Error of a change over its difference between both meshes, and least error relative to the change."""

_NO_DIFFERENCE = 1.0 - 1e-12
"""Ratio of kinetic to static friction with which increments are as they are given, as at large deformation."""

Enriched = Callable[[Model], Model]
"""Function that returns a model with one more effect on."""


def enriched(model: Model, effects: Mapping[str, Enriched]) -> Model:
    """Return a model with some effects on."""
    for name in sorted(effects):
        model = effects[name](model)
    return model


def at_large_deformation(model: Model) -> Model:
    """Return a model at large deformation, with the neo-Hookean law of its moduli."""
    # imported here: without this estimate, a press in small strain does not need them
    from finger3d.fem.laws import NeoHooke

    return fill(model, "hyperelastic_law", NeoHooke(1.0), LARGE_DEFORMATION)


@dataclass(frozen=True)
class Judged:
    """What was found about one effect.

    Attributes
    ----------
    used : whether the scene calls for it
    estimate : what it changes beside the others, with its error
    why : the reason in words
    number, change : the number that it changes most over its natural scale, and that relative change
    """

    used: bool
    estimate: ChangeEstimate
    why: str
    number: str = ""
    change: float = 0.0


@dataclass
class Judgement:
    """Judgement of effects by presses with and without them on a coarse mesh; each press is solved once.

    Attributes
    ----------
    model : without the effects in question
    effects : those in question, by name
    neutral : settings of effects that change nothing, in place of those that are left out
    tolerance : change of a number over its natural scale above which an effect is used
    """

    model: Model
    effects: Mapping[str, Enriched]
    neutral: Mapping[str, Enriched] = field(default_factory=dict)
    tolerance: float = 0.02
    _known: dict[tuple[bool, frozenset[str]], _Press] = field(default_factory=dict)
    _decides: bool = True
    _unresolved_from: float = math.inf  # factor of edge lengths from which the object is not resolved

    def found(self, shortcut: bool = True) -> dict[str, Judged]:
        """Return what was found about every effect, by name.

        Parameters
        ----------
        shortcut : whether to decide only: large strains, or a large change whose error is not known, are enough
        """
        everything, self._decides = frozenset(self.effects), shortcut
        for beside in filter(None, (everything, everything - {LARGE_DEFORMATION})):
            if factor := self._factor(beside):
                break
        out = dict[str, Judged]()
        if LARGE_DEFORMATION in everything:
            strain = self._strain(factor)
            if factor is None or strain is None or LARGE_DEFORMATION not in beside or (shortcut and strain >= _CERTAIN):
                out[LARGE_DEFORMATION] = self._by_strain(strain)
        for name in everything - out.keys():
            out[name] = self._by_presses(name, beside, factor)
        return {name: out[name] for name in self.effects}

    def _factor(self, effects: frozenset[str]) -> float | None:
        """Return the edge lengths of the coarse mesh over those of the press; None if all cost too much."""
        everything = enriched(self.model, {name: self.effects[name] for name in effects})
        try:
            budget = max(JUDGEMENT_SHARE * without_output_s(forecast(everything)), JUDGEMENT_S)
        except Finger3dError:  # more than the machine has; the press will say so
            budget = JUDGEMENT_S
        for factor in (one for one in _FACTORS if one < self._unresolved_from):
            try:
                one = forecast(self._coarse(effects, factor, _STEPS[0]))
                seconds = without_output_s(one) - (float(one["mesh_s"]) if factor == 1.0 else 0.0)
                if (1 + len(effects)) * seconds <= len(effects) * budget:
                    self._press(frozenset(), False, factor)
                    return factor
            except UnresolvedError:  # and longer edges resolve the object no better
                self._unresolved_from = factor
                return None
            except FAILURES:
                continue
        return None

    def _coarse(self, effects: frozenset[str], factor: float, steps: int) -> Model:
        """Return the model with longer edges and few increments, with some effects, and others that change nothing."""
        found = coarser(self.model, factor) if factor > 1.0 else self.model
        legs = (replace(leg, steps=steps if leg.steps == "auto" else min(leg.steps, steps)) for leg in found.legs)
        found = replace(found, mesh=replace(found.mesh, borders=None), legs=tuple(legs))
        left_out = {name: one for name, one in self.neutral.items() if name in self.effects.keys() - effects}
        found = enriched(found, {name: self.effects[name] for name in effects} | left_out)
        if found.friction.largest > 0.0 and not found.is_defined_by_increments:
            found = replace(found, friction=TwoCoefficients(found.friction.mu, _NO_DIFFERENCE, "keep"))
        return found

    def _on_its_mesh(self, factor: float) -> bool:
        """Whether a decision follows from presses on the mesh of the press itself."""
        return self._decides and factor == 1.0 and self.model.mesh.borders is None

    def _press(self, effects: frozenset[str], still: bool, factor: float) -> _Press:
        """Press with some effects; raises what such a press raises."""
        key = still, effects
        if key not in self._known:
            longer = _STILL if still and not self._on_its_mesh(factor) else 1.0
            model = self._coarse(effects, factor * longer, _STEPS[still])
            problem = replace(build(model), without_inclusions=None)
            last = rough_steps(problem)[-1]
            strain = formulation_of(model).fields(problem, last.meshed_state)[1]
            numbers = changing_numbers(problem, last)
            scales = natural_scales(model, last.target.depth_mm, numbers)
            self._known[key] = _Press(numbers, scales, unresolved(problem, last, scales), strain)
        return self._known[key]

    def _strain(self, factor: float | None) -> float | None:
        """Return the largest principal strain without large deformation; None if no press tells it."""
        if factor is None and self._unresolved_from < math.inf:
            return None
        without = frozenset[str]() if factor is None else frozenset(self.effects) - {LARGE_DEFORMATION}
        for chosen in (factor,) if factor else _FACTORS[::-1]:
            for effects in {without, frozenset[str]()}:
                try:
                    return largest_principal_strain(self._press(effects, False, chosen).strain)
                except FAILURES:
                    continue
        return None

    def _by_strain(self, strain: float | None) -> Judged:
        """Judge large deformation by the strain without it."""
        if strain is None:
            return Judged(True, ChangeEstimate(method="no coarse press resolves the contact"), "no coarse press tells")
        press = next(iter(self._known.values()))
        share = _BY_STRAIN * strain
        changes = {name: Change(press.numbers[name], 0.0, share * s, s) for name, s in press.scales.items()}
        estimate = ChangeEstimate(changes=changes, method=f"principal strains of {strain:.2g} without it")
        return Judged(strain >= STRAIN_TOLERANCE, estimate, f"principal strains reach {strain:.2g}")

    def _by_presses(self, name: str, everything: frozenset[str], factor: float | None) -> Judged:
        """Judge an effect by presses with all effects and without it; if they fail, beside fewer others."""
        failure: Exception = Finger3dError("it would take too long")
        for beside in dict.fromkeys((everything, everything - {LARGE_DEFORMATION} | {name}, frozenset({name}))):
            if factor is None:
                break
            try:
                return self._decided(name, beside, factor)
            except FAILURES as error:
                failure = error
        if name == LARGE_DEFORMATION:
            return self._by_strain(self._strain(factor))
        why = f"it could not be judged: {failure or type(failure).__name__}"
        return Judged(True, ChangeEstimate(method=f"no estimate: {why}"), why)

    def _decided(self, name: str, beside: frozenset[str], factor: float) -> Judged:
        before, after = (self._press(some, False, factor) for some in (beside - {name}, beside))
        change = {key: after.numbers[key] - value for key, value in before.numbers.items() if key in after.numbers}
        change = {key: d for key, d in change.items() if math.isfinite(d)}
        how = "as large as the change"
        error = {key: abs(d) for key, d in change.items()}
        scales = {key: max(before.scales[key], after.scales.get(key, 0.0)) for key in change}
        zones = {key: bar + after.resolved.get(key, 0.0) for key, bar in before.resolved.items() if key in change}
        largest = max((abs(d) / scales[k] for k, d in change.items() if scales[k] and k not in zones), default=0.0)
        if largest <= self.tolerance or not self._decides:
            try:
                less, more = (self._press(some, True, factor) for some in (beside - {name}, beside))
            except FAILURES:
                pass
            else:
                longer = "" if self._on_its_mesh(factor) else f"with {_STILL:g} times these edges "
                how = f"{longer}in at most {_STEPS[1]}"
                error = {
                    key: max(_SAFETY * abs(d - more.numbers[key] + less.numbers[key]), _LEAST_ERROR * abs(d))
                    for key, d in change.items()
                }
        changes = {key: Change(before.numbers[key], d, error[key], scales[key]) for key, d in change.items()}
        edges = (coarser(self.model, factor) if factor > 1.0 else self.model).mesh
        method = f"presses with and without it, with {edges.size_mm:.4g} and {edges.base_size_mm:.4g} mm in at most "
        method += f"{_STEPS[0]} increments a leg; error: {how}, and from how far the coarse press is from the press"
        counting = {
            key: abs(c.relative) if key in zones else abs(c.relative) + c.error / c.scale
            for key, c in changes.items()
            if c.scale and abs(c.change) > zones.get(key, 0.0)
        }
        number = max(counting, key=lambda key: counting[key], default="")
        used = bool(number) and counting[number] > self.tolerance
        relative = changes[number].relative if number else 0.0
        why = f"changes {number} by {two_digits(100.0 * relative)} %" if number else "changes no number"
        if used and abs(relative) <= self.tolerance:
            why += f" +- {100.0 * changes[number].error / changes[number].scale:.2g} %"
        return Judged(used, ChangeEstimate(changes=changes, method=method), why, number, relative)


def judged_large_deformation(model: Model, shortcut: bool = False) -> Judged:
    """Return what large deformation would change in a press in small strain, with its error.

    Parameters
    ----------
    shortcut : as in `Judgement.found`
    """
    return Judgement(model, {LARGE_DEFORMATION: at_large_deformation}).found(shortcut)[LARGE_DEFORMATION]


@dataclass(frozen=True)
class _Press:
    """Numbers at the end of a press with their natural scales, resolution of its lengths and areas, nodal strain."""

    numbers: Mapping[str, float]
    scales: Mapping[str, float]
    resolved: Mapping[str, float]
    strain: Float = field(default_factory=lambda: np.zeros((0, 3, 3)))
