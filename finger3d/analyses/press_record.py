"""Record of one press: its increments, warnings, errors and cost, and the summary made from them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from finger3d._machine import peak_memory_MB, versions
from finger3d._types import Tree
from finger3d.contact.friction import OPEN
from finger3d.errors import Outcome
from finger3d.geometry.imported import extent
from finger3d.mechanics.discretise.resolution import size_advice
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import History, StepResult, measure, slip_events
from finger3d.mechanics.march.grip import FINGERS, Grip
from finger3d.objects import ObjectPose

if TYPE_CHECKING:
    from finger3d.accuracy.changes import ChangeEstimate
    from finger3d.accuracy.estimate import ErrorEstimate
    from finger3d.accuracy.refine import Refinement
    from finger3d.analyses.effects_by_need import Need
    from finger3d.mechanics.discretise.problem import Problem
    from finger3d.mechanics.formulation import Workspace
    from finger3d.mechanics.march.step_halving import StepEstimate
    from finger3d.mechanics.postprocess.marker_grid import MarkerGrid
    from finger3d.mechanics.postprocess.penetration import SurfaceCheck
    from finger3d.scene import Scene

_RESOLVED_POINTS = {2: 6, 3: 100}
"""Fewest contact points of a resolved contact zone, by dimension: six on a line, ten by ten on a surface."""

_SPARE = 1.25
"""Contact points that the advised edge length aims at, over the fewest: meshes of one edge length differ in them."""

_POINTS_ACROSS = 4
"""Fewest points along the shorter side of a contact zone: under a narrower object that slides, forces jump."""


@dataclass
class PressRecord:
    """Data of a press while it runs.

    Attributes
    ----------
    scene : the scene as it is run
    problem : the discretised problem
    started : `time.perf_counter()` at the start of the job, s
    refinement : the mesh refinement that chose the mesh, if the scene asks for an error instead of sizes
    factorizations_before : factorisations of an earlier attempt with too few candidate points
    steps : the increments so far
    surface_checks : the finger's free surface after each converged increment, once all are solved
    step_estimate : how automatic increments were chosen
    error_estimate : errors by mesh and increments
    marker_errors : of the displacements of markers, those of the grid among them, by the keys of their columns, mm
    largest_strain : principal strain at the end, without singular corners
    need : which effects are on because the scene calls for them, if it leaves that open
    model_error : what the effects that are off would change, by name
    least_grip_N : smallest grip that holds, if it was asked for
    warnings, advice : lines for the user
    seconds : time by stage, s
    workspace : factors that increments leave for the next, those of the error estimate not among them
    """

    scene: Scene
    problem: Problem
    started: float
    refinement: Refinement | None = None
    factorizations_before: int = 0
    steps: list[StepResult] = field(default_factory=list)
    surface_checks: list[SurfaceCheck] = field(default_factory=list)
    step_estimate: StepEstimate | None = None
    error_estimate: ErrorEstimate | None = None
    marker_errors: Mapping[str, float] = field(default_factory=dict)
    largest_strain: float = 0.0
    need: Need | None = None
    model_error: Mapping[str, ChangeEstimate] = field(default_factory=dict)
    least_grip_N: float | None = None
    warnings: list[str] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    workspace: Workspace = field(init=False)
    _entries: dict[int, tuple[StepResult, Tree]] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        from finger3d.mechanics.discretise import resolution

        self.workspace = formulation_of(self.problem.model).workspace()
        self.coupling = self.problem.coupling()
        self.seconds = {"cad": 0.0, "mesh": 0.0, **self.problem.seconds, "contact": 0.0, "output": 0.0}
        self.warnings += [*self.problem.model.warnings, *_coupling_warning(self.coupling)]
        self.warnings += resolution.warnings(self.problem)
        if self.refinement and self.refinement.warning:
            self.warnings.append(self.refinement.warning)

    @property
    def history(self) -> History:
        """The increments with the contact points they belong to."""
        return History(self.problem.points, tuple(self.steps))

    @property
    def marker_grid(self) -> MarkerGrid | None:
        """The grid of markers, if the scene has one."""
        from finger3d.mechanics.postprocess.marker_grid import MarkerGrid

        table = self.scene.tables.marker_grid
        return MarkerGrid.of(self.problem, table.spacing_mm) if table else None

    @property
    def converged_steps(self) -> list[StepResult]:
        """Increments that converged; all but the last of a press that failed."""
        return [step for step in self.steps if step.outcome.ok]

    @cached_property
    def grip(self) -> Grip | None:
        """Both fingers, where there are two."""
        return None if self.problem.model.centre_of_mass_mm is None else Grip.of(self.problem)

    def fingers(self) -> list[tuple[Problem, list[StepResult]]]:
        """Return the problem of each finger, and its converged increments."""
        good = self.converged_steps
        if self.grip is None:
            return [(self.problem, good)]
        return [(self.grip.fingers[0], good), (self.grip.fingers[1], [step.other for step in good if step.other])]

    def entry(self, step: StepResult) -> Tree:
        """Return the entry of an increment in summary.json, which is measured once."""
        key = id(step)  # of an object that stays, as it is kept beside its entry
        if key not in self._entries:
            self._entries[key] = step, measure(self.problem.points, step)
        return self._entries[key][1]

    @property
    def all_factorizations(self) -> int:
        """Factorisations so far, with those of an earlier attempt."""
        return self.factorizations_before + self.problem.factorizations + self.workspace.factorizations

    def outcome(self) -> str:
        """Return the outcome, with the depth of the increment that failed."""
        failed = next((step for step in self.steps if not step.outcome.ok), None)
        return str(self.history.outcome) if failed is None else failed.failure

    def _slip(self, problem: Problem, steps: Sequence[StepResult]) -> Tree:
        """Return where and when the contact slips, and what is left of it until it does."""
        margin = [self.entry(step)["slip_margin"] for step in steps]
        return slip_events(problem.points, steps, margin, problem.model.readings)

    def _grip_summary(self, outcome: str) -> Tree:
        """Return what two fingers have besides: the increments of each, the object's pose, and whether it is held."""
        if self.grip is None:
            return {}
        held = [step for step in self.converged_steps if step.pose and step.other]
        fingers = [
            {"finger": name, **self._slip(own, steps), "steps": [self.entry(step) for step in steps]}
            for name, (own, steps) in zip(FINGERS, self.fingers(), strict=True)
            if steps
        ]
        pose, failed = held[-1].pose if held else None, next((s.detail for s in self.steps if not s.outcome.ok), "")
        return {
            "fingers": fingers,
            "object_pose": None if pose is None else _object_pose(pose),
            "held": True if outcome == str(Outcome.CONVERGED) else (failed or None),
            "least_grip_N": self.least_grip_N,
        }

    def summary(self, outcome: str) -> Tree:
        """Return the content of summary.json."""
        return {
            "scene": self.scene.as_dict(),
            "effects": list(self.scene.effects),
            "outcome": outcome,
            "warnings": self.warnings,
            "advice": self.advice,
            "steps": [self.entry(step) for step in self.steps],
            **self._slip(self.problem, self.steps),
            **self._grip_summary(outcome),
            "step_estimate": self.step_estimate.as_dict() if self.step_estimate else None,
            "error_estimate": self.error_estimate.as_dict() if self.error_estimate else None,
            "model_error": {name: found.as_dict() for name, found in self.model_error.items()},
            "model_error_methods": {name: found.method for name, found in self.model_error.items()},
            "effects_auto": self.need.as_dict() if self.need else None,
            "refinement": self.refinement.as_dict() if self.refinement else None,
            "uniqueness": {"largest_coupling": self.coupling},
            "mesh": _mesh(self.problem),
            "cost": _cost(self),
            "versions": versions(),
        }


