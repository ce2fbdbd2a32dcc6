"""Readings of a press: gauges, markers and taxels, and the columns and quantities of its tables.

The kind of a quantity determines its order of convergence, the factor of its error bars, the scale of its errors, and
whether it follows Young's modulus.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum, auto
from itertools import product
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._ranges import Turn
from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Stiffness, times
from finger3d.fem.mesh import Mesh, cells_at, reflect_into_part
from finger3d.fem.surface import displacement_row, displacement_rows, strain_row

MAIN = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")
"""The numbers of a press that short tables show, and that get an error bar, beside every gauge."""

AREAS = ("contact_area_mm2", "stick_area_mm2")
"""Those that get an error bar besides."""

SLIP = ("stick_ratio_area", "stick_ratio_force", "slip_margin")
"""How near the contact is to slipping as a whole, from 1 to 0; they get an error bar, too."""

RESULTANTS = {
    2: ("force_x_N", "force_y_N", "moment_z_Nmm", "tangential_force_x_N", "outward_friction_x_N"),
    3: (
        *(f"force_{axis}_N" for axis in "xyz"),
        *(f"moment_{axis}_Nmm" for axis in "xyz"),
        *(f"{name}_{axis}_N" for axis in "xz" for name in ("tangential_force", "outward_friction")),
    ),
}
"""Components of force, moment and friction by dimension; they get an error bar, too."""

GIVEN_BY_FORCE = ("normal_force_N", "force_y_N")
"""Numbers that are given, and have no error, under a prescribed normal force."""

MEASURED = {"gauge": "strain", "marker": "displacement", "taxel": "pressure"}
"""What a sensor of each kind reads, in the order of their columns; those of other kinds follow."""


@dataclass(frozen=True)
class Column:
    """One number that a sensor reads.

    Attributes
    ----------
    sensor : name of the sensor
    kind : "gauge", "marker", "taxel", or another word
    unit : of the number; empty if it is dimensionless
    axis : component of a vector; empty for a scalar
    """

    sensor: str
    kind: str
    unit: str = ""
    axis: str = ""

    @property
    def name(self) -> str:
        """Name of the number, unique among all sensors, such as ``g36`` or ``m1.x``."""
        return f"{self.sensor}.{self.axis}" if self.axis else self.sensor

    @property
    def key(self) -> str:
        """Name of the column in tables: ``gauge_g36``, ``marker_m1_x_mm``, ``taxel_t1_MPa``, ``reading_<name>``."""
        kind = self.kind if self.kind in MEASURED else "reading"
        return "_".join(part for part in (kind, self.sensor, self.axis, self.unit) if part)

    @property
    def title(self) -> str:
        """What the number is, in words."""
        along = f" along {self.axis}" if self.axis else ""
        return f"{MEASURED.get(self.kind, 'reading')} of {self.kind} {self.sensor}{along}"


def strain_columns(gauge: str) -> tuple[Column, Column]:
    """Return the columns of a gauge's strain, and of the strain without foils, which only foils give."""
    return Column(gauge, "gauge"), Column(f"{gauge}_free", "gauge")


def displacement_columns(marker: str, dim: int = 3) -> tuple[Column, ...]:
    """Return the columns of the displacement of a marker in 2 or 3 dimensions."""
    return tuple(Column(marker, "marker", "mm", axis) for axis in "xyz"[:dim])


def pressure_column(taxel: str) -> Column:
    """Return the column of the pressure on a taxel."""
    return Column(taxel, "taxel", "MPa")


def in_order(readings: Mapping[Column, float]) -> dict[Column, float]:
    """Return readings in the order of tables: gauges, markers, taxels, and others."""
    kinds = list(MEASURED)
    return dict(sorted(readings.items(), key=lambda item: (*kinds, item[0].kind).index(item[0].kind)))


def in_space(readings: Mapping[Column, float]) -> dict[Column, float]:
    """Return readings with all components of each displacement; across a section it is zero."""
    out: dict[Column, float] = {}
    for column, value in readings.items():
        out[column] = value
        if column.kind == "marker" and column.axis == "y":
            out[replace(column, axis="z")] = 0.0  # the value follows in a solid
    return out


