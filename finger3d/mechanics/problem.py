"""A condensed body over its contact points, and the path that the object takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.newton import uniqueness
from finger3d.contact.state import ContactState
from finger3d.fem.assembly import Elasticity, Stiffness
from finger3d.fem.condense import Condensation, spring_forces
from finger3d.fem.simplex import Mesh
from finger3d.fem.traces import BoundarySurface
from finger3d.mechanics.history import ContactPoints, ObjectPose
from finger3d.mechanics.model import Leg, Model
from finger3d.meshing.report import MeshReport

Float = NDArray[np.float64]

AUTO_START = 10
"""Increments that ``steps = "auto"`` begins with."""

_COVERED = 0.5  # least share of a point's hat that must be under the object
_BESIDE = 2.0  # gap beside an object, in heights of the finger: finite, and never closed
_AT_ONCE = 8_000_000  # unknowns of fields that are solved for together: 64 MB, and as much again a few times on the way


@dataclass(frozen=True)
class Problem:
    """A condensed body over its contact points (of the meshed part; symmetry unfolds them).

    Attributes
    ----------
    delassus : (c, d, c, d) mm/N, in the object's frame
    gauge_rows : (g, c d) strain per N
    active_dofs : (r,) directions among c d that the condensed rows stand for
    first_contact_mm : height of the object's lowest point at first touch
    fixed_dofs : numbers of the unknowns that are zero
    thickness : mm, the width of a section, 1 for a solid
    image_of, mirror_sign, multiplicity : (m,), (m, d), (m,)
        Whole point -> part point, its mirror signs in the frame, and how often the part's force and area count there.
    bar_stiffness : (s,) N mm
        Stiffness of the last s condensed rows, which inclusions add to the body; `condensed` is the body without.
    subgrid_compliance : (g + s, g + s)
        What the last rows of `condensed`, gauges and inclusions, yield more than the mesh says.
    without_inclusions : the same without inclusions, if there are any
    place_mm : (x, z) of first touch, if the finger's surface is known
    object_factorizations : of the object, where it yields
    """

    model: Model
    mesh: Mesh
    report: MeshReport
    elastic: Elasticity
    stiffness: Stiffness
    surface: BoundarySurface
    condensed: Condensation
    delassus: Float
    gauge_rows: Float
    active_dofs: NDArray[np.int64]
    fixed_dofs: NDArray[np.int64]
    thickness: float
    first_contact_mm: float
    axes: tuple[str, ...]
    points: ContactPoints
    image_of: NDArray[np.int64]
    mirror_sign: Float
    multiplicity: Float
    seconds: dict[str, float]
    bar_stiffness: Float = field(default_factory=lambda: np.zeros(0))
    subgrid_compliance: Float = field(default_factory=lambda: np.zeros((0, 0)))
    without_inclusions: Problem | None = None
    place_mm: tuple[float, float] | None = None
    object_factorizations: int = 0

    @property
    def factorizations(self) -> int:
        """Number of factorisations of the build; a press counts its own in its workspace."""
        return self.condensed.factorizations + self.object_factorizations

    @property
    def origin(self) -> ObjectPose:
        """Where every path begins: first touch."""
        return ObjectPose(0.0)

    @property
    def dim(self) -> int:
        """Space dimensions."""
        return self.mesh.dim

    def gap(self, target: ObjectPose, surface: BoundarySurface | None = None) -> Float:
        """Weighted gap (c,) mm at rest under a target, from the exact object at the surface's quadrature points."""
        where = surface or self.surface
        return rigid_gap(self.model, where, self.first_contact_mm, target)

    def free_motion(self, target: ObjectPose) -> Float:
        """Gap and tangential position (c, d) mm of every point under no contact force."""
        frame = self.model.object.frame(self.dim)
        moved = np.array([target.slide_x_mm, -target.depth_mm, target.slide_z_mm])[: self.dim]
        out = np.empty((len(self.surface.nodes), self.dim))
        out[:, 0] = self.gap(target)
        out[:, 1:] = -(frame[1:] @ moved)
        return out

    def unfold(self, state: ContactState) -> ContactState:
        """The state of the whole finger's points from that of the part's."""
        p = self.image_of
        tangent = self.mirror_sign[:, 1:]
        return ContactState(
            state.status[p],
            state.force[p] * self.mirror_sign * self.multiplicity[:, None],
            state.gap[p],
            state.tangential_displacement[p] * tangent,
            state.accumulated_slip[p] * tangent,
            self._whole_frames(state.bases),
        )

    def _whole_frames(self, frames: Float | None) -> Float | None:
        if frames is None:
            return None
        world = self.mirror_sign[:, [1, 0, 2][: self.dim]]
        return frames[self.image_of] * self.mirror_sign[:, :, None] * world[:, None, :]

    def world_force(self, state: ContactState) -> Float:
        """Forces (m, 3) N on the whole finger's points in x, y, z, from the part's state."""
        whole = self.unfold(state)
        return self.points.with_basis_of(whole).to_global(whole.force)

    def coupling(self) -> float:
        """Largest mu |K_tt^-1 K_tn| over points; above 1 a contact state need not be the only one."""
        c, d = self.delassus.shape[:2]
        return uniqueness(np.full(c, self.model.friction.largest), self.delassus.reshape(c * d, c * d), d)

    def gauge_strains(self, force: Float) -> dict[str, float]:
        """Strain by gauge name under contact forces (c, d), through the condensed rows."""
        names = [g.name for g in self.model.gauges]
        return dict(zip(names, map(float, self.gauge_rows @ force.ravel()), strict=True))

    def row_forces(self, force: Float) -> Float:
        """Forces on the condensed rows from contact forces (c, d); none on the rows of gauges and inclusions."""
        rows = np.zeros(len(self.condensed.compliance))
        rows[: len(self.active_dofs)] = force.ravel()[self.active_dofs]
        return rows

    def unknowns(self, force: Float) -> Float:
        """All unknowns (N,) of the part's body under contact forces (c, d)."""
        return self._unknowns(self.row_forces(force))

    def unknowns_of(self, forces: Sequence[Float]) -> Iterator[Float]:
        """The same for each of several forces (c, d): as many at once as fit into some memory."""
        at_once = max(1, _AT_ONCE // self.stiffness.upper.shape[0])
        for first in range(0, len(forces), at_once):
            rows = np.stack([self.row_forces(force) for force in forces[first : first + at_once]], axis=1)
            yield from self._unknowns(rows).T

    def _unknowns(self, rows: Float) -> Float:
        """All unknowns (N, ...) under forces (r, ...) on the condensed rows; springs add theirs."""
        compliance = self.condensed.compliance
        if len(self.bar_stiffness):
            rows[-len(self.bar_stiffness) :] = spring_forces(compliance, self.bar_stiffness, compliance @ rows)
        return self.condensed.unknowns(rows)


def rigid_gap(model: Model, where: BoundarySurface, touch: float, target: ObjectPose) -> Float:
    """Weighted gap (c,) mm between the object under a target and a surface at rest, along the object's normal."""
    x, y = where.samples[:, 0], where.samples[:, 1]
    z = where.samples[:, 2] if where.samples.shape[1] == 3 else np.zeros_like(x)
    height = model.object.height(x - target.slide_x_mm, z - target.slide_z_mm)
    vertical = height + touch - target.depth_mm - y
    upright = -model.object.frame(where.samples.shape[1])[0, 1]
    there = np.isfinite(vertical)
    if there.all():
        return np.asarray(where.average @ vertical) * upright
    # Beside the object there is no gap: a point's mean is over what the object covers, if that is half of its hat.
    share = np.asarray(where.average @ there)
    mean = np.asarray(where.average @ np.where(there, vertical, 0.0)) / np.maximum(share, _COVERED)
    return np.where(share < _COVERED, _BESIDE * model.design.height_mm, mean * upright)


def scatter_to_points(rows: Float, kept: NDArray[np.int64], count: int, dim: int) -> Float:
    """Compliance (c, d, c, d) of contact points from that of the condensed rows (r, r), of which they are the first.

    A point on a symmetry plane cannot move across it: that direction is left uncoupled, and never sees a force.
    """
    own = rows[: len(kept), : len(kept)]
    out = np.diag(np.full(count * dim, np.diagonal(own).max()))
    out[np.ix_(kept, kept)] = own
    return out.reshape(count, dim, count, dim)


def reflect_into_part(point: Float, direction: Float, axes: tuple[str, ...], dim: int) -> tuple[Float, Float]:
    """A place and a direction (3,) in the meshed part (d,), reflected back where they lie in a mirror image."""
    sign = np.array([-1.0 if a in axes and v < 0.0 else 1.0 for a, v in zip("xyz", point, strict=True)])
    return (point * sign)[:dim], (direction * sign)[:dim]


def targets(legs: tuple[Leg, ...]) -> list[ObjectPose]:
    """Every increment of the legs, the start not among them."""
    out: list[ObjectPose] = []
    at = ObjectPose(0.0)
    for leg in legs:
        count = leg.steps if isinstance(leg.steps, int) else AUTO_START
        end = ObjectPose(leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm, at.time_s + (leg.duration_s or 0.0))
        out += [between(at, end, k / count) for k in range(1, count)] + [end]
        at = end
    return out


def between(a: ObjectPose, b: ObjectPose, share: float) -> ObjectPose:
    """The target a share of the way from a to b."""
    values = [u + share * (v - u) for u, v in zip(values_of(a), values_of(b), strict=True)]
    return ObjectPose(*values)


def values_of(t: ObjectPose) -> tuple[float, float, float, float]:
    """Depth, slides and time."""
    return t.depth_mm, t.slide_x_mm, t.slide_z_mm, t.time_s
