"""Which scenes share a body, and one condensation for all of them.

Friction, path, contact rule and gauges do not change a body's compliance: scenes that differ in nothing else are a
family.  Its body is meshed for the union of all paths, so scenes of other depths or slides are pressed on a mesh graded
for the widest contact among them, and not each on its own.
"""

from __future__ import annotations

import hashlib
import json
import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import dropwhile, takewhile
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from finger3d.contact.friction import FrictionLaw
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.scene import Scene

if TYPE_CHECKING:
    from finger3d.mechanics.formulation import Workspace
    from finger3d.mechanics.solve import Problem

_FREE = ("title", "friction", "press", "contact", "gauge")
_SIZES = ("size_mm", "base_size_mm")
_WAIT_S = 1.0  # that finished presses may wait to be proved together

TROUBLE = (Finger3dError, ArithmeticError, ValueError, RuntimeError, MemoryError)
"""What one press, or the build of its body, may fail of without taking others along."""


@dataclass(frozen=True)
class Variant:
    """What may differ between presses of one body."""

    friction: FrictionLaw
    legs: tuple[Leg, ...]
    rule: Any
    gauges: tuple[Gauge, ...]

    @classmethod
    def of(cls, model: Model) -> Variant:
        """The variant that a model is of its body."""
        return cls(model.friction, model.legs, model.rule, model.gauges)


@dataclass(frozen=True)
class VariantResult:
    """The end of a press.

    Attributes
    ----------
    outcome : the text of summary.json; where a step failed, which one
    residual : the largest of all steps
    numbers : the contract's numbers of the last step, without gauges; empty unless converged
    gauges : name -> strain; likewise
    seconds : of this press; 0 if another variant, different in its gauges only, has paid for it
    """

    outcome: str
    residual: float
    numbers: dict[str, float]
    gauges: dict[str, float]
    seconds: float


def body_key(scene: Scene) -> str:
    """Hash of all that shapes the condensation: equal for scenes that share a body."""
    tree = scene.as_dict()
    effects = {k: v for k, v in tree["effects"].items() if getattr(scene.effects[k], "slot", "") != "friction"}
    kept = {k: v for k, v in tree.items() if k not in _FREE} | {"effects": effects}
    if "embedded_gauge" in effects:
        kept["gauge"] = tree["gauge"]
    given = scene.given.get("mesh", {})
    # sizes that were chosen, not given, may follow the depth: the finest of a family is taken
    kept["mesh"] = {k: v for k, v in tree["mesh"].items() if k not in _SIZES or k in given}
    files = [tree["finger"]["geometry"], tree["object"].get("path")]
    kept["files"] = [_digest(Path(name)) for name in files if name and Path(name).is_file()]
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()[:16]


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def families(scenes: Sequence[Scene]) -> dict[str, list[int]]:
    """Numbers of the scenes that share a body, by the key of the body, in the order in which they come."""
    found: dict[str, list[int]] = {}
    for number, scene in enumerate(scenes):
        found.setdefault(body_key(scene), []).append(number)
    return found


def finest(models: Sequence[Model]) -> MeshOptions:
    """The mesh options with the smallest sizes of the models."""
    sizes, bases = [m.mesh.size_mm for m in models], [m.mesh.base_size_mm for m in models]
    return replace(models[0].mesh, size_mm=min(sizes), base_size_mm=min(bases))


