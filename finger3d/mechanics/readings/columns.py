"""Columns of tables of a press: its main numbers by name, and the numbers that sensors read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

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
