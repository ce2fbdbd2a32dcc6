"""Free keys of a scene and their bounds, for searches and fits.

Large deformation is judged unless the scene names it or has ``effects.auto = false``, and with ``effects.auto = true``
every effect that it names.  What is left out is a part of the model's error.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.accuracy.changes import ChangeEstimate
from finger3d.accuracy.model_error import Enriched, Judged, Judgement
from finger3d.effects import effect_names
from finger3d.errors import Finger3dError
from finger3d.progress import QUIET, Progress
from finger3d.scene import Scene, Source, parse, tables_of, tree
from finger3d.scene.material import modulus_of
from finger3d.scene.messages import shown

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


@dataclass(frozen=True)
class Need:
    """Effects that a scene calls for.

    Attributes
    ----------
    tolerance : change of a number over its natural scale above which an effect is used
    judged : effects by name
    unjudged : reason by name of those that the scene does not name
    seconds : that the judgement took
    """

    tolerance: float
    judged: Mapping[str, Judged] = field(default_factory=dict)
    unjudged: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def used(self) -> tuple[str, ...]:
        """Names of the effects in question that are on."""
        return tuple(name for name, one in self.judged.items() if one.used)

    def rows(self) -> list[tuple[str, str]]:
        """Return the name of each effect in question, and whether and why it is used."""
        return [(name, f"{'used' if one.used else 'not used'}: {one.why}") for name, one in self.judged.items()]

    def changes(self, numbers: Mapping[str, float]) -> dict[str, ChangeEstimate]:
        """Return what the effects that are off would change in a press with these numbers, by name."""
        return {name: one.estimate.of_press(numbers) for name, one in self.judged.items() if not one.used}

    def as_dict(self) -> Tree:
        """Return the entry of summary.json."""
        judged = {
            name: {"used": one.used, "why": one.why, "number": one.number, "change": one.change}
            for name, one in self.judged.items()
        }
        return {
            "tolerance": self.tolerance,
            "used": list(self.used),
            "judged": judged,
            "not_judged": dict(self.unjudged),
            "seconds": self.seconds,
        }


def settled(scene: Scene, report: Progress = QUIET) -> tuple[Scene, Need | None]:
    """Return a scene with the effects that it calls for, and what was judged; None where nothing is open."""
    if not scene.open_effects:
        return scene, None
    need = judge(scene, report)
    for name, why in need.rows():
        report.say(f"{name.replace('_', ' ')}: {why}")
    return scene.with_effects([*scene.fixed_effects, *need.used]), need


def settled_tables(source: Source, overrides: Sequence[str], report: Progress) -> tuple[TreeView, Path | None]:
    """Return the tables of a scene with the effects that it calls for, and its path."""
    given, path = tables_of(source, overrides)
    scene, need = settled(parse(given, path), report)
    return (given if need is None else {**given, "effects": scene.given["effects"]}), path


def judge(scene: Scene, report: Progress = QUIET) -> Need:
    """Judge the effects that a scene leaves open."""
    start = time.perf_counter()
    report.stage("judging which effects the scene calls for")
    plain = scene.with_effects(scene.fixed_effects).model()
    settings = {name: scene.with_effects([*scene.fixed_effects, name]).effects[name] for name in scene.open_effects}
    on: dict[str, Enriched] = {name: effect.apply for name, effect in settings.items()}
    neutral: dict[str, Enriched] = {
        name: replace(settings[name], **_NEUTRAL[name]).apply for name in on.keys() & _NEUTRAL.keys()
    }
    judged = Judgement(plain, on, neutral, scene.tolerance_of_effects).found()
    named = {*scene.fixed_effects, *on}
    unjudged = {name: why for name, why in _NEEDS.items() if name not in named and name in effect_names()}
    return Need(scene.tolerance_of_effects, judged, unjudged, time.perf_counter() - start)


_DECADE = 10.0

Number = TypeVar("Number", float, Float)


@dataclass(frozen=True)
class FreeKey:
    """Free key of the scene and its bounds."""

    key: str
    low: float
    high: float

    @classmethod
    def of(cls, text: str, option: str = "--free", example: str = "for instance finger.radius_mm=60:200") -> FreeKey:
        """From ``KEY=LOW:HIGH``, which an option gave."""
        key, _, bounds = text.partition("=")
        try:
            low, high = (float(part) for part in bounds.split(":"))
        except ValueError:
            low = high = math.nan
        if not key.strip() or not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise Finger3dError(f"{option} {shown(text)}: must be KEY=LOW:HIGH with LOW below HIGH, {example}")
        return cls(key.strip(), low, high)

    def numbered(self, given: TreeView) -> str:
        """Return the key as it is set, with the number of a gauge in place of its name."""
        return tree.numbered(self.key, given, "--free")

    def start(self, given: TreeView) -> float:
        """Return the value of the scene as written, or the middle of the bounds where it lies outside.

        A modulus that the scene gives by a hardness or a silicone is that of this material.
        """
        key = self.numbered(given)
        own = tree.value_at(given, key) or modulus_of(given, key)
        return float(own) if isinstance(own, int | float) and self.low <= own <= self.high else self.middle

    @property
    def middle(self) -> float:
        """Middle of the bounds."""
        return 0.5 * (self.low + self.high)

    @property
    def is_logarithmic(self) -> bool:
        """Whether shares are those of the logarithm: of positive bounds that differ by more than a decade."""
        return self.low > 0.0 and self.high / self.low > _DECADE

    def value(self, share: Number) -> Number:
        """Return the value at a share of the range, from 0 to 1; of several shares (n,) the values (n,)."""
        if self.is_logarithmic:
            logarithmic: Number = self.low * (self.high / self.low) ** share
            return logarithmic
        return self.low + (self.high - self.low) * share

    def share(self, value: float) -> float:
        """Return the share of the range at a value."""
        if self.is_logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def values_at(free: Sequence[FreeKey], shares: Float) -> Float:
    """Return values (k,) of free keys at shares (k,) of their ranges."""
    return np.array([key.value(float(share)) for key, share in zip(free, shares, strict=True)])


Bounds = Mapping[str, tuple[float, float]] | Sequence[str]
"""Lower and upper bound by key, or texts such as ``material.E_MPa=0.05:5``."""


def free_keys(bounds: Bounds) -> tuple[FreeKey, ...]:
    """Return the free keys with these bounds."""
    if isinstance(bounds, Mapping):
        bounds = [f"{key}={low!r}:{high!r}" for key, (low, high) in bounds.items()]
    return tuple(map(FreeKey.of, bounds))


def check_distinct(keys: Sequence[str], option: str = "--free", advice: str = "") -> None:
    """Raise an error if an option gives a key twice."""
    for i, key in enumerate(keys):
        if key in keys[:i]:
            raise Finger3dError(f"{option} {key}: given twice{advice}")


def scene_with(given: TreeView, keys: Sequence[str], values: Sequence[float] | Float, path: Path | None) -> Scene:
    """Return the scene with new values of keys; the message about an invalid value names the option --free."""
    changes = [f"{key}={float(value)!r}" for key, value in zip(keys, values, strict=True)]
    changed = tree.override(dict(given), changes, "--free")
    return parse(changed, path=path, set_keys=dict.fromkeys(keys, "--free"))
