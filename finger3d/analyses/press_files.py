"""Files of a press: summary, tables, fields and pictures in one folder."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d._types import Array, Float, Tree, TreeView
from finger3d.contact.friction import STICK
from finger3d.errors import Finger3dError
from finger3d.fem.mesh.simplex import CONTACT, FREE_FACES, Mesh, axis_numbers, middles, unfold
from finger3d.io import write_csv, write_json, write_text
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.history import StepResult, contact_table, row_of_entry
from finger3d.mechanics.march.grip import FINGERS, two
from finger3d.mechanics.postprocess.marker_grid import marker_table
from finger3d.results.states import States, facing, states_of, write_states
from finger3d.results.vtu import write_vtu

if TYPE_CHECKING:
    from finger3d.analyses.press_record import PressRecord
    from finger3d.mechanics.discretise.problem import Problem


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
            write_csv(self.folder / "history.csv", history_table(record.steps, map(record.entry, record.steps)))
            last = next((step for step in reversed(record.steps) if step.outcome.ok), record.steps[-1])
            write_csv(self.folder / "contact.csv", _contact_table(record, last))
        self._written = time.perf_counter()
        self._seconds = self._written - begin

    def progress_if_due(self, record: PressRecord) -> None:
        """Write summary and tables unless that was done a moment ago."""
        if time.perf_counter() - self._written > max(_WRITE_EVERY_S, _WRITE_SHARE * self._seconds):
            self.progress(record)

    def summary(self, record: PressRecord, outcome: str) -> Tree:
        """Write summary.json and return its content."""
        begin = time.perf_counter()
        content = record.summary(outcome)
        write_json(self.folder / _SUMMARY, content)
        if self._scene:
            write_text(self.folder / _SCENE, self._scene)
            for name in _FILES if self._replaces else ():
                (self.folder / name).unlink(missing_ok=True)
            self._scene, self._replaces = "", False
        record.seconds["output"] += time.perf_counter() - begin
        return content

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


def history_table(steps: Sequence[StepResult], entries: Iterable[TreeView]) -> dict[str, ArrayLike]:
    """Return the columns of history.csv from the entries of the steps in summary.json; none without steps."""
    pairs = enumerate(zip(steps, entries, strict=True), start=1)
    rows = [{"step": number} | row_of_entry(entry, step) for number, (step, entry) in pairs]
    return {name: [row[name] for row in rows] for name in (rows[0] if rows else ())}


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
