"""The model of a press: finger, object, path and friction.  The default is that of Maeno 2004; effects fill slots."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Literal

from finger3d.contact.friction import Coulomb, FrictionLaw
from finger3d.contact.solve import STEP_DEPENDENT_RULES, RuleName
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.geometry.design import Design
from finger3d.mechanics.readings import Column, Gauge, Marker, Reading, Taxel
from finger3d.meshing.sizing import MeshOptions
from finger3d.objects import (
    ContactPath,
    FirstTouch,
    InitialContact,
    Move,
    ObjectPose,
    Plane,
    RigidObject,
    first_touch,
    initial_contact,
)

Domain = Literal["solid", "plane-strain", "plane-stress"]


@dataclass(frozen=True)
class Leg:
    """Straight part of the path of the object, from the end of the leg before, in equal increments.

    With a `force_N` the increments are equal in the normal force, which determines the depth; `depth_mm` is a forecast.
    Likewise `force_x_N` and `force_z_N`, the forces applied to the object along x and z, determine the slides, and
    `moment_x_Nmm`, `moment_y_Nmm` and `moment_z_Nmm`, about its reference point, the turns.  In equilibrium they are
    those of the contact force on the finger.  Between two fingers `force_N` is the sum of both normal forces, and
    `force_y_N` the force on the object from one towards the other.

    With ``steps = "auto"`` their number is chosen by the estimated error (`finger3d.mechanics.march.step_halving`).
    This is the default of a scene; a leg made in Python has 10.  `turn_x`, `turn_y` and `turn_z` are in radians; a
    scene gives them in degrees.
    """

    depth_mm: float
    slide_x_mm: float = 0.0
    slide_z_mm: float = 0.0
    steps: int | Literal["auto"] = 10
    duration_s: float | None = None
    turn_x: float = 0.0
    turn_y: float = 0.0
    turn_z: float = 0.0
    force_N: float | None = None
    force_x_N: float | None = None
    force_z_N: float | None = None
    moment_x_Nmm: float | None = None
    moment_y_Nmm: float | None = None
    moment_z_Nmm: float | None = None
    force_y_N: float | None = None

    @property
    def forces(self) -> tuple[float | None, ...]:
        """Forces (N) and moments (N mm) in place of depth, slides, turns and rise, or None where none is prescribed."""
        moments = self.moment_x_Nmm, self.moment_y_Nmm, self.moment_z_Nmm
        return self.force_N, self.force_x_N, self.force_z_N, *moments, self.force_y_N

    @property
    def is_under_force(self) -> bool:
        """Whether a force is prescribed, so that the pose at the end is unknown."""
        return any(force is not None for force in self.forces)

    @property
    def moves_sideways(self) -> bool:
        """Whether the object is slid or turned at its end."""
        moved = self.slide_x_mm, self.slide_z_mm, self.turn_x, self.turn_y, self.turn_z
        return any(moved) or any(force is not None for force in self.forces[1:6])

    def end(self, start: ObjectPose) -> ObjectPose:
        """Return the pose at the end of the leg, which begins at `start`."""
        time_s = start.time_s + (self.duration_s or 0.0)
        return ObjectPose(
            self.depth_mm, self.slide_x_mm, self.slide_z_mm, time_s, self.turn_x, self.turn_y, self.turn_z
        )


def ways(legs: Iterable[Leg]) -> Iterator[tuple[Leg, Move]]:
    """Yield each leg of a path with the motion from its start to its end."""
    start = ObjectPose(0.0)
    for leg in legs:
        end = leg.end(start)
        yield leg, Move(start, end)
        start = end


@dataclass(frozen=True)
class Foils:
    """Foils along the gauges of a model: Young's modulus (MPa) and section (mm).

    `patches` are the divisions of a foil along and across, in a section and in a solid; the default is within half a
    percent of finer divisions.
    """

    E_MPa: float
    thickness_mm: float
    width_mm: float
    patches: tuple[tuple[int, int], tuple[int, int]] = ((16, 1), (12, 8))


@dataclass(frozen=True)
class ElasticObject:
    """Material of an elastic object: Young's modulus (MPa), Poisson's ratio, and height (mm) of a block."""

    E_MPa: float
    nu: float
    height_mm: float | None = None


@dataclass(frozen=True)
class Model:
    """Body, object, path, friction and effects of a press: everything that determines its numbers.

    Attributes
    ----------
    design : a frozen dataclass from geometries/
    domain : solid, or a 2D section; forces are always N, for the design's width
    hyperelastic_law : isochoric part of the energy, with a shear modulus of 1 MPa; None in small strain
    relaxation : of the moduli; None without viscosity
    inclusions : stiff foils along the gauges; None if gauges have no stiffness
    object_compliance : material of an elastic object; None if it is rigid
    held_ends : both end faces held in z (plane strain realised in 3D; Python only)
    symmetry : symmetry planes that are used, "x" and "z"; None determines them
    centre_of_mass_mm : of an object held between two fingers, from its middle; None: one finger presses the object
    parts : label and material of every solid of the design whose material is another
    filled : slots that an effect has set, as pairs (slot, effect)
    warnings : entries of the summary
    """

    design: Design
    material: Isotropic
    mesh: MeshOptions
    legs: tuple[Leg, ...]
    object: RigidObject = field(default_factory=Plane)
    friction: FrictionLaw = field(default_factory=Coulomb)
    hyperelastic_law: IsochoricLaw | None = None
    relaxation: Relaxation | None = None
    gauges: tuple[Gauge, ...] = ()
    markers: tuple[Marker, ...] = ()
    taxels: tuple[Taxel, ...] = ()
    other_readings: tuple[Reading, ...] = ()
    inclusions: Foils | None = None
    object_compliance: ElasticObject | None = None
    domain: Domain = "solid"
    rule: RuleName = "projection"
    held_ends: bool = False
    symmetry: tuple[str, ...] | None = None
    centre_of_mass_mm: tuple[float, float, float] | None = None
    parts: tuple[tuple[str, Isotropic], ...] = ()
    filled: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def finite_strain(self) -> bool:
        """Whether the strain measure is that of finite deformation."""
        return self.hyperelastic_law is not None

    @property
    def is_linear_elastic(self) -> bool:
        """Whether strain is linear and the displacements follow from the present contact forces alone."""
        return self.hyperelastic_law is None and self.relaxation is None

    @property
    def refactorises(self) -> bool:
        """Whether increments factor the stiffness again; presses of such a body run one after another.

        In small strain they do so if the shear modulus alone relaxes: every length of time step has its own factor.
        """
        return self.finite_strain or (self.relaxation is not None and not self.relaxation.bulk)

    @property
    def is_defined_by_increments(self) -> bool:
        """Whether the solution is that of the increments as they are: by the paper's rule, or with mu_k < mu_s."""
        return self.rule in STEP_DEPENDENT_RULES or self.friction.is_defined_by_increments

    @property
    def begins_in_parts(self) -> bool:
        """Whether an increment in which contact begins is solved in parts.

        Where a body relaxes in small strain, a part has a share of the depth, not of a prescribed force, and in a solid
        without bulk relaxation it costs a factorisation.
        """
        if self.relaxation is None or self.finite_strain:
            return not self.is_defined_by_increments
        costs = self.is_under_force or (self.domain == "solid" and self.refactorises)
        return not (self.is_defined_by_increments or costs)

    @property
    def mixed(self) -> bool:
        """Whether the pressure is an unknown of its own: one of the materials is nearly incompressible."""
        materials = (self.material, *(material for _, material in self.parts))
        return self.domain != "plane-stress" and any(material.is_nearly_incompressible for material in materials)

    def materials(self, labels: Sequence[str]) -> tuple[Isotropic, ...]:
        """Return the material of the main body, and those of the parts with these labels."""
        own = dict(self.parts)
        return (self.material, *(own.get(label, self.material) for label in labels))

    @property
    def readings(self) -> tuple[Reading, ...]:
        """All readings, in the order of their rows; gauges come last, next to the rows of inclusions."""
        return (*self.markers, *self.taxels, *self.other_readings, *self.gauges)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Column of every number that is read, in the order of the rows."""
        dim = 3 if self.domain == "solid" else 2
        return tuple(column for reading in self.readings for column in reading.columns(dim))

    @property
    def forces_scale_with_modulus(self) -> bool:
        """Whether all forces are proportional to Young's modulus, and no displacement depends on it."""
        return self.stresses_scale_with_modulus and not self.is_under_force

    @property
    def stresses_scale_with_modulus(self) -> bool:
        """Whether all stresses at given displacements are proportional to Young's modulus of the finger."""
        rigid = all(part.E_MPa == RIGID_RATIO * self.material.E_MPa for _, part in self.parts)
        return rigid and self.inclusions is None and self.object_compliance is None

    @property
    def is_under_force(self) -> bool:
        """Whether a force is prescribed in any leg."""
        return any(leg.is_under_force for leg in self.legs)

    @property
    def ends_at_force(self) -> bool:
        """Whether the last leg ends at a prescribed force, so that the depth is unknown."""
        return self.legs[-1].force_N is not None

    @property
    def largest_depth_mm(self) -> float:
        """Depth of the deepest leg."""
        return max(leg.depth_mm for leg in self.legs)

    @cached_property
    def first_contact(self) -> InitialContact:
        """Where the rigid object touches first, and the box over which it would overlap the finger at rest."""
        return first_contact(self.design, self.object, self.legs, self.domain, self.object_compliance is None)

    @property
    def contact_path(self) -> ContactPath:
        """The object and its path into the finger."""
        return contact_path(self.design, self.object, self.legs, self.domain, self.object_compliance is None)


