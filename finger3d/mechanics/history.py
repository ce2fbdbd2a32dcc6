"""History of a press: states, the quantities measured on each increment, slip margins and slip events.

With normal forces as they are, every point transmits at most mu times its own.  The resultants that these allow are the
limit surface (Goyal, Ruina and Papadopoulos 1991).  Margins go from 1 to 0, where a point or the whole contact slips,
or nothing can be held.

An event lies between the ends of two increments, at the pose at which the margin of the point or of the whole contact,
or the gap of a point that slips as it touches, vanishes if it falls as it did in the increment before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d._types import Float, Tree, TreeView, freeze_arrays
from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK, Coulomb, FrictionLaw
from finger3d.contact.state import ContactState
from finger3d.contact.zones import Zone, zone_area, zone_ends
from finger3d.errors import MissingError, Outcome
from finger3d.fem.mesh import FREE_FACES
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.readings import MEASURED, Column, Reading, Taxel, by_key, in_space, of_kind
from finger3d.objects import Move, ObjectPose
from finger3d.objects.placed import TIME

B = TypeVar("B")


@dataclass(frozen=True)
class State(Generic[B]):
    """State of the meshed part at one instant.

    Attributes
    ----------
    contact : state of the candidate contact points
    body : what the formulation of the body needs besides, see `finger3d.mechanics.formulation.Formulation`
    last : tuple of Move and (c, d) array, optional
        Motion of the object in the increment that led here, and the change of gap and tangential displacement, mm.
    """

    contact: ContactState
    body: B
    last: tuple[Move, Float] | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def share_until_touch(self, move: Move) -> Float:
        """Return the share (c,) of their last motion that open points make until they touch in a motion of the object.

        Their gap g and their place are expected to change as in the last increment, so that a point touches when
        g / (g - g') of the increment is over, where g' < 0 would be its gap at the end.  The share is zero where the
        path begins or turns.
        """
        ratio = None if self.last is None else move.length_ratio(self.last[0])
        if self.last is None or ratio is None:
            return np.zeros(len(self.contact.gap))
        closing, gap = -self.last[1][:, 0], np.maximum(self.contact.gap, 0.0)
        share = np.divide(gap, closing, out=np.full_like(gap, np.inf), where=closing > 0.0)
        return np.where(self.contact.status == OPEN, np.minimum(share, ratio), 0.0)

    def motion_until_touch(self, move: Move) -> Float:
        """Return the motion (c, d) mm, in x, y, z, of open points relative to the object until they touch.

        Its normal part counts, too, since normals turn as a gap closes.
        """
        if self.last is None:
            return np.zeros_like(self.contact.force)
        motion = self.share_until_touch(move)[:, None] * self.last[1]
        return np.asarray(np.einsum("ca,cak->ck", motion, self.contact.own_bases))


Region: TypeAlias = "NDArray[np.bool_] | slice"
"""Which contact points (m,) a region has."""

EVERYWHERE = slice(None)


def largest_force(
    points: ContactPoints, state: ContactState, friction: FrictionLaw, direction: Float, region: Region = EVERYWHERE
) -> tuple[float, float]:
    """Return the largest friction and the pressure (N) along a unit vector (3,), with the normal forces of a state."""
    normal, limit = _normals(points, state)[region], limits(points, state, friction)[region]
    along = normal @ direction
    across = np.linalg.norm(direction - along[:, None] * normal, axis=1)
    return float(limit @ across), float(state.force[region, 0] @ along)


def margins(points: ContactPoints, state: ContactState, friction: FrictionLaw) -> Float:
    """Return the margin (m,) of every point, 1 - |friction| / (mu N); 0 where it does not stick."""
    sticks, limit = state.status == STICK, limits(points, state, friction)
    used = np.divide(np.linalg.norm(state.force[:, 1:], axis=1), limit, out=np.ones_like(limit), where=limit > 0.0)
    return np.where(sticks, np.clip(1.0 - used, 0.0, 1.0), 0.0)


def slip_margin(
    points: ContactPoints, state: ContactState, friction: FrictionLaw, region: Region = EVERYWHERE
) -> float:
    """Return 1 less the tangential load over the largest that the whole contact can hold in its direction.

    The load is that of pressure and friction; 0: the contact slips as a whole.  The margin of a region is that of its
    points (m,) alone.
    """
    load = points.with_basis_of(state).to_global(state.force)[region].sum(axis=0) * np.array([1.0, 0.0, 1.0])
    size = float(np.linalg.norm(load))
    if not (state.status[region] == STICK).any() or not limits(points, state, friction)[region].any():
        return 0.0
    direction = load / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
    held = sum(largest_force(points, state, friction, direction, region))
    return min(max(1.0 - size / held, 0.0), 1.0) if held > 0.0 else 0.0


def limits(points: ContactPoints, state: ContactState, friction: FrictionLaw) -> Float:
    """Return the largest friction (m,) N of the points."""
    mu = friction.coefficients(state.status, state.force[:, 0] / points.area)
    return np.asarray(mu * state.force[:, 0])


def _normals(points: ContactPoints, state: ContactState) -> Float:
    """Return the normals (m, 3) of the points, into the finger."""
    along = np.zeros((len(state.force), points.dim))
    along[:, 0] = 1.0
    return points.with_basis_of(state).to_global(along)


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
    normal = _normals(points, state)
    return {
        "face": [FREE_FACES[k] for k in points.face],
        **{f"{axis}_mm": points.points[:, k] for k, axis in enumerate("xyz")},
        "area_mm2": points.area,
        **{f"normal_{axis}": normal[:, k] for k, axis in enumerate("xyz")},
        "pressure_MPa": state.force[:, 0] / points.area,
        **{f"shear_{axis}_MPa": friction[:, k] / points.area for k, axis in enumerate("xyz")},
        "gap_mm": state.gap,
        **{f"slip_{axis}_mm": slip[:, k] for k, axis in enumerate("xyz")},
        "margin": margins(points, state, step.friction),
        "status": [STATUS_NAMES[s] for s in state.status],
    }


Mask = NDArray[np.bool_]

GROSS_SLIP = "gross_slip"

_PLACE = "x_mm", "y_mm", "z_mm"

ROUND_OFF = 1e-9
"""Motion, mm and rad, that is round-off."""

_MARGIN_POWER = {2: 1.0, 3: 2.0 / 3.0}
"""Power of the margin of a whole contact that falls in proportion to a slide, by dimension.

It is that of a ball (Mindlin 1949); the margin of a flat contact and of a section falls in proportion itself.
"""


def regions_of(points: ContactPoints, readings: Sequence[Reading]) -> dict[str, Mask]:
    """Return the points (m,) of each region: the whole contact, those above each taxel's patch, and each face."""
    x, z = points.points[:, 0], points.points[:, 2]
    regions = {"whole": np.ones(len(x), dtype=bool)}
    for taxel in readings:
        if isinstance(taxel, Taxel):
            above = np.abs(x - taxel.x_mm) <= 0.5 * taxel.length_mm
            if taxel.width_mm is not None and points.dim == 3:
                above &= np.abs(z - taxel.z_mm) <= 0.5 * taxel.width_mm
            regions[f"taxel_{taxel.name}"] = above
    return regions | {FREE_FACES[face]: points.face == face for face in np.unique(points.face)}


class SlipEvent(NamedTuple):
    """Slip that begins in an increment, numbered from 1, after a share of it, at one of the points (m,) or at all."""

    step: int
    share: float
    point: int | None = None

    @property
    def increments(self) -> float:
        """Increments that are over by then."""
        return self.step - 1 + self.share


def slips(
    points: ContactPoints, steps: Sequence[StepResult], margin: Sequence[float], readings: Sequence[Reading]
) -> dict[str, SlipEvent | None]:
    """Return the first slip of every region, and, under `GROSS_SLIP`, that of the whole contact; see `slip_events`."""
    regions, good = regions_of(points, readings), [step for step in steps if step.outcome.ok]
    return {**_first_slips(points, good, regions), GROSS_SLIP: _gross_slip(points, steps, np.array(margin))}


def slip_events(
    points: ContactPoints,
    steps: Sequence[StepResult],
    margin: Sequence[float],
    readings: Sequence[Reading],
    errors: Mapping[str, float],
) -> Tree:
    """Return the entries of summary.json on slip.

    Parameters
    ----------
    points : of the whole finger, m of them
    steps : increments in order; the last may have failed
    margin : the slip margins after them
    readings : those of the model; the patches of its taxels are regions
    errors : of the events, in increments, by the names of `slips`

    Returns
    -------
    dict
        ``first_slip``, by region the pose at which one of its points first slips, with the increment, the place of that
        point (mm, at rest) and the error of the pose if it is known, or None; ``slip_margins``, by region the margin
        after the last increment, None without contact; ``gross_slip``, the pose at which the whole contact first slips,
        with the increment and the error, or None.
    """
    good = [step for step in steps if step.outcome.ok]
    found = {
        name: event and _entry(points, steps, event, errors.get(name))
        for name, event in slips(points, steps, margin, readings).items()
    }
    return {
        GROSS_SLIP: found.pop(GROSS_SLIP),
        "first_slip": found,
        "slip_margins": {name: _margin(points, good, region) for name, region in regions_of(points, readings).items()},
    }


def _margin(points: ContactPoints, steps: Sequence[StepResult], region: Mask) -> float | None:
    if not steps or not (steps[-1].state.status[region] != OPEN).any():
        return None
    return slip_margin(points, steps[-1].state, steps[-1].friction, region)


def _first_slips(
    points: ContactPoints, steps: Sequence[StepResult], regions: Mapping[str, Mask]
) -> dict[str, SlipEvent | None]:
    """Return the first slip of every region."""
    found: dict[str, SlipEvent | None] = dict.fromkeys(regions)
    left = [_left(points, step) for step in steps]
    for number, step in enumerate(steps):
        slipping = (step.state.status == SLIP) & (limits(points, step.state, step.friction) > 0.0)
        shares = np.ones(len(slipping))
        if number > 1:
            same = left[number - 1][1] == left[number - 2][1]
            trend = _share(left[number - 2][0], left[number - 1][0], _ratio(steps, number))
            shares = np.where(same, trend, 1.0)
        for name, region in regions.items():
            if found[name] is None and (there := np.flatnonzero(slipping & region)).size:
                first = there[np.argmin(shares[there])]
                found[name] = SlipEvent(number + 1, float(shares[first]), int(first))
    return found


def _gross_slip(points: ContactPoints, steps: Sequence[StepResult], margin: Float) -> SlipEvent | None:
    """Return the event in which no point of the contact sticks any more while the object moves along it.

    Under a prescribed force that the contact cannot hold it is the last pose at which it held.
    """
    left = margin ** _MARGIN_POWER[points.dim]
    for number, step in enumerate(steps):
        if step.outcome is Outcome.SLIPS:
            return SlipEvent(number + 1, 0.0)
        along = np.delete(Move(_pose_before(steps, number), step.target).change, [0, TIME])
        held = margin[number] > 0.0 or not limits(points, step.state, step.friction).any()
        if held or np.abs(along).max() <= ROUND_OFF:
            continue
        known = number > 1 and margin[number - 1] > 0.0
        share = _share(left[number - 2], left[number - 1], _ratio(steps, number)) if known else 1.0
        return SlipEvent(number + 1, float(share))
    return None


def _left(points: ContactPoints, step: StepResult) -> tuple[Float, Mask]:
    """Return what is left (m,) until a point slips, its margin or, mm, its gap; and whether it is open."""
    is_open = step.state.status == OPEN
    return np.where(is_open, step.state.gap, margins(points, step.state, step.friction)), is_open


def _share(before: ArrayLike, last: ArrayLike, ratio: float | None) -> Float:
    """Return after what share of an increment numbers vanish that fall as in the last one; 1 where they do not.

    Parameters
    ----------
    before, last : two and one increments ago
    ratio : length of the increment over that of the last one; None where the path has turned
    """
    last = np.asarray(last, dtype=float)
    fall = (np.asarray(before) - last) * (ratio or 0.0)
    return np.asarray(np.clip(np.divide(last, fall, out=np.ones_like(last), where=fall > 0.0), 0.0, 1.0))


def _pose_before(steps: Sequence[StepResult], number: int) -> ObjectPose:
    return steps[number - 1].target if number else ObjectPose(0.0)


def _ratio(steps: Sequence[StepResult], number: int) -> float | None:
    """Return the length of an increment over that of the one before."""
    moves = [Move(_pose_before(steps, k), steps[k].target) for k in (number - 1, number)]
    return moves[1].length_ratio(moves[0])


def _entry(points: ContactPoints, steps: Sequence[StepResult], event: SlipEvent, error: float | None) -> Tree:
    """Return the pose of an event, its increment and place, and the error of every coordinate that changes there."""

    def pose(increments: float) -> Tree:
        number = min(int(max(increments, 0.0)), len(steps) - 1)
        move, share = Move(_pose_before(steps, number), steps[number].target), increments - number
        return pose_entry(move.at(min(max(share, 0.0), 1.0)))

    at = pose(event.increments)
    where = {} if event.point is None else dict(zip(_PLACE, points.points[event.point].tolist(), strict=True))
    if error is None:
        return {"step": event.step, **at, **where}
    ends = [pose(event.increments - error), pose(event.increments + error)]
    errors = {name: max(abs(end[name] - value) for end in ends) for name, value in at.items()}
    return {"step": event.step, **at, **where, "error": {name: e for name, e in errors.items() if e > 0.0}}
