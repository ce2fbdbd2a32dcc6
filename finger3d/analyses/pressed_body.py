"""Bodies that are condensed once, and pressed with several coefficients of friction, paths and contact rules.

A body is condensed to the points that may come into contact.  Whether contact stayed within them is checked after the
solution; if not, the body is condensed again to all points of its free faces, and pressed again.

Scenes that differ only in friction, path, contact rule and gauges have the same compliance and form a family.  The body
of a family is meshed for the union of all paths, so that its mesh is graded for the widest contact among them.
"""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import dropwhile
from threading import Event
from typing import TYPE_CHECKING, TypeVar, cast

from finger3d._machine import made_with
from finger3d.contact.friction import FrictionLaw
from finger3d.contact.solve import RuleName
from finger3d.errors import FAILURES, Outcome
from finger3d.io import checksum
from finger3d.mechanics.discretise.build import build, changed
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem, free_surface
from finger3d.mechanics.discretise.resolution import check
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, table_row
from finger3d.mechanics.march.equilibrium import at_depth_reached
from finger3d.mechanics.march.grip import Grip
from finger3d.mechanics.march.step_halving import automatic, march_automatic
from finger3d.mechanics.march.variants import map_parallel
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid
from finger3d.mechanics.postprocess.penetration import SurfaceCheck, check_surface, displacements
from finger3d.mechanics.readings import Column, Gauge, Marker, in_space, strain_columns
from finger3d.objects.rigid import RigidObject
from finger3d.progress import QUIET, Progress
from finger3d.scene import Scene
from finger3d.scene.tables import LabelsTable
from finger3d.scene.tree import contents

if TYPE_CHECKING:
    from finger3d.mechanics.postprocess.labels import LabelGrid, Sample


Result = TypeVar("Result")
Key = TypeVar("Key")
Value = TypeVar("Value")

_MOST_KEPT = 4
"""Bodies, and presses, that a search or a fit keeps."""


@dataclass(frozen=True)
class PressAtMu:
    """A press with one mu.

    Attributes
    ----------
    mu : coefficient of friction
    frame : the last increment
    factorizations : factorisations of the body in the increments
    """

    mu: float
    frame: StepResult
    factorizations: int


def under(
    problem: Problem,
    friction: FrictionLaw | None = None,
    legs: tuple[Leg, ...] | None = None,
    rule: RuleName | None = None,
    obj: RigidObject | None = None,
) -> Problem:
    """Return a condensed body under another friction law, path, rule or rigid object; None leaves each as it is.

    Raises
    ------
    UnresolvedError
        If the object passes between the contact points on another path.
    """
    own = problem.model
    model = replace(own, friction=friction or own.friction, legs=legs or own.legs, rule=rule or own.rule)
    model = replace(model, object=obj or own.object)
    other = model.object != own.object
    found = changed(problem, model) if other else replace(problem, model=model)
    if other or _poses(model.legs) != _poses(own.legs):
        system = found.system
        check(found.model, system.surface, system.first_contact_mm, system.place_mm, problem.axes)
    return found


def _poses(legs: tuple[Leg, ...]) -> list[Leg]:
    """Return the legs without their increments and durations."""
    return [replace(leg, steps=1, duration_s=None) for leg in legs]


def press(problem: Problem, mu: float, workspace: Workspace | None = None, cancel: Event | None = None) -> PressAtMu:
    """Press the condensed body with this mu."""
    problem = under(problem, problem.model.friction.with_mu(mu))
    workspace = workspace or formulation_of(problem.model).workspace()
    before = workspace.factorizations
    steps, _ = march_automatic(problem, workspace, cancel)
    return PressAtMu(mu, steps[-1], workspace.factorizations - before)


def presses(problem: Problem, mus: Sequence[float]) -> Iterator[PressAtMu]:
    """Yield a press for each of ascending values of mu.

    At finite strain they come in another order than that of mu; see `march_in_groups`.
    """
    if problem.model.finite_strain and not automatic(problem.model):
        yield from _together(problem, mus)
        return

    def pressed(mu: float, workspace: Workspace, cancel: Event) -> PressAtMu:
        return press(problem, mu, workspace, cancel)

    yield from map_parallel(problem, pressed, mus)


def _together(problem: Problem, mus: Sequence[float]) -> Iterator[PressAtMu]:
    """Yield the presses with all values of mu, which share factors."""
    from finger3d.mechanics.march.groups import march_in_groups  # a press in small strain needs none of it

    workspace, counted = formulation_of(problem.model).workspace(), 0
    problems = [under(problem, problem.model.friction.with_mu(mu)) for mu in mus]
    for number, steps in march_in_groups(problems, workspace, Event()):
        new, counted = workspace.factorizations - counted, workspace.factorizations
        yield PressAtMu(mus[number], steps[-1], new)


