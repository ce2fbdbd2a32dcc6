"""Families of scenes that share a condensed body.

Scenes that differ only in friction, path, contact rule and gauges have the same compliance and form a family.  The body
of a family is meshed for the union of all paths, so that its mesh is graded for the widest contact among them.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import dropwhile
from threading import Event
from typing import TYPE_CHECKING, cast

from finger3d._machine import made_with
from finger3d.analyses.pressed_body import PressedBody, under
from finger3d.contact.friction import FrictionLaw
from finger3d.contact.rules import RuleName
from finger3d.errors import FAILURES, Outcome
from finger3d.io import checksum
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult, table_row
from finger3d.mechanics.march.step_halving import march_automatic
from finger3d.mechanics.march.variants import map_parallel
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.mechanics.readings import Column, Gauge, Marker, in_space, strain_columns
from finger3d.objects.rigid import RigidObject
from finger3d.progress import QUIET, Progress
from finger3d.scene import Scene
from finger3d.scene.files import contents
from finger3d.scene.tables import LabelsTable

if TYPE_CHECKING:
    from finger3d.mechanics.postprocess.labels import LabelGrid, Sample

_FREE = ("title", "friction", "press", "contact", "gauge")
"""Tables of the scene that do not change the compliance."""

_SIZES = ("size_mm", "base_size_mm")


@dataclass(frozen=True)
class Variant:
    """Settings in which presses of one body may differ."""

    friction: FrictionLaw
    legs: tuple[Leg, ...]
    rule: RuleName
    gauges: tuple[Gauge, ...]
    object: RigidObject

    @classmethod
    def of(cls, model: Model) -> Variant:
        """Return the variant of a model."""
        return cls(model.friction, model.legs, model.rule, model.gauges, model.object)

    def without_gauges(self) -> Variant:
        """Return the variant without gauges; variants with an equal one share a press."""
        return replace(self, gauges=())


@dataclass(frozen=True)
class VariantResult:
    """Result of the last step of a press.

    Attributes
    ----------
    outcome : as in summary.json, with the number of the step that failed
    residual : the largest of all steps
    numbers : quantities of the last step by their names in summary.json, without readings; empty unless converged
    readings : of the last step, those of a grid of markers included; empty unless converged
    seconds : time of this press; 0 if it is that of another variant, with other gauges
    sample : labels for learning, if the scene asks for them
    """

    outcome: str
    residual: float
    numbers: dict[str, float]
    readings: dict[Column, float]
    seconds: float
    sample: Sample | None = None


def body_key(scene: Scene) -> str:
    """Return a hash of everything that changes the condensed body; scenes of one family have the same."""
    tree = scene.as_dict()
    effects = {k: v for k, v in tree["effects"].items() if k in scene.effects and scene.effects[k].slot != "friction"}
    free = _FREE if scene.tables.labels is None else (*_FREE, "object")
    kept = {k: v for k, v in tree.items() if k not in free} | {"effects": effects}
    if "embedded_gauge" in effects:
        kept["gauge"] = tree["gauge"]
    given = scene.given.get("mesh", {})
    # Default sizes depend on the depth; a family takes the smallest.
    kept["mesh"] = {k: v for k, v in tree["mesh"].items() if k not in _SIZES or k in given}
    return checksum({**kept, "files": contents(tree), "made_with": made_with()})


def finest(models: Sequence[Model]) -> MeshOptions:
    """Return the mesh options with the smallest sizes of the models."""
    sizes, bases = [m.mesh.size_mm for m in models], [m.mesh.base_size_mm for m in models]
    return replace(models[0].mesh, size_mm=min(sizes), base_size_mm=min(bases))


class SharedBody(PressedBody):
    """A condensed body that is pressed as several variants.

    Parameters
    ----------
    model : any model of the family, with the mesh that all share
    variants : all variants that will be pressed
    report : receives the messages
    grid : markers of a grid, whose displacements are among the numbers
    labels : what is asked for of every sample; the variants may then have different rigid objects, which may touch the
        contact face anywhere

    Attributes
    ----------
    problem : the condensed body, with the gauges of all variants
    seconds : time of meshing and condensation
    """

    def __init__(
        self,
        model: Model,
        variants: Sequence[Variant],
        report: Progress = QUIET,
        grid: Sequence[Marker] = (),
        labels: LabelsTable | None = None,
    ) -> None:
        gauges = model.gauges
        if model.inclusions is None:
            # Each place has one gauge, whose name is a number; variants may use one name for different places.
            places = dict.fromkeys(replace(g, name="") for v in variants for g in v.gauges)
            gauges = tuple(replace(place, name=str(i)) for i, place in enumerate(places))
        self._names = {replace(g, name=""): g.name for g in gauges}
        self._gauges_are_inclusions, self._grid = model.inclusions is not None, grid
        shared = {"symmetry": ()} if labels else {"legs": shared_legs(variants)}
        super().__init__(replace(model, gauges=gauges, **shared), report, anywhere=labels is not None)
        self._labels, self._made = labels, cast("LabelGrid | None", None)
        self._results: dict[Variant, VariantResult | Exception] = {}

    def presses(self, variants: Sequence[Variant], most: int | None = None) -> Iterator[VariantResult | Exception]:
        """Yield the result of each variant in order, or the reason why its press failed.

        Variants that differ only in their gauges share a press.

        Parameters
        ----------
        variants : sequence
        most : int, optional
            Largest number of presses at once.
        """
        counts = Counter(v.without_gauges() for v in variants)
        new = [v for v in counts if v not in self._results]
        runs, unpaid = self._runs(new, most), set(new)
        for variant in variants:
            press = variant.without_gauges()
            while press not in self._results:
                done, found = next(runs)
                self._results[done] = found
            result = self._results[press]
            if isinstance(result, VariantResult):
                seconds = result.seconds if press in unpaid else 0.0
                readings = self.readings_of(variant, result.readings) if result.readings else {}
                result = replace(result, readings=readings, seconds=seconds)
            unpaid.discard(press)
            counts[press] -= 1
            if self._labels and not counts[press]:
                del self._results[press]  # whose sample has many numbers
            yield result

    def readings_of(self, variant: Variant, readings: dict[Column, float]) -> dict[Column, float]:
        """Return the readings of a variant from those of all: of the gauges only its own."""
        if self._gauges_are_inclusions:
            return readings
        names = {g.name: self._names[replace(g, name="")] for g in variant.gauges}
        strains = {strain_columns(own)[0]: readings[strain_columns(name)[0]] for own, name in names.items()}
        return strains | {column: value for column, value in readings.items() if column.kind != "gauge"}

    def _runs(
        self, variants: Sequence[Variant], most: int | None
    ) -> Iterator[tuple[Variant, VariantResult | Exception]]:
        """Press each variant; condense the whole contact face once contact goes beyond the candidate points."""
        left = deque(variants)
        while left:
            with closing(map_parallel(self.problem, self._march, tuple(left), most)) as runs:
                for problem, steps, seconds in runs:
                    result: VariantResult | Exception | None
                    try:
                        if (result := self._result(problem, steps, seconds)) is None:
                            self.widen()
                            break  # and press the variants that are left on the new body
                    except FAILURES as error:
                        result = error.with_traceback(None)  # a traceback would keep all arrays of its frames
                    yield left.popleft(), result

    def _march(
        self, variant: Variant, before: object, workspace: Workspace, cancel: Event
    ) -> tuple[Problem, tuple[StepResult, ...] | Exception, float]:
        """Return the problem of a variant, its increments, or why they failed, and the seconds that they took."""
        start, problem = time.perf_counter(), self.problem
        steps: tuple[StepResult, ...] | Exception
        try:
            problem = under(problem, variant.friction, variant.legs, variant.rule, variant.object)
            steps = march_automatic(problem, workspace, cancel)[0]
        except FAILURES as error:
            steps = error.with_traceback(None)
        return problem, steps, time.perf_counter() - start

    def _result(
        self, problem: Problem, steps: tuple[StepResult, ...] | Exception, seconds: float
    ) -> VariantResult | None:
        """Return the quantities of the last step; None if contact reached beyond the candidate points.

        The check of the surface counts as part of the press.
        """
        if isinstance(steps, Exception):
            raise steps
        start, residual = time.perf_counter(), max(step.residual for step in steps)
        for number, step in enumerate(steps, start=1):
            if not step.outcome.ok:
                at = f"increment {number} (depth {step.target.depth_mm:.4g} mm)"
                return VariantResult(f"{at}: {step.outcome}", residual, {}, {}, seconds)
        (check,) = check_surface(problem, steps[-1:])
        if not check.within_candidates:
            return None
        seconds += time.perf_counter() - start
        last = replace(steps[-1], penetration_mm=check.penetration_mm)
        numbers = table_row(self.problem.points, replace(last, readings={}))
        for key in ("iterations", "residual", "method", "outcome"):
            numbers.pop(key)
        readings = last.readings
        if self._grid:
            readings = readings | MarkerGrid.at(self.problem, self._grid).readings(self.problem, last)
        sample = grid.sample(problem, steps) if (grid := self._label_grid()) else None
        return VariantResult(str(Outcome.CONVERGED), residual, numbers, in_space(readings), seconds, sample)

    def _label_grid(self) -> LabelGrid | None:
        """Return the grid of the labels on the present body, if the scene asks for any."""
        if self._labels is None:
            return None
        from finger3d.mechanics.postprocess.labels import LabelGrid  # other sweeps need none of it

        if self._made is None or self._made.problem is not self.problem:
            self._made = LabelGrid(self.problem, self._labels.grid_mm, self._labels.increments == "last")
        return self._made


def shared_legs(variants: Sequence[Variant]) -> tuple[Leg, ...]:
    """Return a path that is the union of the paths of the variants.

    Among paths without slides and turns it is the deepest. Otherwise all paths follow one another, each traced back to
    first contact before the next.
    """
    paths = list(dict.fromkeys(v.legs for v in variants))
    if not any(leg.moves_sideways for legs in paths for leg in legs):
        return max(paths, key=lambda legs: max(leg.depth_mm for leg in legs))
    union: list[Leg] = []
    for number, legs in enumerate(paths):
        union += legs
        if number + 1 < len(paths):
            back = [*reversed(legs[:-1]), Leg(0.0)]
            here = legs[-1]
            union += dropwhile(lambda leg, here=here: _end(leg) == _end(here), back)  # type: ignore[misc]
    return tuple(union)


def _end(leg: Leg) -> tuple[float, ...]:
    return leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm, leg.turn_x, leg.turn_y, leg.turn_z
