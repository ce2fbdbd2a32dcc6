"""Quantities of a press: the name, unit and kind of each of its numbers, readings included.

The kind of a quantity determines its order of convergence, the factor of its error bars, the scale of its errors, and
whether it follows Young's modulus.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, auto

from finger3d.mechanics.readings.columns import Column

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
    DEPTH = auto()
    MOTION = auto()
    MOMENT = auto()

    @property
    def is_stick(self) -> bool:
        """Return whether the number is the length or the area of the zone of stick."""
        return self in (Kind.STICK_LENGTH, Kind.STICK_AREA)

    @property
    def is_zone(self) -> bool:
        """Return whether the number is a length, an area or a share of contact or stick."""
        return self.is_stick or self in (Kind.CONTACT_LENGTH, Kind.CONTACT_AREA, Kind.SHARE)

    @property
    def is_reading(self) -> bool:
        """Return whether a sensor reads the number."""
        return self in (Kind.STRAIN, Kind.DISPLACEMENT, Kind.BASE_PRESSURE, Kind.OTHER_READING)

    @property
    def is_stress(self) -> bool:
        """Return whether the number is proportional to the stresses; of other readings the unit tells."""
        geometric = (Kind.STRAIN, Kind.DISPLACEMENT, Kind.OTHER_READING, Kind.DEPTH, Kind.MOTION)
        return not self.is_zone and self not in geometric

    @property
    def order(self) -> float:
        """Order of convergence with the edge length."""
        return 1.5 if self in (Kind.FRICTION_SUM, Kind.STRAIN, Kind.DISPLACEMENT) else ORDER

    @property
    def bar_factor(self) -> float:
        """Factor c of the error bars, fitted to 118 drawn sections and 28 solids, a third of them deformed largely."""
        return _FITTED.get(self, 0.9)


_FITTED = {
    Kind.FRICTION_SUM: 1.2,
    Kind.STICK_LENGTH: 1.1,
    Kind.STICK_AREA: 1.1,
    Kind.SHARE: 1.1,
    Kind.DISSIPATION: 1.1,
}


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
    Quantity("slip_margin", Kind.SHARE, "slip margin"),
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
    Quantity("peak_pressure_MPa", Kind.PRESSURE, "peak pressure", "MPa"),
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