def first_contact(
    design: Design, obj: RigidObject, legs: tuple[Leg, ...], domain: Domain, rigid: bool = True
) -> InitialContact:
    """Return the first touch on a path, which models on other meshes and with other effects have in common."""
    return _first_contact(design, obj, tuple(replace(leg, steps=1, duration_s=None) for leg in legs), domain, rigid)


@lru_cache(maxsize=64)
def _first_contact(
    design: Design, obj: RigidObject, legs: tuple[Leg, ...], domain: Domain, rigid: bool
) -> InitialContact:
    return initial_contact(contact_path(design, obj, legs, domain, rigid), _first_touch(design, obj, domain))


@lru_cache(maxsize=64)
def _first_touch(design: Design, obj: RigidObject, domain: Domain) -> FirstTouch:
    return first_touch(contact_path(design, obj, (), domain))


def contact_path(
    design: Design, obj: RigidObject, legs: tuple[Leg, ...], domain: Domain, rigid: bool = True
) -> ContactPath:
    """Return an object and its path into a finger, with poses at the quarters of every leg.

    An elastic object, which is not `rigid`, touches the contact face only.
    """
    poses, by_force = list[ObjectPose](), list[ObjectPose]()
    for leg, way in ways(legs):
        on_leg = [way.at(share) for share in (0.25, 0.5, 0.75, 1.0)]
        poses += on_leg
        by_force += on_leg if leg.force_N is not None else []
    return ContactPath(
        top=design.top,
        object=obj,
        half_length_mm=design.half_length_mm,
        half_width_mm=design.width_mm / 2.0 if domain == "solid" else 0.0,
        poses=tuple(poses),
        by_force=tuple(by_force),
        landmarks=design.landmarks(),
        walls_touch=rigid,
    )