def by_key(readings: Mapping[Column, float]) -> dict[str, float]:
    """Return readings by the names of their columns."""
    return {column.key: value for column, value in readings.items()}


def of_kind(columns: Iterable[Column], kind: str) -> tuple[Column, ...]:
    """Return the columns of one kind of sensor."""
    return tuple(column for column in columns if column.kind == kind)


@dataclass(frozen=True)
class MeshedBody:
    """The meshed part of the finger that readings are taken from.

    Attributes
    ----------
    axes : symmetry planes; a reading in a mirror image is taken from the part
    thickness : width of a section, 1 for a solid, mm
    moduli : shear modulus of each part by its number, MPa
    """

    mesh: Mesh
    axes: tuple[str, ...]
    stiffness: Stiffness
    thickness: float
    moduli: tuple[float, ...]


class Reading(Protocol):
    """Numbers read from the finger; linear in small strain."""

    @property
    def name(self) -> str:
        """Name in the output."""
        ...

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of each number, in 2 or 3 dimensions."""
        ...

    def mirrored(self, name: str) -> tuple[Reading, tuple[float, ...]]:
        """Return the reading at the mirror image about x = 0, and the sign of each number there in a mirrored press."""
        ...

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the rows (k, N) or (k, n d) that give the numbers from the unknowns of small strain."""
        ...

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the numbers (k,) under finite displacements u (n, d), mm, and internal forces (n, d), N."""
        ...


@dataclass(frozen=True)
class Marker:
    """Displacement of a material point in mm, as a camera sees a dot."""

    name: str
    x_mm: float
    y_mm: float
    z_mm: float = 0.0

    @property
    def place(self) -> Float:
        """Place (3,) mm at rest."""
        return np.array([self.x_mm, self.y_mm, self.z_mm])

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return a column for each component of the displacement."""
        return displacement_columns(self.name, dim)

    def mirrored(self, name: str) -> tuple[Marker, tuple[float, ...]]:
        """Return the marker at the mirror image about x = 0; its displacement along x changes its sign."""
        return replace(self, name=name, x_mm=-self.x_mm), (-1.0, 1.0, 1.0)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the rows (d, n d) of the displacement."""
        inside, sign = reflect_into_part(self.place, np.ones(3), body.axes, body.mesh.dim)
        return displacement_rows(body.mesh, inside, sign)

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the displacement (d,)."""
        return moved_place(body.mesh, u, self.place, body.axes) - self.place[: body.mesh.dim]