class SharedBody:
    """A body built once for some variants, and pressed as each of them.

    Parameters
    ----------
    model : any of the family, with the mesh that all share
    variants : all that it will be pressed as
    say : told about meshing and condensation
    """

    def __init__(
        self, model: Model, variants: Sequence[Variant], say: Callable[[str], None] = lambda text: None
    ) -> None:
        # the solver and SciPy are for those who press; who only sorts scenes by body does without
        from finger3d.mechanics.solve import build

        start = time.perf_counter()
        self._say = say
        gauges = model.gauges
        if model.inclusions is None:
            # every place once, under names that cannot clash
            places = dict.fromkeys(replace(g, name="") for v in variants for g in v.gauges)
            gauges = tuple(replace(place, name=str(i)) for i, place in enumerate(places))
        self._names = {replace(g, name=""): g.name for g in gauges}
        self._free = model.inclusions is not None
        self.problem = build(replace(model, legs=shared_legs(variants), gauges=gauges), say)
        self.seconds = time.perf_counter() - start
        self._done: dict[Any, VariantResult | Exception] = {}

    def problem_of(self, variant: Variant) -> Problem:
        """The condensed body under the friction, path and rule of a variant, with all gauges of all variants."""
        own = replace(self.problem.model, friction=variant.friction, legs=variant.legs, rule=variant.rule)
        return replace(self.problem, model=own)

    def frames(self, variants: Sequence[Variant]) -> list[tuple[StepResult, ...]]:
        """Frames of each variant, all of `problem` as it then is.

        If contact reached beyond the candidate points, that is the body condensed to all of its contact face.
        """
        found: list[_Run | None] = [None] * len(variants)
        while left := [i for i, run in enumerate(found) if run is None or run.problem is not self.problem]:
            for i, run in zip(left, self._runs([variants[i] for i in left], None), strict=True):
                found[i] = run
        return [run.known() for run in found if run]

    def press(self, variant: Variant) -> VariantResult:
        """The last step's numbers of a variant."""
        found = next(self.presses([variant]))
        if isinstance(found, Exception):
            raise found
        return found

    def presses(self, variants: Sequence[Variant], most: int | None = None) -> Iterator[VariantResult | Exception]:
        """The last step's numbers of each variant, or what it failed of, in that order; each at most some way behind.

        Variants that differ in their gauges only share a press.  As many run at once as pays, and no more than `most`.
        """
        new = {_press_of(v): v for v in variants if _press_of(v) not in self._done}
        runs, keys, unpaid = self._runs(list(new.values()), most), iter(new), set(new)
        for variant in variants:
            key = _press_of(variant)
            while key not in self._done:
                self._done[next(keys)] = next(runs).pressed()
            pressed = self._done[key]
            if isinstance(pressed, VariantResult):
                gauges = self.strains(variant, pressed.gauges) if pressed.gauges else {}
                pressed = replace(pressed, gauges=gauges, seconds=pressed.seconds if key in unpaid else 0.0)
            unpaid.discard(key)
            yield pressed

    def _runs(self, variants: Sequence[Variant], most: int | None) -> Iterator[_Run]:
        """Each variant pressed, and proved to touch no point beyond the candidates; several are proved at once.

        What is finished waits for that a second, or for as long as the press beside it takes.
        """
        from finger3d.mechanics.solve import candidates_cover_face, map_parallel

        left = deque(variants)
        while left:
            waiting: list[_Run] = []
            since, reached = time.perf_counter(), False
            wait = 0.0 if candidates_cover_face(self.problem) else _WAIT_S
            with closing(map_parallel(self.problem, self._run, tuple(left), most)) as runs:
                for run in runs:
                    waiting.append(run)
                    if len(waiting) < len(left) and time.perf_counter() - since < wait:
                        continue
                    proved = _proved(self.problem, waiting)
                    for done in proved:
                        left.popleft()
                        yield done
                    if reached := len(proved) < len(waiting):
                        break
                    waiting, since = [], time.perf_counter()
            if reached:
                try:
                    self._widen()
                except TROUBLE as error:
                    left.popleft()
                    yield replace(waiting[len(proved)], frames=error.with_traceback(None))

    def _run(self, variant: Variant, before: Sequence[_Run], workspace: Workspace, cancel: Event) -> _Run:
        from finger3d.mechanics.resolution import check
        from finger3d.mechanics.step_halving import marched

        start = time.perf_counter()
        frames: tuple[StepResult, ...] | Exception
        try:
            problem = self.problem_of(variant)
            if variant.legs != self.problem.model.legs:  # the body was built, and its mesh checked, for another path
                check(problem.model, problem.surface, problem.first_contact_mm, problem.place_mm, problem.axes)
            frames = marched(problem, workspace, cancel)[0]
        except TROUBLE as error:
            frames = error.with_traceback(None)  # which would keep all arrays on the way
        return _Run(self.problem, frames, time.perf_counter() - start)

    def _widen(self) -> None:
        from finger3d.mechanics.solve import build

        start = time.perf_counter()
        self._say("contact reached beyond the candidate points; condensing all of the contact face")
        self.problem = build(self.problem.model, self._say, math.inf)
        self.seconds += time.perf_counter() - start

    def strains(self, variant: Variant, gauges: dict[str, float]) -> dict[str, float]:
        """Strain of a variant's gauges by their names in it, from that of all gauges of all variants."""
        if self._free:
            return gauges
        return {g.name: gauges[self._names[replace(g, name="")]] for g in variant.gauges}