def _object_pose(pose: ObjectPose) -> Tree:
    """Return where an object between two fingers is, from where it was at first, and how far they have closed."""
    turns = zip("xyz", np.degrees(pose.turns).tolist(), strict=True)
    moved = {"x_mm": pose.slide_x_mm, "y_mm": pose.rise_mm, "z_mm": pose.slide_z_mm}
    return {"closing_mm": pose.depth_mm, **moved, **{f"turn_{axis}_deg": turn for axis, turn in turns}}


def _mesh(problem: Problem) -> Tree:
    report = asdict(problem.body.report)
    del report["seconds"]
    return {
        "finger": extent(problem.model.design),
        **report,
        "dofs": int(problem.body.stiffness.upper.shape[0]),
        "contact_points": len(problem.surface.nodes),
        "symmetry": list(problem.axes),
        "formulation": "mixed quadratic/linear" if problem.body.elastic.mixed else "quadratic displacement",
    }


def _cost(record: PressRecord) -> Tree:
    return {
        "seconds": {**record.seconds, "total": time.perf_counter() - record.started},
        "factorizations": record.all_factorizations,
        "peak_memory_MB": peak_memory_MB(),
        "solver": record.problem.body.condensed.solver,
        "perturbed_pivots": record.problem.body.condensed.perturbed_pivots,
    }


def _coupling_warning(coupling: float) -> list[str]:
    if coupling <= 1.0:
        return []
    return [
        f"The largest mu |K_tt^-1 K_tn| is {coupling:.3g}, above 1: several contact states may satisfy all conditions. "
        "The one reported follows from the load history."
    ]


def point_count_warning(record: PressRecord) -> list[str]:
    """Return a warning if the last contact zone has too few points, in all or along its shorter side."""
    problem, touching = record.problem, [step.state.status != OPEN for step in record.steps]
    last = next((zone for zone in reversed(touching) if zone.any()), np.zeros(0, dtype=bool))
    count, size = int(np.count_nonzero(last)), problem.model.mesh.size_mm
    if not count:
        return []
    extents = np.ptp(problem.points.points[last][:, :: 2 if problem.dim == 3 else 3], axis=0) / size
    across, power = 1 + round(float(extents.min())), 1.0 / (problem.dim - 1)
    if count >= _RESOLVED_POINTS[problem.dim] and across >= _POINTS_ACROSS:
        return []
    enough = _SPARE * _RESOLVED_POINTS[problem.dim]
    ratio = min((count / enough) ** power, max(across - 1, 1) / _RESOLVED_POINTS[2])
    what = "Only 1 point touches" if count == 1 else f"Only {count} points touch"
    what += f", {across} across" if problem.dim == 3 else ""
    return [
        f"{what}: too few for the extents of contact and stick zone, and for forces if the object slides; "
        + size_advice(problem.model, size * ratio, "has enough", "press deeper")
    ]