@dataclass(frozen=True)
class Taxel:
    """Mean pressure in MPa on a rectangle of the base, per area at rest, as a pressure cell below the finger reads it.

    Only a solid needs the width along z.
    """

    name: str
    x_mm: float
    z_mm: float
    length_mm: float
    width_mm: float | None = None

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of the pressure."""
        return (pressure_column(self.name),)

    def mirrored(self, name: str) -> tuple[Taxel, tuple[float, ...]]:
        """Return the taxel at the mirror image about x = 0."""
        return replace(self, name=name, x_mm=-self.x_mm), (1.0,)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the row (1, N) of the pressure: nodal forces are the stiffness times the unknowns."""
        upper = body.stiffness.upper
        on_forces = np.zeros(upper.shape[0])
        on_forces[1 : body.mesh.points.size : body.mesh.dim] = self._weights(body)
        return sp.csr_matrix(times(upper, on_forces))

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the pressure (1,)."""
        return np.array([self._weights(body) @ forces[:, 1]])

    def _weights(self, body: MeshedBody) -> Float:
        """Return the weights (n,) of the nodal forces along y."""
        from finger3d.fem.recovery import mean_traction_weights

        sides = [("x", self.x_mm, self.length_mm)]
        if body.mesh.dim == 3:
            if self.width_mm is None:
                raise Finger3dError(f"taxel {self.name}: width_mm is missing; a solid needs it")
            sides.append(("z", self.z_mm, self.width_mm))
        bounds = [_folded(at - 0.5 * extent, at + 0.5 * extent, axis in body.axes) for axis, at, extent in sides]
        boxes = np.array([np.transpose(box) for box in product(*bounds)])
        try:
            return mean_traction_weights(body.mesh, "base", boxes, body.thickness, body.moduli)
        except Finger3dError as error:
            raise Finger3dError(f"taxel {self.name}: {error}") from None


def _folded(low: float, high: float, mirrored: bool) -> list[tuple[float, float]]:
    """Return an interval as intervals of the meshed part, which a symmetry plane at 0 bounds if it is mirrored."""
    if not mirrored:
        return [(low, high)]
    images = (max(low, 0.0), high), (max(-high, 0.0), -low)
    return [(start, stop) for start, stop in images if stop > start]


def moved_place(mesh: Mesh, u: Float, place: Float, axes: tuple[str, ...]) -> Float:
    """Return where a material point (3,) of the whole finger goes, (d,), under displacements u (n, d) of the part."""
    d = mesh.dim
    inside, sign = reflect_into_part(place, np.ones(3), axes, d)
    cell, barycentric = cells_at(mesh, inside)[0]
    return np.asarray(place[:d] + sign * (mesh.element.shape(barycentric[None])[0] @ u[mesh.cells[cell]]))


@dataclass(frozen=True)
class Gauge:
    """Normal strain at a point along a direction in the x-y plane; its mean over `length_mm` if that is not zero.

    The strain at finite deformation is the relative elongation of the line.  The angle is in radians.
    """

    name: str
    x_mm: float
    y_mm: float
    z_mm: float = 0.0
    angle: Turn = 0.0
    length_mm: float = 0.0

    @property
    def is_point(self) -> bool:
        """Whether the strain is read at a point and not as a mean."""
        return self.length_mm == 0.0

    @property
    def middle(self) -> Float:
        """Place (3,) mm."""
        return np.array([self.x_mm, self.y_mm, self.z_mm])

    @property
    def direction(self) -> Float:
        """Unit vector (3,)."""
        return np.array([np.cos(self.angle), np.sin(self.angle), 0.0])

    @property
    def ends(self) -> tuple[Float, Float]:
        """Both ends (3,) mm."""
        half = 0.5 * self.length_mm * self.direction
        return self.middle - half, self.middle + half

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of the strain."""
        return strain_columns(self.name)[:1]

    def mirrored(self, name: str) -> tuple[Gauge, tuple[float, ...]]:
        """Return the gauge at the mirror image about x = 0."""
        return replace(self, name=name, x_mm=-self.x_mm, angle=math.pi - self.angle), (1.0,)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the row (1, n d) of the strain along the gauge."""
        return self.row(body.mesh, body.axes)

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the relative elongation of the line, (1,)."""
        from finger3d.fem.hyperelastic import stretch

        mesh, axes = body.mesh, body.axes
        if self.is_point:
            return np.array([stretch(mesh, u, *reflect_into_part(self.middle, self.direction, axes, mesh.dim))])
        start, end = (moved_place(mesh, u, place, axes) for place in self.ends)
        return np.array([float(np.linalg.norm(end - start)) / self.length_mm - 1.0])

    def row(self, mesh: Mesh, axes: tuple[str, ...]) -> sp.csr_matrix:
        """Return the row (1, n d) that gives the strain from small displacements of a meshed part."""
        along = self.direction
        if self.is_point:
            return strain_row(mesh, *reflect_into_part(self.middle, along, axes, mesh.dim))
        start, end = (displacement_row(mesh, *reflect_into_part(x, along, axes, mesh.dim)) for x in self.ends)
        return sp.csr_matrix((end - start) / self.length_mm)


ORDER = 1.2
"""Order of convergence at the bonded corners of the base for nu = 0.49, the lowest of all (validation/bonded)."""


class Kind(Enum):
    """Kind of a number, which determines its order of convergence."""

    NORMAL_FORCE = auto()
    FRICTION_SUM = auto()
    FORCE = auto()
    PRESSURE = auto()
    WORK = auto()
    DISSIPATION = auto()
    STRAIN = auto()
    DISPLACEMENT = auto()
    BASE_PRESSURE = auto()
    OTHER_READING = auto()
    CONTACT_LENGTH = auto()
    CONTACT_AREA = auto()
    STICK_LENGTH = auto()
    STICK_AREA = auto()
    SHARE = auto()
    MARGIN = auto()
    DEPTH = auto()
    MOTION = auto()
    MOMENT = auto()

    @property
    def is_stick(self) -> bool:
        """Return whether the number is the length or the area of the zone of stick, or its share of contact."""
        return self in (Kind.STICK_LENGTH, Kind.STICK_AREA, Kind.SHARE)

    @property
    def is_zone(self) -> bool:
        """Return whether the number is a length, an area or a share of contact or stick."""
        return self.is_stick or self in (Kind.CONTACT_LENGTH, Kind.CONTACT_AREA)

    @property
    def is_reading(self) -> bool:
        """Return whether a sensor reads the number."""
        return self in (Kind.STRAIN, Kind.DISPLACEMENT, Kind.BASE_PRESSURE, Kind.OTHER_READING)

    @property
    def is_stress(self) -> bool:
        """Return whether the number is proportional to the stresses; of other readings the unit tells."""
        return not self.is_zone and self not in _GEOMETRIC

    @property
    def order(self) -> float:
        """Order of convergence with the edge length."""
        return 1.5 if self in (Kind.FRICTION_SUM, Kind.STRAIN, Kind.DISPLACEMENT) else ORDER

    @property
    def bar_factor(self) -> float:
        """Factor c of the error bars, fitted to 192 drawn sections and 134 solids, a third of them deformed largely."""
        return 0.7 if self.is_zone else _FITTED.get(self, 0.8)


_GEOMETRIC = (Kind.STRAIN, Kind.DISPLACEMENT, Kind.OTHER_READING, Kind.MARGIN, Kind.DEPTH, Kind.MOTION)

_FITTED = {Kind.FRICTION_SUM: 1.05, Kind.STRAIN: 0.85, Kind.BASE_PRESSURE: 0.55, Kind.MOMENT: 1.1}


@dataclass(frozen=True)
class Quantity:
    """A number of a press.

    Attributes
    ----------
    name : in results and tables, such as ``normal_force_N``
    kind : Kind
    title : what it is, in words
    unit : empty if it is dimensionless
    where : place at which it is measured, if that is one
    factor : of the number that is printed, 2 for the extent whose half is the quantity
    """

    name: str
    kind: Kind
    title: str
    unit: str = ""
    where: str = ""
    factor: float = 1.0

    @property
    def is_stress(self) -> bool:
        """Whether the number is proportional to the stresses, by its kind, or by its unit if that is not known."""
        return self.unit in _OF_STRESSES if self.kind is Kind.OTHER_READING else self.kind.is_stress

    @property
    def label(self) -> str:
        """Title, place and unit, as a table or an axis shows them."""
        title = f"{self.title} {self.where}".rstrip()
        return f"{title} ({self.unit})" if self.unit else title

    @classmethod
    def of(cls, column: Column) -> Quantity:
        """Return the quantity that a sensor reads."""
        return cls(column.key, _READINGS.get(column.kind, Kind.OTHER_READING), column.title, column.unit)


def _along(axes: str, name: str, kind: Kind, title: str, unit: str = "N") -> list[Quantity]:
    return [Quantity(f"{name}_{axis}_{unit}", kind, f"{title} {axis}", unit) for axis in axes]


_HALF = "at z = 0", 2.0