@dataclass(frozen=True)
class _Run:
    """Frames of a press of a problem, or what it failed of."""

    problem: Problem
    frames: tuple[StepResult, ...] | Exception
    seconds: float

    @property
    def end(self) -> StepResult | None:
        """The last frame, if all converged."""
        return None if isinstance(self.frames, Exception) or not self.frames[-1].outcome.ok else self.frames[-1]

    def known(self) -> tuple[StepResult, ...]:
        """The frames; raises what it failed of."""
        if isinstance(self.frames, Exception):
            raise self.frames
        return self.frames

    def pressed(self) -> VariantResult | Exception:
        """What is told of it."""
        if isinstance(self.frames, Exception):
            return self.frames
        residual = max(f.residual for f in self.frames)
        for number, frame in enumerate(self.frames, start=1):
            if not frame.outcome.ok:
                at = f"step {number} (depth {frame.target.depth_mm:.4g} mm)"
                return VariantResult(f"{at}: {frame.outcome}", residual, {}, {}, self.seconds)
        numbers = measure(self.problem.points, self.frames[-1])
        gauges = numbers.pop("gauges")
        for key in ("iterations", "residual", "method", "outcome"):
            numbers.pop(key)
        return VariantResult(str(Outcome.CONVERGED), residual, numbers, gauges, self.seconds)


def _proved(problem: Problem, runs: Sequence[_Run]) -> list[_Run]:
    """The runs before the first that went beyond the candidate points; each pays its part of the proof."""
    from finger3d.mechanics.solve import contact_within_candidates

    start = time.perf_counter()
    try:
        good = iter(contact_within_candidates(problem, [run.end for run in runs if run.end]))
    except TROUBLE as error:
        return [replace(run, frames=error.with_traceback(None)) if run.end else run for run in runs]
    proved = list(takewhile(lambda run: run.end is None or next(good), runs))
    share = (time.perf_counter() - start) / len(runs)
    return [replace(run, seconds=run.seconds + share) for run in proved]


def _press_of(variant: Variant) -> tuple[Any, ...]:
    """What of a variant makes a press: all but its gauges."""
    return variant.friction, variant.legs, variant.rule


def shared_legs(variants: Sequence[Variant]) -> tuple[Leg, ...]:
    """A path that goes wherever one of the variants goes, and nowhere else.

    One path is left as it is; among paths without slides it is the deepest; else all in turn, each traced back to
    first touch before the next.
    """
    paths = list(dict.fromkeys(v.legs for v in variants))
    if not any(leg.slide_x_mm or leg.slide_z_mm for legs in paths for leg in legs):
        return max(paths, key=lambda legs: max(leg.depth_mm for leg in legs))
    whole: list[Leg] = []
    for number, legs in enumerate(paths):
        whole += legs
        if number + 1 < len(paths):
            back = [*reversed(legs[:-1]), Leg(0.0)]
            here = legs[-1]
            whole += dropwhile(lambda leg, here=here: _end(leg) == _end(here), back)  # type: ignore[misc]
    return tuple(whole)


def _end(leg: Leg) -> tuple[float, float, float]:
    return leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm
