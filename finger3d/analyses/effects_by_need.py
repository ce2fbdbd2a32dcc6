"""Which effects a scene calls for: those that change a number of its press by more than a tolerance.

Every effect that the scene names, and large deformation in any case, is judged by presses with all effects and without
it, since one effect may matter or not because of another.  What is left out is a part of the model's error.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import partial

from finger3d._types import Tree
from finger3d.accuracy.changes import FAILURES, ChangeEstimate, two_digits
from finger3d.accuracy.cost import PressCost, added_cost, press_cost
from finger3d.accuracy.model_error import (
    LARGE_DEFORMATION,
    LEAST_ERROR,
    CoarsePresses,
    Enriched,
    cheap_factor,
    enriched,
)
from finger3d.effects import effect_names
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.progress import Progress
from finger3d.scene import Scene

_NEEDS = {
    "viscosity": "no Prony series",
    "embedded_gauge": "no stiffness of the gauges",
    "elastic_object": "no modulus of the object",
    "kinetic_friction": "no kinetic coefficient of friction",
}
"""What an effect that a scene does not name lacks."""

_NEUTRAL: Mapping[str, Tree] = {
    "kinetic_friction": {"ratio": 1.0 - 1e-12},
    "viscosity": {"prony": ((1e-12, 1.0),)},
    "elastic_object": {"E_MPa": 1e9},
}
"""Settings with which an effect changes nothing.  With the first two increments are as they are given, without them of
second order or exact: few increments would make a difference of their own.  So would gaps that are read along common
normals of two elastic bodies: in one of 69 sections they change friction by 3 %, however stiff the object is."""

_RAISED, _ALTERED = 4.0, 1.25
"""Factors by which large deformation is taken to raise the change of friction or stick by another effect at most, and
to raise or lower that of another number."""

_SMALL = 0.02
"""Change up to which its error on the press's own mesh is taken as large as itself, without a second mesh."""

_OF_FRICTION = "kinetic_friction"
"""The effect that changes hardly anything but friction and stick."""

_RESIDUAL = 1e-4
"""Residual at which increments at finite strain end: friction, which is the most sensitive, is known to 0.02 %."""


@dataclass(frozen=True)
class Judged:
    """What was found about one effect.

    Attributes
    ----------
    used : whether the effect is on
    estimate : what it changes beside the others, with its error; empty if it is used
    number : name of the number that it changes most, relative to its scale
    change : relative change of that number
    seconds : that it adds to the press by the forecast
    """

    used: bool
    estimate: ChangeEstimate
    number: str
    change: float
    seconds: float

    @property
    def why(self) -> str:
        """The reason in words."""
        return f"changes {self.number} by {two_digits(100.0 * self.change)} %" if self.number else self.estimate.method


