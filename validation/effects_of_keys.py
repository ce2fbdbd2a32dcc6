"""Are the effects of a scene's keys, as `finger3d sensitivity` tells them, those on a mesh with half the edges?

No source; the truth is the same difference of presses on half the edge lengths, in the same increments.  Scenes are
drawn as those of effects_by_need, with a new seed in each full run, and pressed on their default meshes: sections under
every object in small strain and at large deformation, and solids.  Every key is changed by its tolerance, or by 1 %, to
both sides.  Effects on forces, work and readings are compared with the larger of both; those on zones, which move with
the contact points from one to the next, and all signs with the error that is told.  Effects below a thousandth of the
number's natural scale are left out, but for their errors.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from finger3d._types import Tree
from finger3d.accuracy.changes import natural_scales
from finger3d.analyses.pressed_body import PressedBody
from finger3d.analyses.sensitivity import changes_of, differences, effects_on
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.step_halving import with_increments_of
from finger3d.progress import QUIET
from finger3d.scene import Scene, parse

from ._effect_scenes import scenes
from ._press import changed, in_edges
from ._rows import GOAL, Result, Row, at_least, columns, words, zero

SEED = 68
SECTIONS, LARGE_SECTIONS, SOLIDS = 12, 2, 2
CLOSE, SHARE, BARS, LEAST = 0.05, 0.9, 2.0, 1e-3
NAMES = (
    "normal_force_N", "friction_sum_N", "external_work_mJ", "contact_area_mm2", "stick_area_mm2", "gauge_a", "gauge_b",
)  # fmt: skip


class Judged(NamedTuple):
    """One effect: as it is told, its error, and the same on half the edges, over the number's natural scale."""

    scene: str
    number: str
    key: str
    side: str
    effect: float
    error: float
    true: float

    @property
    def is_zone(self) -> bool:
        """Whether the number is the size of a zone."""
        return self.number.endswith("_mm2")

    @property
    def counts(self) -> bool:
        """Whether the effect is large enough to count."""
        return max(abs(self.effect), abs(self.true)) >= LEAST


def drawn(sections: int, large: int, solids: int, seed: int) -> Iterator[tuple[str, Scene]]:
    """Names and scenes, those at large deformation after the other sections."""
    for number, (name, scene) in enumerate(scenes(sections + large, solids, seed)):
        is_large = sections <= number < sections + large
        tables: Tree = {key: value for key, value in scene.as_dict().items() if key not in ("effects", "mesh")}
        effects: Tree = {"auto": False, **({"large_deformation": {}} if is_large else {})}
        yield f"{name}{', large deformation' * is_large}", parse({**tables, "effects": effects})


def judged(name: str, scene: Scene) -> Iterator[Judged]:
    """Effects of all keys of a scene."""
    body = PressedBody(scene.model())
    steps = body.steps()
    steps[-1].check(name)
    problem = body.problem
    problem = changed(problem, legs=with_increments_of(problem.model.legs, len(steps)))
    changes = changes_of(scene, problem.model, {})
    found, _ = effects_on(problem, changes, QUIET)
    finer = build(in_edges(problem.model, 0.5))
    true = differences(finer, {key: one for key, one in changes.items() if key in found})
    scales = natural_scales(problem.model, steps[-1].target.depth_mm, true.numbers)
    for key, effects in found.items():
        for number in (n for n in NAMES if n in effects):
            scale, effect = scales.get(number) or abs(true.numbers[number]), effects[number]
            for side, told, error, there in (
                ("falling", effect.falling, effect.falling_error, true.changed[key, 0]),
                ("growing", effect.growing, effect.growing_error, true.changed[key, 1]),
            ):
                if isinstance(there, dict) and np.isfinite([told, error]).all():
                    yield Judged(name, number, key, side, told / scale, error / scale, there[number] / scale)


def run(quick: bool, seed: int | None = None) -> Result:
    """Quick: three sections, whose seed stays."""
    seed = seed or (SEED if quick else secrets.randbits(31))
    found, failed = list[Judged](), 0
    for name, scene in drawn(*((3, 0, 0) if quick else (SECTIONS, LARGE_SECTIONS, SOLIDS)), seed):
        try:
            found += judged(name, scene)
        except Finger3dError:
            failed += 1
    rows = tuple(_rows(found, failed, seed))
    return Result(rows, columns(" ".join(Judged._fields), found), lambda figure: _draw(figure, found))


def _rows(found: list[Judged], failed: int, seed: int) -> Iterator[Row]:
    yield zero(f"scenes of seed {seed} whose press fails", GOAL, float(failed), 0.0, "for the record", "statement")
    smooth = [one for one in found if not one.is_zone and one.counts]
    for number in (n for n in NAMES if not n.endswith("_mm2")):
        if some := [one for one in smooth if one.number == number]:
            yield _share(f"within {CLOSE:.0%} of the larger: {number}", [_is_close(one) for one in some])
    yield _share(f"within {CLOSE:.0%} of the larger: all but zones", [_is_close(one) for one in smooth])
    for number in dict.fromkeys(one.number for one in found):
        some = [one for one in found if one.number == number]
        within = [abs(one.effect - one.true) <= BARS * one.error + 1e-6 for one in some]
        yield _share(f"within {BARS:g} times the error: {number}", within)
    within = [abs(one.effect - one.true) <= BARS * one.error + 1e-6 for one in found]
    yield _share(f"within {BARS:g} times the error: all", within, "verification")
    wrong = [one for one in found if abs(one.effect) > one.error + 1e-6 and one.effect * one.true < 0.0 and one.counts]
    text = f"effects larger than their error with the wrong sign, of {len(found)}"
    yield zero(text, GOAL, float(len(wrong)), 0.0, "none", "statement")


def _is_close(one: Judged) -> bool:
    return abs(one.effect - one.true) <= CLOSE * max(abs(one.effect), abs(one.true))


def _share(what: str, which: list[bool], kind: Any = "statement") -> Row:
    text = f"share of effects {what}, {len(which)} cases"
    return at_least(text, GOAL, SHARE, float(np.mean(which)), "nine of ten", kind)


def _draw(figure: Any, found: list[Judged]) -> None:
    left, right = figure.subplots(1, 2)
    for axes, zones, title in ((left, False, "forces, work and readings"), (right, True, "areas of contact and stick")):
        some = [one for one in found if one.is_zone == zones and one.counts]
        for number in dict.fromkeys(one.number for one in some):
            here = [one for one in some if one.number == number]
            points = np.maximum(np.abs([(o.true, o.effect) for o in here]), LEAST / 100.0)
            axes.plot(*points.T, "o", ms=3, alpha=0.5, label=words(number))
        axes.plot([LEAST, 1.0], [LEAST, 1.0], "k-", lw=0.8, label="equal")
        axes.set(xscale="log", yscale="log", xlabel="|effect| on half the edges, of the natural scale",
                 ylabel="|effect|, of the natural scale", title=title)  # fmt: skip
