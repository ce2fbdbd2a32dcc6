"""The tables of a scene file, checked strictly: no unknown key, no conversion of types, no NaN, no infinity."""

from __future__ import annotations

import dataclasses
import functools
import math
import types
import typing
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from annotated_types import Ge, Gt, Interval, Le, Lt, MinLen
from pydantic import BaseModel, ConfigDict, create_model

from finger3d._ranges import (
    Angle,
    Count,
    Edge,
    Force,
    Friction,
    Length,
    Mass,
    Modulus,
    Name,
    Place,
    Poisson,
    Radians,
    Scale,
    Seconds,
    Shore,
    SignedForce,
    Title,
    Zero,
)
from finger3d._types import Tree
from finger3d.contact.solve import RuleName
from finger3d.materials.modulus import MODULUS_KEYS, ElasticConstants, elastic_constants
from finger3d.mechanics.model import Domain
from finger3d.meshing.sizing import Mesher

Record = TypeVar("Record")
Steps = Count | Literal["auto"]
LARGEST = 1e12
"""Largest magnitude of a number of a design or an effect that states no bound of its own."""


class TomlTable(BaseModel):
    """A TOML table. Lists arrive as tuples (see `finger3d.scene.tree.read`), so that strictness can stay on."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class ElasticTable(TomlTable):
    """Keys that give elastic constants: exactly one for Young's modulus (see `finger3d.scene.material`), and nu.

    Attributes
    ----------
    E_MPa : Young's modulus
    shore_A : in place of E_MPa: Shore A hardness
    shore_00 : in place of E_MPa: Shore 00 hardness
    silicone : in place of E_MPa: a silicone of the table in docs/materials.md, such as "Dragon Skin 20"
    nu : Poisson's ratio, 0.5 included; required with E_MPa, else 0.49
    """

    needed: ClassVar[str] = "E_MPa, nu, or with shore_A, shore_00 or silicone"

    E_MPa: Modulus | None = None
    shore_A: Shore | None = None
    shore_00: Shore | None = None
    silicone: Name | None = None
    nu: Poisson | None = None

    @property
    def constants(self) -> ElasticConstants:
        """The elastic constants with the spread and the origin of Young's modulus."""
        return elastic_constants({key: getattr(self, key) for key in (*MODULUS_KEYS, "nu")})


class MaterialTable(ElasticTable):
    """[material]: of the finger; nu has no default beside E_MPa because the paper gives none."""


class PartTable(ElasticTable):
    """[parts.LABEL]: the solid of the finger with that label; any number of them.

    Attributes
    ----------
    rigid : true: the part keeps its shape, and takes neither a modulus nor nu
    """

    needed: ClassVar[str] = "E_MPa, nu, or with shore_A, shore_00 or silicone, or with rigid"

    rigid: bool = False


class FrictionTable(TomlTable):
    """[friction]; without it: none.

    Attributes
    ----------
    mu : friction coefficient; with kinetic_friction the static one
    """

    mu: Friction


class LegTable(TomlTable):
    """[[press.leg]]: a target that is reached from the one before; depth 0 releases the finger.

    Attributes
    ----------
    depth_mm : of the object below the first touch, less than the finger's height
    force_N : normal force, in place of the depth, which follows
    force_x_N, force_z_N : force applied to the object along x, z, in place of a slide, which follows; 0 leaves it free
    moment_x_Nmm, moment_y_Nmm, moment_z_Nmm : moment applied to the object about its lowest point, in place of a turn,
        which follows; 0 leaves it free
    slide_x_mm, slide_z_mm : where the object then is, from where it was at first
    turn_x_deg, turn_y_deg, turn_z_deg : how it then is turned about its lowest point, about x, then y, then z
    steps : equal parts of the leg; "auto": as errors of 1 % ask for
    duration_s : read only with viscosity
    """

    depth_mm: Zero | Length | None = None
    force_N: Force | None = None
    force_x_N: SignedForce | None = None
    force_z_N: SignedForce | None = None
    moment_x_Nmm: SignedForce | None = None
    moment_y_Nmm: SignedForce | None = None
    moment_z_Nmm: SignedForce | None = None
    slide_x_mm: Place = 0.0
    slide_z_mm: Place = 0.0
    turn_x_deg: Angle = 0.0
    turn_y_deg: Angle = 0.0
    turn_z_deg: Angle = 0.0
    steps: Steps = "auto"
    duration_s: Seconds | None = None


class PressTable(LegTable):
    """[press] that stands for one leg."""

    depth_mm: Length | None = None


class LegsTable(TomlTable):
    """[press] with legs."""

    leg: Annotated[tuple[LegTable, ...], MinLen(1)]