@dataclass(frozen=True)
class Need:
    """Effects that a scene calls for.

    Attributes
    ----------
    tolerance : relative change of a number above which an effect is used
    judged : effects by name
    unjudged : reason by name of those that could not be judged, and are off
    seconds : that the judgement took
    """

    tolerance: float
    judged: Mapping[str, Judged] = field(default_factory=dict)
    unjudged: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the effects that are on."""
        return tuple(name for name, one in self.judged.items() if one.used)

    @property
    def left_out(self) -> dict[str, ChangeEstimate]:
        """Estimates of what the effects would change that are off."""
        return {name: one.estimate for name, one in self.judged.items() if not one.used}

    def rows(self) -> list[tuple[str, str]]:
        """Return the name of each effect, and whether and why it is used."""
        rows = [
            (name, f"{'used' if one.used else 'not used'}: {one.why}, about {one.seconds:.2g} s")
            for name, one in self.judged.items()
        ]
        return rows + [(name, f"not judged: {why}") for name, why in self.unjudged.items()]

    def as_dict(self) -> Tree:
        """Return the entry of summary.json."""
        judged = {
            name: {"used": one.used, "why": one.why, "number": one.number, "change": one.change, "seconds": one.seconds}
            for name, one in self.judged.items()
        }
        return {
            "tolerance": self.tolerance,
            "used": list(self.used),
            "judged": judged,
            "not_judged": dict(self.unjudged),
            "seconds": self.seconds,
        }


def judge(scene: Scene, report: Progress) -> Need:
    """Find the effects that a scene with ``effects.auto`` calls for.

    Raises
    ------
    Finger3dError
        If no mesh for coarse presses resolves the contact, so that nothing can be judged.
    """
    assert scene.auto is not None
    start = time.perf_counter()
    plain = scene.with_effects(()).model()
    settings = {LARGE_DEFORMATION: None, **scene.effects}
    effects = {name: effect or scene.with_effects([name]).effects[name] for name, effect in settings.items()}
    on: dict[str, Enriched] = {name: effect.apply for name, effect in effects.items()}
    off: dict[str, dict[str, Enriched]] = {
        name: {f"no {name}": replace(effects[name], **_NEUTRAL[name]).apply} for name in on.keys() & _NEUTRAL.keys()
    }
    report.stage("judging which effects the scene calls for")
    cost = press_cost(plain)
    presses = _presses(plain, cost, {name: on[name] for name in scene.effects})
    least = scene.auto / (1.0 + LEAST_ERROR)  # such a change may be the tolerance
    found, failed = _beside_each_other(presses, on, off, least, report)
    largest = {name: _largest(one(with_error=False)) for name, one in found.items()}
    used = {name for name, (_, change) in largest.items() if abs(change) > least}
    added_s = _added_seconds(plain, cost, {name: on[name] for name in found}, used)
    estimates = {
        name: _with_error(one, presses.factor > 1.0 or abs(largest[name][1]) > _SMALL)
        for name, one in found.items()
        if name not in used
    }
    judged = {
        name: Judged(name in used, estimates.get(name, ChangeEstimate()), *largest[name], added_s[name])
        for name in on
        if name in found
    }
    unjudged = {name: why for name, why in _NEEDS.items() if name not in on and name in effect_names()}
    return Need(scene.auto, judged, failed | unjudged, time.perf_counter() - start)


def of_press(need: Need, numbers: Mapping[str, float]) -> dict[str, ChangeEstimate]:
    """Return what the effects that are off would change in a press with these numbers, by name."""
    return {
        name: replace(
            estimate,
            changes={key: replace(c, value=numbers[key]) for key, c in estimate.changes.items() if key in numbers},
        )
        for name, estimate in need.left_out.items()
    }


def _presses(model: Model, cost: PressCost, effects: Mapping[str, Enriched]) -> CoarsePresses:
    """Return the presses by which the effects of a scene are judged, in few increments.

    All edges are those of the press, or else those at the contact, unless that is too costly: on them depends what an
    effect changes in friction.
    """
    mesh, press_s = model.mesh, sum(s for stage, s in cost.seconds.items() if stage not in ("start", "output"))

    def as_fine_at_contact(factor: float) -> Model:
        return replace(model, mesh=replace(mesh, size_mm=mesh.size_mm / factor))

    try:
        factor = cheap_factor(as_fine_at_contact, press_s, first=(1.0,))
        presses = CoarsePresses(as_fine_at_contact(factor), factor, _RESIDUAL)
    except Finger3dError:  # too costly
        presses = CoarsePresses(model, cheap_factor(lambda _: model, press_s), _RESIDUAL)
    for tried in (presses, CoarsePresses(model, 1.0, _RESIDUAL)):
        for chosen in (effects, {}):  # bodies with the effects are needed later
            try:
                tried.check(chosen, both=False)
            except Finger3dError as error:
                why = error
            else:
                return tried
    raise why


def _beside_each_other(
    presses: CoarsePresses,
    on: Mapping[str, Enriched],
    off: Mapping[str, Mapping[str, Enriched]],
    least: float,
    report: Progress,
) -> tuple[dict[str, Callable[..., ChangeEstimate]], dict[str, str]]:
    """Return the estimate of each effect beside all others, as a function, and why others cannot be judged, by name.

    Effects are judged beside each other in small strain, and large deformation beside them; if it is used, kinetic
    friction and those that it may make needed or needless are judged beside it.

    Parameters
    ----------
    least : change above which an effect is used
    """
    found, failed = dict[str, Callable[..., ChangeEstimate]](), dict[str, str]()

    def judge_beside(name: str, *groups: Mapping[str, Enriched]) -> None:
        report.say(f"judging {name}")
        for group in groups:
            estimate = partial(presses.changes, group, name, neutral=off.get(name))
            try:
                estimate(with_error=False)
            except FAILURES as error:
                failed.setdefault(name, str(error) or type(error).__name__)
            else:
                found[name] = estimate
                return

    small = {name: on[name] for name in sorted(on) if name != LARGE_DEFORMATION}
    others = [name for name in small if name != _OF_FRICTION]
    for name in others:
        judge_beside(name, small, {name: on[name]})
    together = {name: small[name] for name in small if name in found or name == _OF_FRICTION}
    for name in list(found) if len(together) < len(small) else ():
        judge_beside(name, together)
    large = {LARGE_DEFORMATION: on[LARGE_DEFORMATION]}
    judge_beside(LARGE_DEFORMATION, together | large, large)
    is_large = LARGE_DEFORMATION in found and abs(_largest(found[LARGE_DEFORMATION](with_error=False))[1]) > least
    if _OF_FRICTION in small:
        judge_beside(_OF_FRICTION, *[together | large] * is_large, together, {_OF_FRICTION: on[_OF_FRICTION]})
    for name in sorted(together.keys() & others) if is_large else ():
        fickle, firm = (abs(_largest(found[name](with_error=False), some)[1]) for some in (True, False))
        if firm < _ALTERED * least and max(fickle * _RAISED, firm * _ALTERED) > least:
            judge_beside(name, together | large)
    return found, {name: why for name, why in failed.items() if name not in found}


def _largest(estimate: ChangeEstimate, fickle: bool | None = None) -> tuple[str, float]:
    """Return the number that changes most relative to its scale, and its change.

    A length or an area, which changes by whole contact points, counts if it changes by more than they resolve.

    Parameters
    ----------
    fickle : True for the numbers of friction and stick, which other effects may alter altogether, False for the others
    """
    known = {
        name: change.relative
        for name, change in estimate.changes.items()
        if abs(change.change) >= estimate.resolution.get(name, 0.0)
        and fickle in (None, name.startswith(("friction", "stick")))
    }
    return max(known.items(), key=lambda item: abs(item[1]), default=("", 0.0))


def _with_error(estimate: Callable[..., ChangeEstimate], by_mesh: bool) -> ChangeEstimate:
    """Return the estimate with its error, which is as large as a change that is small or has no coarser mesh."""
    try:
        return estimate(with_error=by_mesh)
    except FAILURES as error:
        found = estimate(with_error=False)
        return replace(found, method=f"{found.method}; no second mesh: {error}")


def _added_seconds(model: Model, press: PressCost, on: Mapping[str, Enriched], used: Set[str]) -> dict[str, float]:
    """Return the seconds by name that each effect adds to a press with those that are used, by the forecast."""
    added = dict[str, float]()
    for name in on:
        beside = enriched(model, {other: on[other] for other in used | {name}})
        slots = [slot for slot, filled_by in beside.filled if filled_by == name]
        added[name] = sum(added_cost(slot, beside, press).seconds for slot in slots)
    return added
