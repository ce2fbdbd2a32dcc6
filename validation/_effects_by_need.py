"""Does ``effects.auto`` use the effects that a scene needs, and only those, and are the bars of its press right?

Scenes are drawn at random, sections and coarse swept solids under every object, each with the tables of all effects.
An effect is needed if a press with all effects changes a number by more than the tolerance, 2 % of its natural scale,
where that effect is left out, on the same mesh and in the same increments: forces, lengths and areas of contact and
stick, and readings (finger3d.accuracy.changes.natural_scales).  Lengths and areas count as far as their change exceeds
their resolution by the contact points in both presses.  A decision is right if the effect is used where it is needed,
and not used where it changes nothing by more than half the tolerance; in between nothing is missed by using it.  Scenes
that do not end count as wrong.

An elastic object and stiff gauges are left out by an object of 1e9 MPa and foils of 1e-9 MPa: gaps beside a rigid
object, and gauges without foils, are discretised in another way, which changes friction by 3 % in section 49 and a
gauge by 0.7 % in solid 5 whatever the stiffness.

The press that auto makes is also compared, in every third scene, with all effects on a finer mesh: the truth is to lie
within two total bars in nine of ten numbers, where a total bar is that of mesh and increments, and the farther end of
the interval of every effect that is left out.  Its time is compared with that without the judgement.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from threading import Event, Timer
from typing import Any

import numpy as np

import finger3d
from finger3d._types import Tree
from finger3d.accuracy.changes import changing_numbers, natural_scales, unresolved
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.analyses.result import PressResult
from finger3d.effects import LARGE_DEFORMATION
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.scene import Scene, parse

from ._effect_scenes import scenes
from ._press import in_edges
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

SEED = 20261128
SECTIONS, SOLIDS = 81, 19
FINER = {"solid": 0.75, "section": 0.7}
"""Edge lengths of the truth over those of the press."""
MOST_S = 60.0
"""Seconds of a press after which its scene is left out."""
IDLE = 0.5
"""Change over the tolerance up to which an effect is used in vain: beyond it, its error may reach the tolerance."""

COLUMNS = "scene effect used needed number true_change judged_number judged_change"
NEUTRAL: Mapping[str, Tree] = {
    "kinetic_friction": {"ratio": 1.0 - 1e-9},
    "elastic_object": {"E_MPa": 1e9},
    "embedded_gauge": {"E_MPa": 1e-9},
}
"""Settings by which effects are left out that come with a discretisation of their own."""
LABELS = {
    "large_deformation": "large deformation", "kinetic_friction": "kinetic friction", "viscosity": "viscosity",
    "elastic_object": "elastic object", "embedded_gauge": "stiff gauges",
}  # fmt: skip


@dataclass(frozen=True)
class Verdict:
    """What auto decided about one effect of one scene, and the truth.

    Attributes
    ----------
    used : by auto
    change, number : largest change of a number that leaving the effect out makes, relative, and its name
    sure : the same beyond the resolution of lengths and areas by the contact points
    judged_change, judged_number : what auto found
    """

    scene: str
    effect: str
    used: bool
    tolerance: float
    change: float
    number: str
    sure: float
    judged_change: float
    judged_number: str

    @property
    def needed(self) -> bool:
        """Whether the effect is needed."""
        return self.sure > self.tolerance

    @property
    def right(self) -> bool:
        """Whether the decision is right."""
        return self.change > IDLE * self.tolerance if self.used else not self.needed


@dataclass(frozen=True)
class Compared:
    """One scene: verdicts, errors over total bars, and times of the press with and without the judgement."""

    verdicts: tuple[Verdict, ...]
    shares: tuple[float, ...]
    seconds: float
    without_s: float

    @property
    def right(self) -> bool:
        """Whether the set of effects is right."""
        return all(verdict.right for verdict in self.verdicts)


@dataclass(frozen=True)
class Pressed:
    """Numbers at the end of a press, their natural scales, and the resolution of those of zones."""

    numbers: dict[str, float]
    scales: dict[str, float]
    zones: Mapping[str, float]

    @classmethod
    def of(cls, model: Model, with_free_strain: bool = False) -> Pressed:
        """Press a model; the free strain of stiff gauges takes a second press of the body without them.

        Raises
        ------
        Finger3dError
            If the press does not converge, or takes more than `MOST_S`.
        """
        problem, cancel = build(model), Event()
        problem = problem if with_free_strain else replace(problem, without_inclusions=None)
        timer = Timer(MOST_S, cancel.set)
        timer.start()
        try:
            *_, step = march(problem, cancel=cancel)
        except CancelledError:
            raise Finger3dError(f"the press takes more than {MOST_S:g} s") from None
        finally:
            timer.cancel()
        if not step.outcome.ok:
            raise Finger3dError(f"the press did not converge ({step.outcome})")
        numbers = changing_numbers(problem, step)
        scales = natural_scales(model, step.target.depth_mm, numbers)
        return cls(numbers, scales, unresolved(problem, step, scales))


def compare(name: str, scene: Scene, with_truth: bool) -> Compared:
    """Let auto press a scene, and press it with all effects and without each; with the truth also on a finer mesh.

    Raises
    ------
    Finger3dError
        If a press with all effects, or without one of them, does not converge.
    """
    names = (LARGE_DEFORMATION, *scene.effects)
    everything = scene.with_effects(names).model()
    every = Pressed.of(everything)
    without = {effect: Pressed.of(_without(scene, names, effect)) for effect in names}
    start = time.perf_counter()
    auto = finger3d.press(scene)
    seconds = time.perf_counter() - start
    told = auto.summary()["effects_auto"]
    verdicts = []
    for effect in names:
        change, number, sure = _largest_change(without[effect], every)
        found = told["judged"].get(effect, {"change": 0.0, "number": ""})
        verdicts.append(
            Verdict(name, effect, effect in told["used"], scene.tolerance_of_effects, change, number, sure,
                    found["change"], found["number"])
        )  # fmt: skip
    found = Compared(tuple(verdicts), (), seconds, seconds - told["seconds"])
    if not with_truth:
        return found
    finer = FINER["solid" if scene.domain == "solid" else "section"]
    truth = Pressed.of(in_edges(everything, finer), with_free_strain=True)
    return replace(found, shares=tuple(_errors_over_bars(auto, truth.numbers)))


def _without(scene: Scene, names: tuple[str, ...], effect: str) -> Model:
    """Return the model with all effects but one, in the same increments, gaps and gauges.

    Increments are as they are given under kinetic friction only, gaps are read along the common normals of both bodies
    beside an elastic object only, and gauges along the bars of their foils only.  So these effects are left out by
    equal coefficients, a stiff object and soft foils.
    """
    if effect not in NEUTRAL:
        return scene.with_effects(name for name in names if name != effect).model()
    given = scene.given["effects"]
    effects = {**given, LARGE_DEFORMATION: {}, effect: {**given[effect], **NEUTRAL[effect]}}
    return parse({**scene.given, "effects": {name: effects[name] for name in names}}).model()


def _largest_change(without: Pressed, every: Pressed) -> tuple[float, str, float]:
    """Return the largest relative change of a number by an effect, its name, and the largest beyond the resolution."""
    changes, sure = dict[str, float](), [0.0]
    for name in without.scales.keys() & every.scales.keys():
        change = abs(every.numbers[name] - without.numbers[name])
        known = max(change - every.zones.get(name, 0.0) - without.zones.get(name, 0.0), 0.0)
        scale = max(without.scales[name], every.scales[name]) or 1.0
        changes[name] = change / scale
        sure.append(known / scale)
    number = max(changes, key=lambda key: changes[key])
    return changes[number], number, max(sure)


def _errors_over_bars(auto: PressResult, truth: Mapping[str, float]) -> Iterable[float]:
    """Yield the error of every number of the press of auto over its total bar."""
    summary = auto.summary()
    bars, last = ErrorBars.of_summary(summary), _flat(summary["steps"][-1])
    for name, bar in bars.totals().items():
        if name not in truth or name not in last:
            continue
        model = sum(
            max(abs(changes[name]["low"]), abs(changes[name]["high"]))
            for changes in summary["model_error"].values()
            if name in changes
        )
        error = abs(last[name] - truth[name])
        if error > 1e-9 * abs(last["normal_force_N"]) or bar + model > 0.0:
            yield error / max(bar + model, 1e-12)


def _flat(step: Tree) -> dict[str, float]:
    """Return the numbers of an increment of summary.json by the names of their error bars."""
    found = {name: value for name, value in step.items() if isinstance(value, float)}
    found |= {f"gauge_{name}": value for name, value in step["gauges"].items()}
    for name, moved in step["markers"].items():
        found |= {f"marker_{name}_{axis}_mm": value for axis, value in zip("xyz", moved, strict=False)}
    return found


def run(quick: bool) -> Result:
    """All scenes; quick: two sections."""
    ended = list(_ended(2, 0, 3.0) if quick else _ended(SECTIONS, SOLIDS))
    found = [one for one in ended if one]
    failed = len(ended) - len(found)
    verdicts = [verdict for one in found for verdict in one.verdicts]
    lines = [
        (v.scene, v.effect, v.used, v.needed, v.number, v.change, v.judged_number, v.judged_change) for v in verdicts
    ]
    return Result(tuple(_rows(found, failed, quick)), columns(COLUMNS, lines), lambda figure: _draw(figure, verdicts))


def _ended(sections: int, solids: int, *longer: float) -> Iterator[Compared | None]:
    """Compare scenes; None where a press fails."""
    for number, (name, scene) in enumerate(scenes(sections, solids, SEED, *longer)):
        try:
            yield compare(name, scene, number % 3 == 0)
        except Finger3dError:
            yield None


def _rows(found: list[Compared], failed: int, quick: bool) -> Iterable[Row]:
    verdicts = [verdict for one in found for verdict in one.verdicts]
    shares = [share for one in found for share in one.shares]
    ratios = [one.seconds / one.without_s for one in found if one.right]
    right = sum(one.right for one in found) / (len(found) + failed)
    row = judged("share-of-scenes", right, scenes=len(found) + failed, failed=failed, effects=len(verdicts))
    yield replace(row, kind="verification" if quick else "statement")
    yield judged("share-of-numbers", np.mean(np.array(shares) <= 2.0), count=len(shares))
    yield judged("time-of-a-press", np.median(ratios), count=len(ratios))
    for effect, label in LABELS.items():
        here = [v for v in verdicts if v.effect == effect]
        missed, idle = (sum(not v.right and v.used == used for v in here) for used in (False, True))
        words = {"needed": sum(v.needed for v in here), "count": len(here), "missed": missed, "idle": idle}
        yield judged("share-decided-rightly", np.mean([v.right for v in here]), label=label, **words)


def _draw(figure: Any, verdicts: list[Verdict]) -> None:
    """Draw the judged over the true change of every effect; decisions that are wrong are crosses."""
    figure.set_size_inches(10.0, 7.2)
    panels = figure.subplots(2, 3, sharey=True).ravel()
    low, high = 1e-3, 100.0
    for axes, (effect, label) in zip(panels, LABELS.items(), strict=False):
        here = [v for v in verdicts if v.effect == effect]
        for used, right, colour, marker, text in (
            (True, True, "#2c5d8f", "o", "used"),
            (False, True, "#9a9a9a", "o", "not used"),
            (True, False, "#c0392b", "x", "used in vain"),
            (False, False, "#e67e22", "x", "missed"),
        ):
            some = [v for v in here if (v.used, v.right) == (used, right)]
            x, y = (100.0 * np.abs([getattr(v, key) for v in some]) for key in ("change", "judged_change"))
            axes.loglog(np.clip(x, low, high), np.clip(y, low, high), marker, ms=4, color=colour, label=text)
        tolerance = 100.0 * verdicts[0].tolerance
        axes.loglog([low, high], [low, high], color="#222222", lw=0.8)
        for line in (axes.axhline, axes.axvline):
            line(tolerance, color="#222222", lw=0.8, ls=":")
        axes.set(title=label, xlim=(0.7 * low, 1.4 * high), ylim=(0.7 * low, 1.4 * high))
    figure.supxlabel("true change (%); on the edges: 0.001 % or less", fontsize=10)
    figure.supylabel("judged change (%)", fontsize=10)
    panels[-1].set_axis_off()
    panels[-1].legend(*panels[0].get_legend_handles_labels(), loc="center", frameon=False)