class PressedBody:
    """A body that is condensed again where a press shows that it was condensed too narrowly.

    It is meshed again if a force is reached far deeper than was forecast, and condensed to all points of its free
    faces once contact leaves the candidate points.

    Parameters
    ----------
    model : what is meshed and condensed
    report : receives the messages about meshing and condensation
    problem : the condensed body of the model, if there is one already
    anywhere : whether objects may touch anywhere on the contact face, see `build`

    Attributes
    ----------
    problem : the condensed body
    seconds : time of meshing and condensation
    """

    def __init__(
        self, model: Model, report: Progress = QUIET, problem: Problem | None = None, anywhere: bool = False
    ) -> None:
        self._report, self.seconds, self._anywhere = report, 0.0, anywhere
        self.problem = problem or self._built(model)

    @classmethod
    def with_refined_borders(cls, model: Model, report: Progress = QUIET) -> PressedBody:
        """Return a body with shorter edges at the border of stick, which is found on coarser meshes, if asked."""
        if model.mesh.stick_refinement <= 1.0:
            return cls(model, report)
        from finger3d.accuracy.refine import with_refined_borders  # most bodies need none of it

        start = time.perf_counter()
        body = cls(model, report, with_refined_borders(model, report))
        body.seconds = time.perf_counter() - start
        return body

    def pressed(
        self, press: Callable[[Problem, Result | None], tuple[Result, Sequence[StepResult]]]
    ) -> tuple[Result, list[SurfaceCheck]]:
        """Press the body, and press it again as often as it has to be condensed again.

        Parameters
        ----------
        press : function of the condensed body, and of the result on a narrower one, if there was any
            Returns its result, and converged increments whose contact must be within the candidate points.

        Returns
        -------
        result : the last one
        checks : of the free surface after each of these increments
        """
        result, steps = press(self.problem, None)
        reached = max((step.target.depth_mm for step in steps), default=0.0)
        if legs := at_depth_reached(self.problem.model.legs, reached):
            self._report.say(f"the force is reached at {reached:.3g} mm, deeper than was forecast; meshing again")
            self.problem = self._built(replace(self.problem.model, legs=legs))
            result, steps = press(self.problem, result)
        checks = check_surface(self.problem, steps)
        if not all(check.within_candidates for check in (*checks, *self._checks_of_other(steps))):
            self.widen()
            result, steps = press(self.problem, result)
            checks = check_surface(self.problem, steps)
        return result, checks

    def _checks_of_other(self, steps: Sequence[StepResult]) -> list[SurfaceCheck]:
        """Return the checks of the second finger's free surface, if there is one."""
        others = [step.other for step in steps if step.other]
        return check_surface(Grip.of(self.problem).fingers[1], others) if others else []

    def steps(self, friction: FrictionLaw | None = None, rule: RuleName | None = None) -> list[StepResult]:
        """Return the increments of the model's path, under another friction law or contact rule if one is given.

        The last one has the penetration of the finger's surface.
        """

        def press(problem: Problem, _: object) -> tuple[list[StepResult], list[StepResult]]:
            steps = list(march_automatic(under(problem, friction, rule=rule))[0])
            return steps, [step for step in steps[-1:] if step.outcome.ok]

        steps, checks = self.pressed(press)
        return [*steps[:-1], *with_penetration(steps[-1:], checks)]

    def ends(self, mus: Sequence[float], legs: tuple[Leg, ...] | None = None) -> list[StepResult]:
        """Return the last increment with every mu, on a path other than the model's own if it is given.

        Those that converged have the penetration of the finger's surface.
        """

        def press(problem: Problem, _: object) -> tuple[list[StepResult], list[StepResult]]:
            by_mu = {one.mu: one.frame for one in presses(under(problem, legs=legs), mus)}
            found = [by_mu[mu] for mu in mus]
            return found, [end for end in found if end.outcome.ok]

        ends, checks = self.pressed(press)
        return with_penetration(ends, checks)

    def widen(self) -> None:
        """Condense the body to all points of its free faces."""
        self._report.say("contact reached beyond the candidate points; once more with all points of the free faces")
        self.problem = self._built(self.problem.model, math.inf)

    def _built(self, model: Model, margin: float = MARGIN) -> Problem:
        start = time.perf_counter()
        problem = build(model, self._report, margin, self._anywhere)
        self.seconds += time.perf_counter() - start
        return problem


def with_penetration(steps: Sequence[StepResult], checks: Sequence[SurfaceCheck]) -> list[StepResult]:
    """Return increments with the penetration of the surface, which was checked after those that converged."""
    left = iter(checks)
    return [replace(one, penetration_mm=next(left).penetration_mm) if one.outcome.ok else one for one in steps]


def kept(store: dict[Key, Value], key: Key, made: Callable[[], Value]) -> Value:
    """Return what is stored under a key; if nothing is, make and store it in place of the oldest of `_MOST_KEPT`."""
    if key not in store:
        found = made()
        while len(store) >= _MOST_KEPT:
            store.pop(next(iter(store)))
        store[key] = found
    return store[key]


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
        self._labels = labels
        self._prepare()
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
        self, variant: Variant, workspace: Workspace, cancel: Event
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
        grid = self._label_grid
        moved = list(displacements(problem, grid.chosen(steps) if grid else steps[-1:]))
        (check,) = check_surface(problem, steps[-1:], self._free, moved[-1:])
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
        sample = grid.sample(steps, moved) if grid else None
        return VariantResult(str(Outcome.CONVERGED), residual, numbers, in_space(readings), seconds, sample)

    def widen(self) -> None:
        super().widen()
        self._prepare()

    def _prepare(self) -> None:
        """Set what all variants on the present body have in common."""
        problem, self._label_grid = self.problem, cast("LabelGrid | None", None)
        self._free = free_surface(problem.model, problem.mesh, problem.body.thickness)
        if self._labels is not None:
            from finger3d.mechanics.postprocess.labels import LabelGrid  # other sweeps need none of it

            self._label_grid = LabelGrid(problem, self._labels.grid_mm, self._labels.increments == "last")


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
