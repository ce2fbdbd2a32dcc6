"""Which effects a scene calls for: those that change a number of its press by more than a tolerance.

Every effect that the scene names, and large deformation in any case, is added to coarse presses, first alone and then,
since one effect may matter or not because of another, beside all others that may matter.  What is left out is a part of
the model's error.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from finger3d._types import Tree
from finger3d.accuracy.changes import ChangeEstimate, two_digits
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.accuracy.model_error import CoarsePresses, Enriched, cheap_factor
from finger3d.effects import effect_names
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Model
from finger3d.progress import Progress
from finger3d.scene import Scene

LARGE_DEFORMATION = "large_deformation"
"""The effect that every scene has the data for."""

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
}
"""Settings with which an effect changes nothing.  With these effects increments are as they are given, without them of
second order or exact: few increments would make a difference of their own."""

_FINER_AT_CONTACT = 2.0
"""Edge lengths of the coarse meshes relative to their bases, over those of the press: few points of contact say nothing
about friction."""

_ROUND_OFF = 1e-9
"""Relative change up to which nothing changes."""

_INTERACTION = 8.0
"""Factor by which other effects are taken to raise or lower the change by one at most."""

_FAILURES = (Finger3dError, RuntimeError, ValueError, np.linalg.LinAlgError, MemoryError)


@dataclass(frozen=True)
class Judged:
    """What was found about one effect.

    Attributes
    ----------
    used : whether the effect is on
    estimate : what it changes, alone or beside the other effects that may matter
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
        If the coarse presses without any effect fail, so that nothing can be judged.
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
    presses = _presses(plain)
    found, failed = dict[str, ChangeEstimate](), dict[str, str]()
    for name in sorted(on):
        report.say(f"judging {name}")
        try:
            found[name] = presses.changes({name: on[name]}, name, neutral=off.get(name))
        except _FAILURES as error:
            failed[name] = str(error) or type(error).__name__
    found |= _beside_each_other(presses, on, off, found, scene.auto, report)
    largest = {name: _largest(estimate) for name, estimate in found.items()}
    used = {name: on[name] for name, (_, change) in largest.items() if abs(change) > scene.auto}
    judged = {
        name: Judged(name in used, found[name], *largest[name], _added_seconds(plain, used, name, on[name]))
        for name in found
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


def _presses(model: Model) -> CoarsePresses:
    """Return the coarse presses of a scene, on its own mesh in few increments where coarser ones do not resolve it."""
    mesh, press_s = model.mesh, without_output_s(forecast(model))
    fine = replace(model, mesh=replace(mesh, size_mm=mesh.size_mm / _FINER_AT_CONTACT))
    try:
        presses = CoarsePresses(fine, cheap_factor(fine, press_s))
    except Finger3dError:  # too costly
        presses = CoarsePresses(model, cheap_factor(model, press_s))
    try:
        presses.numbers({})
    except Finger3dError:
        presses = CoarsePresses(model, 1.0, 1.0)
        presses.numbers({})
    return presses


def _beside_each_other(
    presses: CoarsePresses,
    on: Mapping[str, Enriched],
    off: Mapping[str, Mapping[str, Enriched]],
    alone: Mapping[str, ChangeEstimate],
    tolerance: float,
    report: Progress,
) -> dict[str, ChangeEstimate]:
    """Return what effects change beside all others that may matter, where others may decide whether they are needed."""
    reach = {
        name: max((abs(c.relative) for c in estimate.changes.values()), default=0.0) for name, estimate in alone.items()
    }
    # kinetic friction alone changes nothing where all points stick: others may let them slip
    near = {name: on[name] for name in alone if not _ROUND_OFF < reach[name] < tolerance / _INTERACTION}
    found = dict[str, ChangeEstimate]()
    for name in near if len(near) > 1 else ():
        if abs(_largest(alone[name])[1]) > _INTERACTION * tolerance:
            continue
        report.say(f"judging {name}, beside {', '.join(other for other in near if other != name)}")
        try:
            found[name] = presses.changes(near, name, neutral=off.get(name))
        except _FAILURES as error:
            report.say(f"{name} is judged alone: {error}")
    return found


def _largest(estimate: ChangeEstimate) -> tuple[str, float]:
    """Return the number that changes most relative to its scale, and its change.

    A length or an area, which changes by whole contact points, counts if it changes by more than they resolve.
    """
    known = {
        name: change.relative
        for name, change in estimate.changes.items()
        if abs(change.change) >= estimate.resolution.get(name, 0.0)
    }
    return max(known.items(), key=lambda item: abs(item[1]), default=("", 0.0))


def _added_seconds(model: Model, used: Mapping[str, Enriched], name: str, added: Enriched) -> float:
    """Return the seconds that an effect adds to a press with those that are used by the forecast."""
    for other in sorted(used.keys() - {name}):
        model = used[other](model)
    return max(float(forecast(added(model))["total_s"] - forecast(model)["total_s"]), 0.0)