class GripTable(TomlTable):
    """[grip], in place of [press]: two fingers, mirror images of each other, hold the object, which is free.

    They close on it, then its weight acts, then any other load.

    Attributes
    ----------
    force_N : by which each finger presses on the object, kept as the weight acts
    closing_mm : in place of the force: by which each finger moves from first touch
    mass_g : of the object
    down : direction of its weight
    centre_mm : its centre of mass, from its middle
    load_N, load_Nmm : another force at the centre of mass, and a moment about it, which act after the weight
    steps : increments of each of these; "auto": as errors of 1 % ask for
    """

    force_N: Force | None = None
    closing_mm: Length | None = None
    mass_g: Mass = 0.0
    down: tuple[Place, Place, Place] = (0.0, 0.0, -1.0)
    centre_mm: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)
    load_N: tuple[SignedForce, SignedForce, SignedForce] = (0.0, 0.0, 0.0)
    load_Nmm: tuple[SignedForce, SignedForce, SignedForce] = (0.0, 0.0, 0.0)
    steps: Steps = "auto"

    @property
    def closing(self) -> PressTable:
        """The press of each finger as they close."""
        return PressTable(depth_mm=self.closing_mm, force_N=self.force_N, steps=self.steps)


class ContactTable(TomlTable):
    """[contact].

    Attributes
    ----------
    rule : how stick and slip are settled; "paper": its literal swap, which may cycle
    """

    rule: RuleName = "projection"


class DomainTable(TomlTable):
    """[model].

    Attributes
    ----------
    domain : the body in 3D, or its section; all use width_mm, so forces are always N
    """

    domain: Domain = "solid"


class MeshTable(TomlTable):
    """[mesh]: absent sizes are chosen from the finger (see `finger3d.scene.mesh_sizes`).

    Attributes
    ----------
    size_mm : edge length at the contact
    base_size_mm : edge length far from it
    gauge_refinement : edge length at the contact over that around gauges and on the contact face close to them; 1:
        gauges do not change the mesh; absent: 2 in a solid without sizes, else 1
    stick_refinement : in a press, edge length at the contact over that at the border of stick, which a press on the
        coarser mesh finds; absent: 3.5 in a solid without sizes, with friction, in small strain at given depths, else 1
    mesher : fTetWild; netgen, the same on every run, for CAD; or structured, for extruded designs
    tolerance : instead of sizes: refine until the estimated error of the goal is below it
    goal : with tolerance: the number that the mesh is refined for, such as gauge_g36 or stick_area_mm2, or "all";
        unless given the normal force, or the depth under one
    max_seconds : with tolerance: stop refining then, with the best so far
    """

    size_mm: Edge | None = None
    base_size_mm: Edge | None = None
    gauge_refinement: Annotated[float, Ge(1), Le(100)] | None = None
    stick_refinement: Annotated[float, Ge(1), Le(16)] | None = None
    mesher: Mesher = "ftetwild"
    tolerance: Annotated[float, Ge(1e-6), Lt(1)] | None = None
    goal: Name | None = None
    max_seconds: Annotated[float, Ge(1e-3), Le(1e7)] | None = None


class GaugeTable(TomlTable):
    """[[gauge]]: the strain along a direction in the x-y plane; any number of them.

    Attributes
    ----------
    name : name in the results
    x_mm, y_mm, z_mm : its middle, on the finger at rest
    angle_deg : from +x towards +y
    length_mm : above 0: the mean over that length
    """

    name: Name
    x_mm: Place
    y_mm: Place
    z_mm: Place = 0.0
    angle_deg: Angle = 0.0
    length_mm: Zero | Length = 0.0


class MarkerTable(TomlTable):
    """[[marker]]: the displacement of a material point, as a camera sees a dot; any number of them.

    Attributes
    ----------
    name : name in the results
    x_mm, y_mm, z_mm : its place on the finger at rest
    """

    name: Name
    x_mm: Place
    y_mm: Place
    z_mm: Place = 0.0


class MarkerGridTable(TomlTable):
    """[marker_grid]: markers all over the contact face.

    Attributes
    ----------
    spacing_mm : of the markers along x and z
    """

    spacing_mm: Length


class LabelsTable(TomlTable):
    """[labels]: a sweep writes fields on a regular grid of the contact face into labels.h5.

    Attributes
    ----------
    grid_mm : spacing of the grid along x and z
    increments : "last" or "all": after which increments
    """

    grid_mm: Length
    increments: Literal["last", "all"] = "last"


class TaxelTable(TomlTable):
    """[[taxel]]: the mean pressure on a rectangle of the base; any number of them.

    Attributes
    ----------
    name : name in the results
    x_mm, z_mm : its middle on the base
    length_mm : along x
    width_mm : along z; required of a solid, and not read in a section
    """

    name: Name
    x_mm: Place
    z_mm: Place = 0.0
    length_mm: Length
    width_mm: Length | None = None


