"""The tables of a scene file, checked strictly: no unknown key, no conversion of types, no NaN, no infinity."""

from __future__ import annotations

import dataclasses
import functools
import math
import typing
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import BaseModel, ConfigDict, create_model

from finger3d.model import Domain
from finger3d.objects import Axis, Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge

Positive = Annotated[float, Gt(0)]
NotNegative = Annotated[float, Ge(0)]
Steps = Annotated[int, Ge(1)] | Literal["auto"]


class Table(BaseModel):
    """A TOML table. Lists arrive as tuples (see `finger3d.scene.tree.read`), so that strictness can stay on."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class MaterialTable(Table):
    """[material]: nu has no default because the paper gives none."""

    E_MPa: Positive
    nu: Annotated[float, Ge(0), Le(0.5)]


class FrictionTable(Table):
    """[friction]."""

    mu: NotNegative


class LegTable(Table):
    """[[press.leg]]; depth 0 releases the finger."""

    depth_mm: NotNegative
    slide_x_mm: float = 0.0
    slide_z_mm: float = 0.0
    steps: Steps = 10
    duration_s: Positive | None = None


class PressTable(LegTable):
    """[press] that stands for one leg."""

    depth_mm: Positive


class LegsTable(Table):
    """[press] with legs."""

    leg: Annotated[tuple[LegTable, ...], MinLen(1)]


class ContactTable(Table):
    """[contact]."""

    rule: Literal["projection", "paper"] = "projection"


class DomainTable(Table):
    """[model]."""

    domain: Domain = "solid"


class MeshTable(Table):
    """[mesh]: absent sizes are chosen from the finger (see `finger3d.scene.checks`)."""

    size_mm: Positive | None = None
    base_size_mm: Positive | None = None
    mesher: Literal["ftetwild", "swept"] = "ftetwild"
    tolerance: Positive | None = None
    max_seconds: Positive | None = None


class GaugeTable(Table):
    """[[gauge]]."""

    name: Annotated[str, MinLen(1)]
    x_mm: float
    y_mm: float
    z_mm: float = 0.0
    angle_deg: float = 0.0
    length_mm: NotNegative = 0.0


class SceneTable(Table):
    """The whole file. Tables whose keys depend on a name are checked afterwards, against that name's own table."""

    title: str | None = None
    finger: dict[str, Any]
    material: MaterialTable
    object: dict[str, Any] | None = None
    friction: FrictionTable = FrictionTable(mu=0.0)
    press: dict[str, Any]
    contact: ContactTable = ContactTable()
    model: DomainTable = DomainTable()
    mesh: MeshTable = MeshTable()
    gauge: tuple[GaugeTable, ...] = ()
    effects: dict[str, Any] = {}


class ObjectTable(Table):
    """What every object has: the place of its lowest point."""

    x_mm: float = 0.0
    z_mm: float = 0.0

    def build(self) -> RigidObject:
        """Return the object, angles in radians; every shape says how."""
        raise TypeError(f"{type(self).__name__} has no shape")


class PlaneTable(ObjectTable):
    """shape = "plane"."""

    tilt_deg: Annotated[float, Gt(-90), Lt(90)] = 0.0

    def build(self) -> RigidObject:
        """Return the plane."""
        return Plane(self.x_mm, self.z_mm, tilt=math.radians(self.tilt_deg))


class CylinderTable(ObjectTable):
    """shape = "cylinder"."""

    radius_mm: Positive
    axis: Axis = "z"

    def build(self) -> RigidObject:
        """Return the cylinder."""
        return Cylinder(self.x_mm, self.z_mm, radius_mm=self.radius_mm, axis=self.axis)


class SphereTable(ObjectTable):
    """shape = "sphere"."""

    radius_mm: Positive

    def build(self) -> RigidObject:
        """Return the sphere."""
        return Sphere(self.x_mm, self.z_mm, radius_mm=self.radius_mm)


class WedgeTable(ObjectTable):
    """shape = "wedge"."""

    angle_deg: Annotated[float, Gt(0), Lt(90)]
    tip_radius_mm: NotNegative = 0.0
    axis: Axis = "z"

    def build(self) -> RigidObject:
        """Return the wedge."""
        angle = math.radians(self.angle_deg)
        return Wedge(self.x_mm, self.z_mm, angle=angle, tip_radius_mm=self.tip_radius_mm, axis=self.axis)


class WaveTable(ObjectTable):
    """shape = "wave"."""

    wavelength_mm: Positive
    amplitude_mm: NotNegative
    axis: Axis = "z"

    def build(self) -> RigidObject:
        """Return the wave."""
        return Wave(
            self.x_mm, self.z_mm, wavelength_mm=self.wavelength_mm, amplitude_mm=self.amplitude_mm, axis=self.axis
        )


class MeshObjectTable(ObjectTable):
    """shape = "mesh"."""

    path: Annotated[str, MinLen(1)]
    scale: Positive = 1.0

    def build(self) -> RigidObject:
        """Return the object; reads and checks its file."""
        from finger3d.design.files import read_surface

        surface = read_surface(self.path, self.scale)
        return MeshObject(self.x_mm, self.z_mm, surface=surface, path=self.path, scale=self.scale)


class FileTable(Table):
    """[finger] with a file as its geometry: all dimensions are the file's."""


SHAPES: dict[str, type[ObjectTable]] = {
    "plane": PlaneTable,
    "cylinder": CylinderTable,
    "sphere": SphereTable,
    "wedge": WedgeTable,
    "wave": WaveTable,
    "mesh": MeshObjectTable,
}


@functools.cache
def table_of(record: type) -> type[Table]:
    """Return the strict table of a dataclass: a design's dimensions, or an effect's settings."""
    hints = typing.get_type_hints(record, include_extras=True)
    fields: dict[str, Any] = {}
    for f in dataclasses.fields(record):
        default = f.default if f.default_factory is dataclasses.MISSING else f.default_factory()
        fields[f.name] = (hints[f.name], ... if default is dataclasses.MISSING else default)
    return create_model(record.__name__, __base__=Table, **fields)
