"""The discretised press: meshed part, symmetry and contact system."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from finger3d._cost import PressSize
from finger3d._types import Float, freeze_arrays
from finger3d.contact.newton import uniqueness
from finger3d.contact.state import ContactState
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Stiffness
from finger3d.fem.embedded import AddedStiffness
from finger3d.fem.laws.material import LinearElasticity, moduli_of
from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.fem.recovery import strain_and_stress
from finger3d.fem.solvers.condense import Condensation
from finger3d.fem.surface import BoundarySurface, joined, surface
from finger3d.mechanics.discretise.contact_points import ContactPoints, contact_geometry, may_touch
from finger3d.mechanics.discretise.symmetry import Symmetry
from finger3d.mechanics.model import Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.readings import Column, MeshedBody
from finger3d.meshing.limits import MeshReport
from finger3d.objects import ObjectPose, PlacedObject, SecondFinger, vertical_frame

_AT_ONCE = 8_000_000  # unknowns solved for at once: 64 MB, and a few times as much in between


@dataclass(frozen=True, kw_only=True)
class CondensedBody:
    """Meshed part of the finger, assembled and condensed to its contact points, readings and inclusions.

    Attributes
    ----------
    thickness : mm, the width of a section, 1 for a solid
    fixed_dofs : numbers of the unknowns that are zero
    condensed : the body without its inclusions
    """

    mesh: Mesh
    report: MeshReport
    elastic: LinearElasticity
    stiffness: Stiffness
    thickness: float
    fixed_dofs: NDArray[np.int64]
    condensed: Condensation

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class MeshedObject:
    """Mesh of an elastic object.

    Attributes
    ----------
    is_whole : whether it is meshed whole although only a part of the finger is
    """

    mesh: Mesh
    is_whole: bool


@dataclass(frozen=True, kw_only=True)
class ContactSystem:
    """Body and object, seen at the candidate contact points (c points of the meshed part, m of the whole finger).

    Attributes
    ----------
    surface : the candidate points
    points : the contact points of the whole finger
    delassus : (c, d, c, d) mm/N, in the directions of an upright object
    reading_rows : (g, c d) readings per N, in the same directions
    active_dofs : (r,) directions among c d that the condensed rows stand for
    first_contact_mm : height of the object's lowest point at first touch
    place_mm : (x, z) of first touch, if the finger's surface is known
    object_factorizations : factorisations of an elastic object
    object_compliance : (c, d, c, d) mm/N, the part of an elastic object in `delassus`; None if it is rigid
    object_share : (c,) share of an elastic object in the normal compliance of each point; None if it is rigid
    object_mesh : of an elastic object
    second : the finger that faces the first one, where both are pressed at once
    """

    surface: BoundarySurface
    points: ContactPoints
    delassus: Float
    reading_rows: Float
    active_dofs: NDArray[np.int64]
    first_contact_mm: float
    place_mm: tuple[float, float] | None = None
    object_factorizations: int = 0
    object_compliance: Float | None = None
    object_share: Float | None = None
    object_mesh: MeshedObject | None = None
    second: SecondFinger | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Discretised press: the model, the meshed part, its symmetry, and the contact system.

    Attributes
    ----------
    condensed_body : the meshed part; None in a reduced model, which knows the contact system only
    inclusions : stiffness that inclusions add; empty without
    seconds : time of each stage of the build by name
    without_inclusions : the same problem without inclusions, if there are any
    """

    model: Model
    condensed_body: CondensedBody | None
    symmetry: Symmetry
    system: ContactSystem
    inclusions: AddedStiffness = field(default_factory=AddedStiffness)
    seconds: dict[str, float] = field(default_factory=dict)
    without_inclusions: Problem | None = None

    @property
    def body(self) -> CondensedBody:
        """The meshed part of the finger, condensed.

        Raises
        ------
        Finger3dError
            If the problem is a reduced model.
        """
        if self.condensed_body is None:
            raise Finger3dError("a reduced model has no mesh: fields need the scene itself (finger3d press)")
        return self.condensed_body

    @property
    def mesh(self) -> Mesh:
        """Mesh of the part."""
        return self.body.mesh

    @property
    def surface(self) -> BoundarySurface:
        """Candidate contact points of the part."""
        return self.system.surface

    @property
    def points(self) -> ContactPoints:
        """Contact points of the whole finger."""
        return self.system.points

    @property
    def delassus(self) -> Float:
        """Compliance (c, d, c, d) mm/N of the contact points."""
        return self.system.delassus

    @property
    def axes(self) -> tuple[str, ...]:
        """Normals of the symmetry planes."""
        return self.symmetry.axes

    @property
    def factorizations(self) -> int:
        """Number of factorisations of the build; a press counts its own in its workspace."""
        return self.body.condensed.factorizations + self.system.object_factorizations

    @property
    def size(self) -> PressSize:
        """Size of the meshed part, from which times are modelled."""
        return PressSize(self.dim, self.body.stiffness.upper.shape[0], len(self.surface.nodes))

    @property
    def origin(self) -> ObjectPose:
        """Pose at first touch, where every path begins."""
        return ObjectPose(0.0)

    @property
    def dim(self) -> int:
        """Space dimensions."""
        return self.system.points.dim

    def placed(self, pose: ObjectPose) -> PlacedObject:
        """Return the object in a pose."""
        return PlacedObject.of(self.model.object, self.system.first_contact_mm, pose, self.system.second)

    def gap(
        self, target: ObjectPose, surface: BoundarySurface | None = None, displacement: Float | None = None
    ) -> Float:
        """Gap (c,) mm of a surface's points, the candidates unless given, at rest or displaced by (c, d) mm."""
        where = surface or self.system.surface
        return contact_geometry(self.placed(target).distance, where, displacement, self.axes).gap

    def upright_force(self, state: ContactState) -> Float:
        """Forces (c, d) N on the part's points in the directions of an upright object."""
        return np.asarray(state.scene_force @ vertical_frame(self.dim).T)

    def world_force(self, state: ContactState) -> Float:
        """Forces (m, 3) N on the whole finger's points in x, y, z, from the part's state."""
        whole = self.symmetry.unfold(state)
        return self.system.points.with_basis_of(whole).to_global(whole.force)

    def coupling(self) -> float:
        """Largest mu |K_tt^-1 K_tn| over points; above 1 a contact state need not be the only one."""
        c = len(self.system.delassus)
        blocks = self.system.delassus[np.arange(c), :, np.arange(c)]
        last = self.placed(targets(self.model.legs)[-1])
        turned = contact_geometry(last.distance, self.surface, axes=self.axes).from_reference
        return uniqueness(np.full(c, self.model.friction.largest), turned @ blocks @ turned.transpose(0, 2, 1))

    def read(self, force: Float) -> dict[Column, float]:
        """Readings by column under contact forces (c, d), through the condensed rows."""
        return dict(zip(self.model.columns, map(float, self.system.reading_rows @ force.ravel()), strict=True))

    def strain_and_stress(self, unknowns: Float) -> tuple[Float, Float]:
        """Linear strain and elastic stress (n, 3, 3), MPa, at the nodes of the part, from all unknowns (N,)."""
        part, plane_strain = self.body, self.model.domain == "plane-strain"
        materials = self.model.materials(self.mesh.part_labels)
        laws = [material.elasticity(self.model.domain == "plane-stress", part.elastic.mixed) for material in materials]
        across = None if self.dim == 3 else [partial(m.across, plane_strain=plane_strain) for m in materials]
        return strain_and_stress(self.mesh, unknowns, laws, part.stiffness.pressure_scale, across)

    @property
    def meshed_body(self) -> MeshedBody:
        """The meshed part as readings see it."""
        return MeshedBody(self.mesh, self.axes, self.body.stiffness, self.body.thickness, moduli_of(self.body.elastic))

    def row_forces(self, force: Float) -> Float:
        """Forces on the condensed rows from contact forces (c, d); none on the rows of readings and inclusions."""
        rows = np.zeros(len(self.body.condensed.compliance))
        rows[: len(self.system.active_dofs)] = force.ravel()[self.system.active_dofs]
        return rows

    def unknowns(self, force: Float) -> Float:
        """All unknowns (N,) of the part's body under contact forces (c, d)."""
        return self.unknowns_of_rows(self.row_forces(force))

    def unknowns_of(self, forces: Sequence[Float]) -> Iterator[Float]:
        """All unknowns (N,) for each of several forces (c, d), by solutions for many at once."""
        at_once = max(1, _AT_ONCE // self.body.stiffness.upper.shape[0])
        for first in range(0, len(forces), at_once):
            rows = np.stack([self.row_forces(force) for force in forces[first : first + at_once]], axis=1)
            yield from self.unknowns_of_rows(rows).T

    def unknowns_of_rows(self, rows: Float) -> Float:
        """All unknowns (N, ...) under forces (r, ...) on the condensed rows; springs add theirs."""
        condensed = self.body.condensed
        return condensed.unknowns(self.inclusions.with_spring_forces(condensed.compliance, rows))


def free_surface(model: Model, mesh: Mesh, thickness: float) -> BoundarySurface:
    """Return the points of all faces that may touch the object; an elastic one touches the contact face only.

    Ends that are held do not move towards it.
    """
    labels: tuple[str, ...] = FREE_FACES if model.object_compliance is None else FREE_FACES[:1]
    labels = tuple(label for label in labels if not (label == "ends" and model.held_ends))
    return joined([surface(mesh, label, thickness) for label in labels if len(mesh.facets.get(label, ()))])


def rigid_gap(placed: PlacedObject, surface: BoundarySurface) -> Float:
    """Gap (c,) mm between an object in a pose and the points of a surface at rest; inf where they cannot touch."""
    geometry = contact_geometry(placed.distance, surface)
    return np.where(may_touch(surface, geometry.bases[:, 0]), geometry.gap, np.inf)


def scatter_to_points(rows: Float, kept: NDArray[np.int64], count: int, dim: int) -> Float:
    """Compliance (c, d, c, d) of contact points from that of the condensed rows (r, r), of which they are the first.

    A point on a symmetry plane cannot move across it: that direction is not coupled, and its force is always zero.
    """
    block = rows[: len(kept), : len(kept)]
    out = np.diag(np.full(count * dim, np.diagonal(block).max()))
    out[np.ix_(kept, kept)] = block
    return out.reshape(count, dim, count, dim)


def under_pressure(surface: BoundarySurface, compliance: Float) -> Float:
    """Return the normal displacement (c,) mm under a uniform pressure of 1 MPa, by a compliance (c, d, c, d) mm/N."""
    return np.asarray(compliance[:, 0, :, 0] @ surface.area)


def object_share(finger: Float, thing: Float) -> Float:
    """Return the share (c,) of an elastic object in the normal displacements (c,) of both under uniform pressure."""
    return np.asarray(np.clip(thing / (finger + thing), 0.0, 1.0))