OF_INCREMENT = (
    Quantity("depth_mm", Kind.DEPTH, "depth", "mm"),
    *_along("xz", "slide", Kind.MOTION, "slide along", "mm"),
    *_along("xyz", "turn", Kind.MOTION, "turn about", "deg"),
    Quantity("time_s", Kind.MOTION, "time", "s"),
    Quantity("normal_force_N", Kind.NORMAL_FORCE, "normal force", "N"),
    *_along("xz", "tangential_force", Kind.FORCE, "tangential force along"),
    Quantity("friction_sum_N", Kind.FRICTION_SUM, "friction sum", "N"),
    Quantity("force_x_N", Kind.FORCE, "force along x", "N"),
    Quantity("force_y_N", Kind.NORMAL_FORCE, "force along y", "N"),
    Quantity("force_z_N", Kind.FORCE, "force along z", "N"),
    *_along("xyz", "moment", Kind.MOMENT, "moment about", "Nmm"),
    *_along("xz", "outward_friction", Kind.FRICTION_SUM, "outward friction along"),
    Quantity("contact_area_mm2", Kind.CONTACT_AREA, "contact area", "mm2"),
    Quantity("stick_area_mm2", Kind.STICK_AREA, "stick area", "mm2"),
    Quantity("stick_ratio_area", Kind.SHARE, "stick ratio by area"),
    Quantity("stick_ratio_force", Kind.SHARE, "stick ratio by force"),
    Quantity("slip_margin", Kind.MARGIN, "slip margin"),
    Quantity("contact_half_length_mm", Kind.CONTACT_LENGTH, "contact extent", "mm", *_HALF),
    Quantity("stick_half_length_mm", Kind.STICK_LENGTH, "stick extent", "mm", *_HALF),
    Quantity("contact_half_length_end_mm", Kind.CONTACT_LENGTH, "contact extent", "mm", "at z = width/2", 2.0),
    Quantity("largest_penetration_mm", Kind.MOTION, "largest penetration", "mm"),
    Quantity("external_work_mJ", Kind.WORK, "work", "mJ"),
    Quantity("dissipation_mJ", Kind.DISSIPATION, "dissipation", "mJ"),
)
"""Numbers of an increment, without readings."""

OF_WIDTH = (
    Quantity("force_N_per_mm", Kind.NORMAL_FORCE, "normal force", "N/mm"),
    Quantity("contact_length_mm", Kind.CONTACT_LENGTH, "contact extent", "mm", "at z = 0"),
    Quantity("contact_length_end_mm", Kind.CONTACT_LENGTH, "contact extent", "mm", "at z = width/2"),
    Quantity("stick_length_mm", Kind.STICK_LENGTH, "stick extent", "mm", "at z = 0"),
    Quantity("friction_sum_N_per_mm", Kind.FRICTION_SUM, "friction sum", "N/mm"),
    Quantity("friction_along_x_N_per_mm", Kind.FORCE, "sum of |friction along x|", "N/mm"),
    Quantity("friction_along_z_N_per_mm", Kind.FORCE, "sum of |friction along z|", "N/mm"),
    Quantity("outward_friction_x_N_per_mm", Kind.FORCE, "outward friction along x", "N/mm"),
    Quantity("moment_y_Nmm_per_mm", Kind.FORCE, "moment about y", "N"),
    Quantity("peak_pressure_MPa", Kind.PRESSURE, "peak pressure", "MPa", "at z = 0"),
)
"""Numbers of a comparison of models, for each mm of width."""

_OF_STRESSES = "N", "MPa", "mJ", "Nmm"

_READINGS = {
    "gauge": Kind.STRAIN,
    "marker": Kind.DISPLACEMENT,
    "taxel": Kind.BASE_PRESSURE,
}

_KNOWN = {one.name: one for one in (*OF_INCREMENT, *OF_WIDTH)}


def named(*names: str) -> tuple[Quantity, ...]:
    """Return quantities that are no readings by their names."""
    return tuple(_KNOWN[name] for name in names)


def quantities(readings: Iterable[Column]) -> dict[str, Quantity]:
    """Return all quantities of a press or a comparison by name, those of readings included."""
    return _KNOWN | {column.key: Quantity.of(column) for column in readings}


def kinds_of(readings: Iterable[Column]) -> dict[str, Kind]:
    """Return the kinds of all numbers of a press or a comparison by name, those of readings included."""
    return {name: one.kind for name, one in quantities(readings).items()}