class SceneTable(TomlTable):
    """The whole file. Tables whose keys depend on a name are checked afterwards, against that name's own table.

    Attributes
    ----------
    title : name of the scene in results; the file's name unless given
    material : elastic constants of the finger
    parts : other materials of solids of the finger, by their labels
    friction : Coulomb friction; absent: none
    grip : two fingers that hold a free object, in place of a press
    contact : how stick and slip are settled
    model : the body, or its section
    mesh : edge lengths and mesher; chosen from the scene unless given
    gauge : strain gauges
    marker : material points whose displacement is read
    marker_grid : markers all over the contact face
    taxel : pressure cells on the base
    labels : fields for learning, which a sweep writes
    """

    title: Title | None = None
    finger: Tree
    material: MaterialTable
    parts: dict[str, PartTable] = {}
    object: Tree | None = None
    friction: FrictionTable = FrictionTable(mu=0.0)
    press: Tree = {}
    grip: GripTable | None = None
    contact: ContactTable = ContactTable()
    model: DomainTable = DomainTable()
    mesh: MeshTable = MeshTable()
    gauge: tuple[GaugeTable, ...] = ()
    marker: tuple[MarkerTable, ...] = ()
    marker_grid: MarkerGridTable | None = None
    taxel: tuple[TaxelTable, ...] = ()
    labels: LabelsTable | None = None
    effects: Tree = {}


class AutoTable(TomlTable):
    """[effects] itself: whether the effects that it names are used only where they are needed.

    Attributes
    ----------
    auto : absent: the effects below are on, and large deformation, unless it is among them, is used if it changes a
        number by more than the tolerance; true: the effects below, too, are used only if they do; false: exactly the
        effects below are on
    auto_tolerance : relative to the natural scale of the number; mesh.tolerance unless given, else 0.02
    """

    auto: bool | None = None
    auto_tolerance: Annotated[float, Gt(0), Lt(1)] | None = None


class MeshFileTable(TomlTable):
    """[finger] with a mesh of tetrahedra as its geometry.

    Attributes
    ----------
    scale : what the lengths of the file are multiplied with, to be mm: 25.4 for inches, 1000 for metres
    """

    scale: Scale = 1.0


class FileTable(MeshFileTable):
    """[finger] with a STEP or STL file as its geometry: all dimensions are the file's.

    Attributes
    ----------
    scale : what the lengths of the file are multiplied with, to be mm: 25.4 for inches, 1000 for metres; those of a
        STEP file are mm before, whatever unit it names
    up : the axis of the file that points from the base to the contact face; a body with z up is turned about x
    """

    up: Literal["y", "z"] = "y"


@functools.cache
def table_of(record: type) -> type[TomlTable]:
    """Return the strict table of a dataclass: a design's dimensions, an object's, or an effect's settings."""
    hints = typing.get_type_hints(record, include_extras=True)
    fields: Tree = {}
    for f in dataclasses.fields(record):
        default = f.default if f.default_factory is dataclasses.MISSING else f.default_factory()
        name, hint = f.name, hints[f.name]
        if (bounds := _degrees(hint)) is not None:
            name, hint = f"{name}_deg", Annotated[float, *bounds]
            default = default if default is dataclasses.MISSING else math.degrees(default)
        fields[name] = (_bounded(hint), ... if default is dataclasses.MISSING else default)
    return create_model(record.__name__, __base__=TomlTable, **fields)


def _degrees(hint: Any) -> tuple[Any, ...] | None:
    """Return the bounds, in degrees, of a field that holds radians; None for any other."""
    return next((m.bounds for m in getattr(hint, "__metadata__", ()) if isinstance(m, Radians)), None)


def record_of(record: type[Record], settings: TomlTable) -> Record:
    """Return the dataclass that a table stands for, which has its fields as keys; its angles in radians."""
    hints = typing.get_type_hints(record, include_extras=True)
    return record(
        **{
            f.name: math.radians(getattr(settings, f"{f.name}_deg"))
            if _degrees(hints[f.name])
            else getattr(settings, f.name)
            for f in dataclasses.fields(record)  # type: ignore[arg-type]
        }
    )


def _bounded(hint: Any) -> Any:
    """Add bounds to a number whose type has none, so that no key of a design or an effect takes 1e300."""
    origin = typing.get_origin(hint)
    kind, *metadata = typing.get_args(hint) if origin is Annotated else (hint,)
    if origin in (typing.Union, types.UnionType):
        return typing.Union[tuple(_bounded(a) for a in typing.get_args(hint))]  # noqa: UP007
    if kind not in (float, int):
        return hint
    if not any(isinstance(m, Ge | Gt | Interval) for m in metadata):
        metadata.append(Ge(-LARGEST))
    if not any(isinstance(m, Le | Lt | Interval) for m in metadata):
        metadata.append(Le(LARGEST))
    return Annotated[kind, *metadata]
