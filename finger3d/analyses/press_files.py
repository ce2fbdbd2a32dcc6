"""Files of a press: summary, tables, fields and pictures in one folder."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._machine import peak_memory_MB, versions
from finger3d._types import Array, Float, Tree
from finger3d.contact.friction import OPEN, STICK
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.mesh import CONTACT, FREE_FACES, Mesh, axis_numbers, middles, unfold
from finger3d.geometry.imported import extent
from finger3d.io import write_csv, write_json, write_text
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.discretise.resolution import size_advice
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import History, StepResult, contact_table, measure, row_of_entry, slip_events
from finger3d.mechanics.march.grip import FINGERS, Grip, two
from finger3d.mechanics.postprocess.marker_grid import marker_table
from finger3d.objects import ObjectPose
from finger3d.results.states import States, facing, states_of, write_states, write_vtu

if TYPE_CHECKING:
    from finger3d.accuracy.changes import ChangeEstimate
    from finger3d.accuracy.estimate import ErrorEstimate
    from finger3d.accuracy.refine import Refinement
    from finger3d.analyses.free_keys import Need
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
        errors = self.error_estimate.slip if self.error_estimate and problem is self.problem else {}
        return slip_events(problem.points, steps, margin, problem.model.readings, errors)

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


_WRITE_EVERY_S = 0.5
"""Shortest time between two writes of the tables, s."""

_WRITE_SHARE = 10.0
"""Shortest time between two writes over the time of one: a table holds all increments, and grows with them."""

_INCOMPLETE = "incomplete: the press was still running, or was interrupted; the increments written are valid"
_SUMMARY, _SCENE = "summary.json", "scene.toml"
_FILES = (
    "history.csv", "contact.csv", "fields.vtu", "steps.npz", "report.html",
    "finger.png", "contact.png", "force.png", "markers.csv", "markers.png",
)  # fmt: skip


@dataclass(frozen=True)
class Fields:
    """Fields of the whole finger after the last converged increment.

    Attributes
    ----------
    mesh : the whole finger at rest, unfolded where symmetry was used, mm
    image_of : (n,) node of the meshed part that each node is an image of
    mirror_sign : (n, d) factor of a vector's components at the image, +1 or -1
    displacement : (n, d) mm
    strain, stress : (n, 3, 3) nodal averages; stress in MPa
    """

    mesh: Mesh
    image_of: NDArray[np.int64]
    mirror_sign: Float
    displacement: Float
    strain: Float
    stress: Float

    @classmethod
    def of(cls, problem: Problem, u: Float, strain: Float, stress: Float) -> Fields:
        """Unfold fields of the meshed part: displacements (p, d) mm, strain and stress (p, 3, 3)."""
        mesh, image_of, sign = unfold(problem.mesh, axis_numbers(problem.axes))
        flip = np.ones((len(image_of), 3))
        flip[:, : problem.dim] = sign
        both = flip[:, :, None] * flip[:, None, :]
        return cls(mesh, image_of, sign, u[image_of] * sign, strain[image_of] * both, stress[image_of] * both)

    @property
    def at_points(self) -> dict[str, Array]:
        """Displacement, strain and stress by name, symmetric tensors in the order of VTK."""
        return {"displacement": self.displacement, "strain": _voigt(self.strain), "stress": _voigt(self.stress)}


class ResultWriter:
    """Writes the results of a press into a folder as they come.

    Results of an earlier press in the folder stay until the first step of this one is there.

    Parameters
    ----------
    folder : where the files go

    Raises
    ------
    Finger3dError
        If a file there has the name of a result, but no press has written it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._written = -math.inf
        self._seconds = 0.0
        self._scene = ""
        self._replaces = (folder / _SUMMARY).exists()
        if not self._replaces and (strange := [name for name in (_SCENE, *_FILES) if (folder / name).exists()]):
            raise Finger3dError(
                f"--out {folder}: holds {strange[0]} that no press has written there; name another folder, or move it"
            )

    def scene(self, text: str) -> None:
        """Keep the content of scene.toml, which is written with the first summary."""
        self._scene = text

    def progress(self, record: PressRecord, outcome: str = _INCOMPLETE) -> None:
        """Write summary and tables of a press that still runs."""
        if self._replaces and not record.steps:
            return
        begin = time.perf_counter()
        self.summary(record, outcome)
        if record.steps:
            rows = [{"step": n} | row_of_entry(record.entry(s), s) for n, s in enumerate(record.steps, start=1)]
            write_csv(self.folder / "history.csv", {name: [row[name] for row in rows] for name in rows[0]})
            last = next((step for step in reversed(record.steps) if step.outcome.ok), record.steps[-1])
            write_csv(self.folder / "contact.csv", _contact_table(record, last))
        self._written = time.perf_counter()
        self._seconds = self._written - begin

    def progress_if_due(self, record: PressRecord) -> None:
        """Write summary and tables unless that was done a moment ago."""
        if time.perf_counter() - self._written > max(_WRITE_EVERY_S, _WRITE_SHARE * self._seconds):
            self.progress(record)

    def summary(self, record: PressRecord, outcome: str) -> None:
        """Write summary.json."""
        begin = time.perf_counter()
        write_json(self.folder / _SUMMARY, record.summary(outcome))
        if self._scene:
            write_text(self.folder / _SCENE, self._scene)
            for name in _FILES if self._replaces else ():
                (self.folder / name).unlink(missing_ok=True)
            self._scene, self._replaces = "", False
        record.seconds["output"] += time.perf_counter() - begin

    def markers(self, record: PressRecord) -> None:
        """Write markers.csv, if there are markers, with their errors as far as they are known."""
        if markers := _markers(record):
            write_csv(self.folder / "markers.csv", markers)

    def fields(self, record: PressRecord, fields: Sequence[Fields]) -> States:
        """Write fields.vtu, fields after the last converged increment, and steps.npz, states of chosen increments.

        Parameters
        ----------
        fields : of the finger, or of both
        """
        mesh, states, surface = fields[0].mesh, list[States](), list[dict[str, Array]]()
        for (problem, steps), of_finger in zip(record.fingers(), fields, strict=True):
            whole = of_finger.mesh, of_finger.image_of, of_finger.mirror_sign, of_finger.displacement
            states.append(states_of(problem, steps, *whole))
            surface.append(of_finger.at_points | _on_surface(of_finger.mesh, problem.points, steps[-1]))
        at_points, shown = surface[0], states[0]
        if record.grip:
            closed = [2.0 * step.pose.depth_mm for step in record.converged_steps if step.pose]
            mesh = two(mesh, record.grip.apart_mm)
            shown = facing((states[0], states[1]), mesh, np.array(closed)[shown.step - 1])
            at_points = {
                name: np.concatenate([surface[0][name], _mirrored(name, surface[1][name])]) for name in at_points
            }
            at_points["displacement"][len(fields[0].displacement) :, 1] -= closed[-1]
        write_states(self.folder / "steps.npz", shown)
        self.markers(record)
        write_vtu(self.folder / "fields.vtu", mesh, at_points, {} if mesh.part is None else {"part": mesh.part})
        return shown

    @contextmanager
    def pictures(self, record: PressRecord, fields: States) -> Iterator[Callable[[], None]]:
        """Draw finger.png, contact.png, force.png, and markers.png if there are markers.

        Yields
        ------
        function that draws and writes them; a solid is rendered beside what is done before
        """
        from finger3d.plotting import figures
        from finger3d.plotting.deformed import drawing_finger
        from finger3d.plotting.gauges import marks_of
        from finger3d.plotting.layout import save
        from finger3d.plotting.show import finger_of, mesh_of

        problem, good = record.problem, record.converged_steps
        steps = [record.entry(step) for step in good]
        table = contact_table(problem.points, good[-1])
        half_width = problem.points.half_width_mm if problem.dim == 3 else None
        stuck = np.full(len(table["status"]), STICK)
        mu = problem.model.friction.coefficients(stuck, table["pressure_MPa"])
        mesh = mesh_of(fields)
        title = f"{steps[-1]['normal_force_N']:.4g} N at {good[-1].target.depth_mm:.3g} mm deep"
        marks = marks_of(mesh, problem.model.gauges, near=mesh.dim == 3)
        finger = finger_of(fields, len(fields.step) - 1, mesh, title, marks)

        def draw() -> None:
            figures.contact_figure(self.folder / "contact.png", table, mu, problem.points.band_mm, half_width)
            figures.force_figure(self.folder / "force.png", steps)
            if markers := _markers(record):
                figures.marker_figure(self.folder / "markers.png", markers)
            save(drawn(), self.folder / "finger.png")

        with drawing_finger(finger) as drawn:
            yield draw


