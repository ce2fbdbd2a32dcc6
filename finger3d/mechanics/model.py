"""The model of a press: finger, object, path and friction.  The default is that of Maeno 2004; effects fill slots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, freeze_arrays
from finger3d.contact.friction import Coulomb, FrictionLaw
from finger3d.contact.rules import RuleName
from finger3d.fem.bars import Bars
from finger3d.fem.material import RIGID_RATIO, Isotropic, Material
from finger3d.fem.simplex import Mesh
from finger3d.geometry.design import Design
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.formulation import Formulation
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.readings import Marker, Reading, Taxel
from finger3d.mechanics.relaxation import Relaxation
from finger3d.mechanics.small_strain import SmallStrain
from finger3d.meshing.grading import Grading
from finger3d.meshing.options import Mesher
from finger3d.objects import ContactPath, ObjectPose, Plane, RigidObject, between

if TYPE_CHECKING:
    from finger3d.mechanics.problem import Problem

Domain = Literal["solid", "plane-strain", "plane-stress"]


@dataclass(frozen=True)
class Leg:
    """Straight part of the path of the object, from the end of the leg before, in equal increments.

    With a `force_N` the increments are equal in the normal force, which determines the depth; `depth_mm` is a forecast.

    With ``steps = "auto"`` their number is chosen by the estimated error (`finger3d.mechanics.step_halving`).  This is
    the default of a scene; a leg made in Python has 10.
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

    @property
    def moves_sideways(self) -> bool:
        """Whether the object is slid or turned at its end."""
        return any((self.slide_x_mm, self.slide_z_mm, self.turn_x, self.turn_y, self.turn_z))

    def end(self, start: ObjectPose) -> ObjectPose:
        """Return the pose at the end of the leg, which begins at `start`."""
        time_s = start.time_s + (self.duration_s or 0.0)
        return ObjectPose(
            self.depth_mm, self.slide_x_mm, self.slide_z_mm, time_s, self.turn_x, self.turn_y, self.turn_z
        )


@dataclass(frozen=True)
class MeshOptions:
    """Edge lengths at the contact and far from it (mm), and the mesher (solids only; sections are structured).

    `layers` is the least number of layers of a swept mesh over half the width; one layer cannot follow the bulge of a
    free end.  `grading` prescribes edge lengths inside the body, as a refinement towards a goal finds them.
    `gauge_refinement` is the edge length at the contact over that around gauges and on the contact face close to them;
    at 1 the mesh is not refined.  `refined_gauges` are the names of the gauges concerned; empty for all.
    """

    size_mm: float
    base_size_mm: float
    mesher: Mesher = "ftetwild"
    layers: int = 2
    grading: Grading | None = None
    gauge_refinement: float = 1.0
    refined_gauges: tuple[str, ...] = ()

    def as_table(self) -> dict[str, float | str]:
        """The keys of ``[mesh]`` in a scene."""
        sizes: dict[str, float | str] = {"size_mm": self.size_mm, "base_size_mm": self.base_size_mm}
        finer = {} if self.gauge_refinement == 1.0 else {"gauge_refinement": self.gauge_refinement}
        return sizes | finer | {"mesher": self.mesher}


@dataclass(frozen=True)
class EmbeddedBars:
    """Stiff inclusions of a meshed part, divided into bars.

    Attributes
    ----------
    directions : (s, d) unit vectors
    relative : (s d, n d) sparse, 1/mm
        Displacement of one end of every bar relative to the other, over its length.
    bar_stiffness : (s,) array, N mm
        Stiffness of the bars that belongs to the part.
    gauge_weights : (g, s) array
        Strain of each gauge of the model from the strains of the bars.
    self_compliance : (s, s) array, 1/(N mm)
        Strain of the bars per unit force of the bars in an infinite body; it replaces that of the mesh, which does not
        resolve a bar.
    """

    directions: Float
    relative: sp.csr_matrix
    bar_stiffness: Float
    gauge_weights: Float
    self_compliance: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def rows(self) -> sp.csr_matrix:
        """Rows (s, n d) of the bars' strains from small displacements."""
        count, d = self.directions.shape
        along = sp.csr_matrix((self.directions.ravel(), np.arange(count * d), np.arange(count + 1) * d))
        return sp.csr_matrix(along @ self.relative)

    def at_finite_strain(self, yielding: Float) -> Bars:
        """Return the bars at finite strain, with a compliance (s, s) of their surroundings that the mesh lacks."""
        return Bars(self.directions, self.relative, self.bar_stiffness, yielding)

    def subgrid_compliance(self, compliance: Float) -> Float:
        """Return the compliance (g + s, g + s) of gauges and bars that the mesh lacks, from its compliance (s, s)."""
        both = np.vstack([self.gauge_weights, np.eye(len(self.bar_stiffness))])
        return both @ (self.self_compliance - compliance) @ both.T


