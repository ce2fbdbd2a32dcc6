"""The model: what is pressed, on what, how. The baseline is the paper; effects fill slots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._arrays import freeze_arrays
from finger3d._types import Float
from finger3d.contact.friction import Coulomb, FrictionLaw
from finger3d.contact.rules import RuleName
from finger3d.fem.material import Material
from finger3d.fem.simplex import Mesh
from finger3d.geometry.design import Design
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.formulation import Formulation, SmallStrain
from finger3d.mechanics.gauges import Gauge
from finger3d.objects import ContactPath, Plane, RigidObject

if TYPE_CHECKING:
    from finger3d.mechanics.problem import Problem

Domain = Literal["solid", "plane-strain", "plane-stress"]


@dataclass(frozen=True)
class Leg:
    """A target reached from the one before, in equal steps; "auto": as many as `finger3d.mechanics.step_halving`
    chooses.

    A scene's default is "auto"; a leg made in Python has 10.
    """

    depth_mm: float
    slide_x_mm: float = 0.0
    slide_z_mm: float = 0.0
    steps: int | Literal["auto"] = 10
    duration_s: float | None = None


@dataclass(frozen=True)
class MeshOptions:
    """Edge lengths at the contact and far from it (mm), and the mesher (solids only; sections are structured).

    `layers` is the least number of layers of a swept mesh over half the width; one layer cannot follow the bulge of a
    free end.
    """

    size_mm: float
    base_size_mm: float
    mesher: Literal["ftetwild", "swept"] = "ftetwild"
    layers: int = 2

    def as_table(self) -> dict[str, float | str]:
        """The keys of ``[mesh]`` in a scene."""
        return {"size_mm": self.size_mm, "base_size_mm": self.base_size_mm, "mesher": self.mesher}


@dataclass(frozen=True)
class EmbeddedBars:
    """Stiff things laid into a meshed part, cut into bars.

    Attributes
    ----------
    rows : (s, n d) sparse
        Strain of every bar from displacements.
    bar_stiffness : (s,) N mm, their stiffness in the part
    gauge_weights : (g, s) what each of the model's gauges reads of them
    self_compliance : (s, s) 1/(N mm)
        How the bars unload themselves and each other, in a body without end; in place of what the mesh says.
    """

    rows: sp.csr_matrix
    bar_stiffness: Float
    gauge_weights: Float
    self_compliance: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def subgrid_compliance(self, compliance: Float) -> Float:
        """What rows of gauges and bars yield (g + s, g + s) beyond the mesh, from its compliance (s, s) of bars."""
        both = np.vstack([self.gauge_weights, np.eye(len(self.bar_stiffness))])
        return both @ (self.self_compliance - compliance) @ both.T


class Inclusions(Protocol):
    """Stiff things in the body that need no mesh of their own."""

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost that the inclusions add."""
        ...

    def mirrors(self, model: Model) -> frozenset[str]:
        """Planes, "x" and "z", about which they are mirror images."""
        ...

    def discretise(self, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> EmbeddedBars:
        """Cut them into bars."""
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
    """Everything that determines the numbers.

    Attributes
    ----------
    design : a frozen dataclass from geometries/
    domain : solid, or a 2D section; forces are always N, for the design's width
    held_ends : both end faces held in z (plane strain realised in 3D; Python only)
    symmetry : planes used, "x" and "z"; None finds them
    filled : (slot, effect) of the slots that an effect has set
    warnings : for the summary
    """

    design: Design
    material: Material
    mesh: MeshOptions
    legs: tuple[Leg, ...]
    object: RigidObject = field(default_factory=Plane)
    friction: FrictionLaw = field(default_factory=Coulomb)
    formulation: Formulation = field(default_factory=SmallStrain)
    gauges: tuple[Gauge, ...] = ()
    inclusions: Inclusions | None = None
    object_compliance: ObjectCompliance | None = None
    domain: Domain = "solid"
    rule: RuleName = "projection"
    held_ends: bool = False
    symmetry: tuple[str, ...] | None = None
    filled: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def contact_path(self) -> ContactPath:
        """The object's way into the finger."""
        return contact_path(self.design, self.object, self.legs, self.domain)


def contact_path(design: Design, obj: RigidObject, legs: tuple[Leg, ...], domain: Domain) -> ContactPath:
    """Return an object's way into a finger, by the quarters of every leg."""
    at, targets = np.zeros(3), []
    for leg in legs:
        end = np.array([leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm])
        targets += [at + share * (end - at) for share in (0.25, 0.5, 0.75, 1.0)]
        at = end
    return ContactPath(
        top=design.top,
        object=obj,
        half_length_mm=design.half_length_mm,
        half_width_mm=design.width_mm / 2.0 if domain == "solid" else 0.0,
        targets=np.array(targets),
        landmarks=design.landmarks(),
    )
