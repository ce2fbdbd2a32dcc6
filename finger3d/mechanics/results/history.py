"""Results of the increments of a press, and the quantities measured on them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Tree, TreeView
from finger3d.contact.friction import STATUS_NAMES, STICK, Coulomb, FrictionLaw
from finger3d.contact.state import ContactState
from finger3d.contact.zones import Zone, zone_area, zone_ends
from finger3d.errors import MissingError, Outcome
from finger3d.fem.mesh.simplex import FREE_FACES
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.readings.columns import MEASURED, Column, by_key, in_space, of_kind
from finger3d.mechanics.results.slip_limit import margins, slip_margin
from finger3d.mechanics.results.state import State
from finger3d.objects import ObjectPose

_READINGS = ("gauges", "markers", "taxels", "other_readings")
"""Keys of an entry of `steps` in summary.json under which its readings are."""


@dataclass(frozen=True)
class StepResult:
    """Result of an increment: contact state of the whole finger (m points), readings, work and convergence.

    `meshed_state` is the state of the meshed part (c points), from which fields are recovered; `moment` (3,), N mm,
    is that of all contact forces on the finger about the middle of the base; `penetration_mm` is how deep the deepest
    contact point is inside the object, or the deepest place of the free surface
    (`finger3d.mechanics.postprocess.penetration`); `detail` describes a failure.  `parts` are the pose and the state of
    the meshed part at the end of every part that the increment was solved in, the last one included; `friction` is the
    law by which points slip.  Between two fingers `other` is the result of the second one, each in a frame of its own,
    and `pose` that of the object.
    """

    target: ObjectPose
    state: ContactState
    meshed_state: State[Any]
    lowest: tuple[float, float]
    moment: Float
    readings: dict[Column, float]
    external_work_mJ: float
    dissipation_mJ: float
    outcome: Outcome
    residual: float
    iterations: int
    method: str
    penetration_mm: float
    detail: str = ""
    parts: tuple[tuple[ObjectPose, State[Any]], ...] = ()
    other: StepResult | None = None
    pose: ObjectPose | None = None
    friction: FrictionLaw = Coulomb(0.0)

    @property
    def failure(self) -> str:
        """Depth and outcome of an increment that did not converge."""
        detail, outcome = self.detail and f" ({self.detail})", str(self.outcome)
        if self.other is not None and self.outcome in (Outcome.SLIPS, Outcome.NOT_HELD):
            outcome = "the object is not held; grip it harder, or with more friction or less load"
        return f"at a depth of {self.target.depth_mm:.4g} mm: {outcome}{detail}"

    def check(self, what: str) -> None:
        """Raise a MissingError, which begins with `what`, if the increment did not converge."""
        if not self.outcome.ok:
            raise MissingError(f"{what}: {self.failure}")

    @property
    def named_readings(self) -> dict[str, float]:
        """Every number that is read, by its name; ``m1.x`` is the displacement of marker m1 along x."""
        return {column.name: value for column, value in self.readings.items()}

    @property
    def gauges(self) -> dict[str, float]:
        """Strain by the name of the gauge."""
        return {column.sensor: self.readings[column] for column in of_kind(self.readings, "gauge")}

    @property
    def markers(self) -> dict[str, tuple[float, ...]]:
        """Displacement (d,), mm, by the name of the marker."""
        moved: dict[str, tuple[float, ...]] = {}
        for column in of_kind(self.readings, "marker"):
            moved[column.sensor] = (*moved.get(column.sensor, ()), self.readings[column])
        return moved

    @property
    def taxels(self) -> dict[str, float]:
        """Pressure, MPa, by the name of the taxel."""
        return {column.sensor: self.readings[column] for column in of_kind(self.readings, "taxel")}


@dataclass(frozen=True, repr=False)
class History:
    """Results of the increments of a press, and the contact points of the whole finger."""

    points: ContactPoints
    steps: tuple[StepResult, ...]

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<History of {len(self.steps)} steps, {len(self.points.nodes)} contact points: {self.outcome}>"

    @property
    def outcome(self) -> Outcome:
        """CONVERGED if every increment has converged, else the first other outcome."""
        return next((f.outcome for f in self.steps if not f.outcome.ok), Outcome.CONVERGED)


def measure(points: ContactPoints, step: StepResult, with_zones: bool = True) -> Tree:
    """Entry of `steps` in summary.json for one increment; lengths and areas of zones take most of its time.

    ``contact_half_length_mm`` and ``stick_half_length_mm`` are half the extents of contact and stick on the line z = 0
    (`finger3d.contact.zones`).  The line has the vertices of the surface mesh on it and the intersections of
    edges with it, each with the state of the nearer end of its edge.  Lengths and areas are those of the surface at
    rest.  Readings are sorted by the kind of their sensors, and displacements have three components.
    """
    state, target = step.state, step.target
    sizes = _sizes_of_zones(points, state) if with_zones else {}
    points = points.with_basis_of(state)
    world = points.to_global(state.force)
    friction = points.friction(state.force)
    normal, sticks = state.force[:, 0], state.status == STICK
    outward = (friction[:, ::2] * points.sides_of(step.lowest)).sum(axis=0)
    numbers: Tree = {
        **pose_entry(target),
        "normal_force_N": 0.0 - float(world[:, 1].sum()),  # 0, not -0, without contact
        "tangential_force_x_N": float(friction[:, 0].sum()),
        "tangential_force_z_N": float(friction[:, 2].sum()),
        "friction_sum_N": float(np.linalg.norm(friction, axis=1).sum()),
        **{f"force_{axis}_N": float(force) for axis, force in zip("xyz", world.sum(axis=0), strict=True)},
        **{f"moment_{axis}_Nmm": float(moment) for axis, moment in zip("xyz", step.moment, strict=True)},
        **{f"outward_friction_{axis}_N": float(force) for axis, force in zip("xz", outward, strict=True)},
        **sizes,
        "stick_ratio_force": float(normal[sticks].sum() / (normal.sum() or 1.0)),
        "slip_margin": slip_margin(points, state, step.friction),
    }
    others = {column.name: value for column, value in step.readings.items() if column.kind not in MEASURED}
    return numbers | {
        "largest_penetration_mm": step.penetration_mm,
        "external_work_mJ": step.external_work_mJ,
        "dissipation_mJ": step.dissipation_mJ,
        "gauges": step.gauges,
        "markers": {name: [*moved, *[0.0] * (3 - len(moved))] for name, moved in step.markers.items()},
        "taxels": step.taxels,
        **({"other_readings": others} if others else {}),
        "iterations": step.iterations,
        "residual": step.residual,
        "method": step.method,
        "outcome": str(step.outcome),
    }


def pose_entry(pose: ObjectPose) -> Tree:
    """Return the coordinates of the object as summary.json and history.csv name them."""
    return {
        "depth_mm": pose.depth_mm,
        "slide_x_mm": pose.slide_x_mm,
        "slide_z_mm": pose.slide_z_mm,
        **{f"turn_{axis}_deg": round(math.degrees(turn), 12) for axis, turn in zip("xyz", pose.turns, strict=True)},
        "time_s": pose.time_s,
    }


def _sizes_of_zones(points: ContactPoints, state: ContactState) -> dict[str, float]:
    """Return areas and half lengths of contact and stick."""
    (contact, stick), middle = points.zones(state), points.middle_line()
    touching, sticking = (zone_area(points.facets, points.facet_area, zone) for zone in (contact, stick))
    return {
        "contact_area_mm2": touching,
        "stick_area_mm2": sticking,
        "stick_ratio_area": sticking / (touching or 1.0),
        "contact_half_length_mm": _half_extent(middle, contact),
        "stick_half_length_mm": _half_extent(middle, stick),
        **({"contact_half_length_end_mm": _half_extent(points.end_line(), contact)} if points.dim == 3 else {}),
    }


def _half_extent(line: tuple[Float, NDArray[np.int64]], zone: Zone) -> float:
    low, high = zone_ends(*line, zone)
    return 0.5 * (high - low)


def table_row(points: ContactPoints, step: StepResult, with_zones: bool = True) -> Tree:
    """Return the row of history.csv for one increment: its numbers, and its readings by the names of their columns."""
    return row_of_entry(measure(points, step, with_zones), step)


def row_of_entry(entry: TreeView, step: StepResult) -> Tree:
    """Return the row of history.csv for one increment from its entry in summary.json."""
    numbers = {key: value for key, value in entry.items() if key not in _READINGS}
    return numbers | by_key(in_space(step.readings))


def contact_table(points: ContactPoints, step: StepResult) -> Tree:
    """Columns of contact.csv; pressure and shear are the traction on the finger, normals point into it.

    A vertex on a crease has a row for each of its faces.
    """
    state = step.state
    points = points.with_basis_of(state)
    friction = points.friction(state.force)
    padded = np.zeros((len(state.accumulated_slip), points.dim))
    padded[:, 1:] = state.accumulated_slip
    slip = points.to_global(padded)
    along = np.zeros_like(padded)
    along[:, 0] = 1.0
    normal = points.to_global(along)
    return {
        "face": [FREE_FACES[k] for k in points.face],
        "x_mm": points.points[:, 0],
        "y_mm": points.points[:, 1],
        "z_mm": points.points[:, 2],
        "area_mm2": points.area,
        **{f"normal_{axis}": normal[:, k] for k, axis in enumerate("xyz")},
        "pressure_MPa": state.force[:, 0] / points.area,
        "shear_x_MPa": friction[:, 0] / points.area,
        "shear_y_MPa": friction[:, 1] / points.area,
        "shear_z_MPa": friction[:, 2] / points.area,
        "gap_mm": state.gap,
        "slip_x_mm": slip[:, 0],
        "slip_y_mm": slip[:, 1],
        "slip_z_mm": slip[:, 2],
        "margin": margins(points, state, step.friction),
        "status": [STATUS_NAMES[s] for s in state.status],
    }