class Inclusions(Protocol):
    """Stiff inclusions of the body that need no mesh of their own."""

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost that the inclusions add."""
        ...

    def mirrors(self, model: Model) -> frozenset[str]:
        """Return the planes, "x" and "z", about which the inclusions are symmetric."""
        ...

    def discretise(self, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> EmbeddedBars:
        """Divide the inclusions into bars."""
        ...


@dataclass(frozen=True)
class ObjectResponse:
    """Elastic response of the object at the contact points.

    Attributes
    ----------
    compliance : (c, d, c, d) array, mm/N
        Zero in the directions that symmetry holds.
    factorizations : int
    seconds : time of each stage by name
    """

    compliance: Float
    factorizations: int
    seconds: dict[str, float]

    def __post_init__(self) -> None:
        freeze_arrays(self)


class ObjectCompliance(Protocol):
    """An elastic object."""

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost that the object's elasticity adds."""
        ...

    def respond(
        self, problem: Problem, zone: tuple[float, float, float, float], say: Callable[[str], None]
    ) -> ObjectResponse:
        """Return the response at the contact points of a problem.

        Parameters
        ----------
        zone : (x_min, x_max, z_min, z_max), mm
            Where the object touches the finger; its mesh is fine there.
        """
        ...


@dataclass(frozen=True)
class Model:
    """Body, object, path, friction and effects of a press: everything that determines its numbers.

    Attributes
    ----------
    design : a frozen dataclass from geometries/
    domain : solid, or a 2D section; forces are always N, for the design's width
    strain_measure : small strain, or finite strain with a hyperelastic law
    relaxation : of the moduli; None without viscosity
    held_ends : both end faces held in z (plane strain realised in 3D; Python only)
    symmetry : symmetry planes that are used, "x" and "z"; None determines them
    parts : label and material of every solid of the design whose material is another
    filled : slots that an effect has set, as pairs (slot, effect)
    warnings : entries of the summary
    """

    design: Design
    material: Material
    mesh: MeshOptions
    legs: tuple[Leg, ...]
    object: RigidObject = field(default_factory=Plane)
    friction: FrictionLaw = field(default_factory=Coulomb)
    strain_measure: Formulation = field(default_factory=SmallStrain)
    relaxation: Relaxation | None = None
    gauges: tuple[Gauge, ...] = ()
    markers: tuple[Marker, ...] = ()
    taxels: tuple[Taxel, ...] = ()
    other_readings: tuple[Reading, ...] = ()
    inclusions: Inclusions | None = None
    object_compliance: ObjectCompliance | None = None
    domain: Domain = "solid"
    rule: RuleName = "projection"
    held_ends: bool = False
    symmetry: tuple[str, ...] | None = None
    parts: tuple[tuple[str, Material], ...] = ()
    filled: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def formulation(self) -> Formulation:
        """Strain measure and material response of the body."""
        return self.strain_measure if self.relaxation is None else self.strain_measure.relaxing(self.relaxation)

    @property
    def mixed(self) -> bool:
        """Whether the pressure is an unknown of its own: one of the materials is nearly incompressible."""
        materials = (self.material, *(material for _, material in self.parts))
        return self.domain != "plane-stress" and any(material.is_nearly_incompressible for material in materials)

    def materials(self, labels: Sequence[str]) -> tuple[Material, ...]:
        """Return the material of the main body, and those of the parts with these labels."""
        own = dict(self.parts)
        return (self.material, *(own.get(label, self.material) for label in labels))

    @property
    def readings(self) -> tuple[Reading, ...]:
        """All readings, in the order of their rows; gauges come last, next to the rows of inclusions."""
        return (*self.markers, *self.taxels, *self.other_readings, *self.gauges)

    @property
    def reading_names(self) -> tuple[str, ...]:
        """Name of every number that is read."""
        dim = 3 if self.domain == "solid" else 2
        return tuple(name for reading in self.readings for name in reading.columns(dim))

    @property
    def forces_scale_with_modulus(self) -> bool:
        """Whether all forces are proportional to Young's modulus, and no displacement depends on it."""
        return self.stresses_scale_with_modulus and all(leg.force_N is None for leg in self.legs)

    @property
    def stresses_scale_with_modulus(self) -> bool:
        """Whether all stresses at given displacements are proportional to Young's modulus of the finger."""
        own, parts = self.material, [material for _, material in self.parts]
        rigid = all(
            isinstance(own, Isotropic) and isinstance(part, Isotropic) and part.E_MPa == RIGID_RATIO * own.E_MPa
            for part in parts
        )
        return rigid and self.inclusions is None and self.object_compliance is None

    @property
    def ends_at_force(self) -> bool:
        """Whether the last leg ends at a prescribed force, so that the depth is unknown."""
        return self.legs[-1].force_N is not None

    @property
    def largest_depth_mm(self) -> float:
        """Depth of the deepest leg."""
        return max(leg.depth_mm for leg in self.legs)

    @property
    def contact_path(self) -> ContactPath:
        """The object and its path into the finger."""
        return contact_path(self.design, self.object, self.legs, self.domain, self.object_compliance is None)


def contact_path(
    design: Design, obj: RigidObject, legs: tuple[Leg, ...], domain: Domain, rigid: bool = True
) -> ContactPath:
    """Return an object and its path into a finger, with poses at the quarters of every leg.

    An elastic object, which is not `rigid`, touches the contact face only.
    """
    at, poses = ObjectPose(0.0), list[ObjectPose]()
    for leg in legs:
        end = leg.end(at)
        poses += [between(at, end, share) for share in (0.25, 0.5, 0.75, 1.0)]
        at = end
    return ContactPath(
        top=design.top,
        object=obj,
        half_length_mm=design.half_length_mm,
        half_width_mm=design.width_mm / 2.0 if domain == "solid" else 0.0,
        poses=tuple(poses),
        landmarks=design.landmarks(),
        walls_touch=rigid,
    )