def _markers(record: PressRecord) -> Tree | None:
    """Return the columns of markers.csv; None without markers."""
    good, grid = record.converged_steps, record.marker_grid
    if not good or not (record.problem.model.markers or grid):
        return None
    return marker_table(record.problem, good, grid, record.marker_errors)


def _contact_table(record: PressRecord, step: StepResult) -> Tree:
    """Return the columns of contact.csv; those of two fingers, each in its own frame, one after the other."""
    first = contact_table(record.problem.points, step)
    if step.other is None:
        return first
    second = contact_table(record.problem.points, step.other)
    fingers = np.repeat(FINGERS, len(first["face"]))
    return {"finger": fingers, **{name: np.concatenate([first[name], second[name]]) for name in first}}


def _on_surface(mesh: Mesh, points: ContactPoints, step: StepResult) -> dict[str, Array]:
    """Return contact quantities at all nodes (n,), interpolated between the vertices.

    At a crease they are those of the face with the larger pressure.
    """
    table = contact_table(points, step)
    own = np.argsort(table["pressure_MPa"], kind="stable")  # the last of equal indices counts
    labels = [FREE_FACES[k] for k in np.union1d(points.face, CONTACT)]
    ends, between = middles(np.concatenate([mesh.facets[label] for label in labels if label in mesh.facets]), mesh.dim)

    def nodal(values: Float) -> Float:
        out = np.zeros((len(mesh.points), *values.shape[1:]))
        out[points.nodes[own]] = values[own]
        out[between] = out[ends].mean(axis=1)
        return out

    out = {name: nodal(table[f"{name}_MPa"]) for name in ("pressure", "shear_x", "shear_y", "shear_z")}
    out["normal"] = nodal(np.stack([table[f"normal_{axis}"] for axis in "xyz"], axis=1))
    out["status"] = np.zeros(len(mesh.points))
    out["status"][points.nodes[own]] = step.state.status[own]
    out["status"][between] = out["status"][ends].min(axis=1)
    return out


_ODD_COMPONENTS = {"displacement": [1], "normal": [1], "strain": [3, 4], "stress": [3, 4]}
"""Components that change sign in the mirror image of a finger."""


def _mirrored(name: str, values: Array) -> Array:
    """Return the values of a field in the mirror image of a finger."""
    out = -values if name == "shear_y" else values.copy()
    if name in _ODD_COMPONENTS:
        out[:, _ODD_COMPONENTS[name]] *= -1.0
    return out


def _voigt(tensor: Float) -> Float:
    """Components xx yy zz xy yz xz (n, 6) of symmetric tensors (n, 3, 3), the order of VTK."""
    return np.stack([tensor[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=1)
