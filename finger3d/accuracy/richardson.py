"""Discretisation error by Richardson extrapolation from two meshes.

If the error of a number x falls as h^p with the edge length h, the number x' on a mesh of edge length r h gives ::

    error of x = |x - x'| / |r^p - 1|

The order p of forces is that of quadratic elements at a bonded corner, p = 2 lambda, where displacements go as
distance^lambda (Williams 1952).  Numbers that depend less on the corners have a higher order.  Lengths and areas are
resolved no better than the distance of contact points.  ``validation/error_bars.py`` measures how often the true error
lies within twice the estimate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from enum import Enum, auto

from finger3d.accuracy.point_resolution import PointResolution
from finger3d.mechanics.readings.columns import RESULTANTS, Column

ORDER = 1.2
"""Order of convergence at the bonded corners of the base for nu = 0.49, the lowest of all (validation/bonded_layer)."""

_RESOLUTION_FLOOR = 0.1
"""Points of distance h at the edge of a contact of half-length a leave a relative error of about this times (h/a)^2 in
the normal force, and of this times h/a in friction and strains (validation/error_bars.py)."""

UNRESOLVED_DISSIPATION = 2e-4
"""Dissipation that points of distance h leave unresolved over the external work times h/a: few of them slip."""


class Kind(Enum):
    """Kind of a number, which determines the lower bound of its error."""

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
    HALF_LENGTH = auto()
    LENGTH = auto()
    AREA = auto()
    DEPTH = auto()
    MOMENT = auto()

    @property
    def is_length(self) -> bool:
        """Return whether the number is a length of a zone of contact points."""
        return self in (Kind.LENGTH, Kind.HALF_LENGTH)


_KINDS = {name: Kind.MOMENT if name.startswith("moment") else Kind.FORCE for name in RESULTANTS[3]} | {
    "depth_mm": Kind.DEPTH,
    "normal_force_N": Kind.NORMAL_FORCE,
    "force_y_N": Kind.NORMAL_FORCE,
    "outward_friction_x_N": Kind.FRICTION_SUM,
    "outward_friction_z_N": Kind.FRICTION_SUM,
    "force_N_per_mm": Kind.NORMAL_FORCE,
    "friction_sum_N": Kind.FRICTION_SUM,
    "friction_sum_N_per_mm": Kind.FRICTION_SUM,
    "friction_along_x_N_per_mm": Kind.FORCE,
    "friction_along_z_N_per_mm": Kind.FORCE,
    "outward_friction_x_N_per_mm": Kind.FORCE,
    "moment_y_Nmm_per_mm": Kind.FORCE,
    "peak_pressure_MPa": Kind.PRESSURE,
    "external_work_mJ": Kind.WORK,
    "dissipation_mJ": Kind.DISSIPATION,
    "contact_half_length_mm": Kind.HALF_LENGTH,
    "stick_half_length_mm": Kind.HALF_LENGTH,
    "contact_half_length_end_mm": Kind.HALF_LENGTH,
    "contact_length_mm": Kind.LENGTH,
    "contact_length_end_mm": Kind.LENGTH,
    "stick_length_mm": Kind.LENGTH,
    "contact_area_mm2": Kind.AREA,
    "stick_area_mm2": Kind.AREA,
}

ORDERS = {Kind.FRICTION_SUM: 1.5, Kind.STRAIN: 1.5, Kind.DISPLACEMENT: 2.0}
"""Orders of numbers that depend less on the bonded corners than forces do; of the others `ORDER`."""

_FLOORS = {Kind.DISPLACEMENT: 0.01, Kind.BASE_PRESSURE: 0.03, Kind.WORK: 0.01}
"""Values in place of `_RESOLUTION_FLOOR` for numbers that depend less on the edge of contact."""

_READINGS = {
    "gauge": Kind.STRAIN,
    "marker": Kind.DISPLACEMENT,
    "taxel": Kind.BASE_PRESSURE,
}


_IF_ZERO = {
    Kind.AREA: "contact_area_mm2",
    Kind.FRICTION_SUM: "normal_force_N",
    Kind.DISSIPATION: "external_work_mJ",
}
_ROUND_OFF = 1e-9  # of the number in its place, below which a number is zero


def kinds_of(readings: Iterable[Column]) -> dict[str, Kind]:
    """Return the kinds of all numbers of a press or a comparison by name, those of readings included."""
    return _KINDS | {column.key: _READINGS.get(column.kind, Kind.OTHER_READING) for column in readings}


def largest(numbers: Mapping[str, float], kinds: Mapping[str, Kind], kind: Kind) -> float:
    """Return the largest magnitude of all numbers of a kind, 0 without any."""
    return max((abs(v) for k, v in numbers.items() if kinds[k] is kind), default=0.0)


def largest_readings(numbers: Mapping[str, float], kinds: Mapping[str, Kind]) -> dict[Kind, float]:
    """Return the largest magnitude of every kind of reading, to which errors of readings are relative."""
    return {kind: largest(numbers, kinds, kind) for kind in (*_READINGS.values(), Kind.OTHER_READING)}


def relative_error(numbers: Mapping[str, float], kinds: Mapping[str, Kind], name: str, error: float) -> float:
    """Return the relative error of a number.

    That of a reading is relative to the largest of its kind, of a length to that of contact, of a component of the
    force to the normal force, and of a moment to the normal force at the end of contact at least, since those vanish in
    symmetric presses.  Where nothing sticks or slips, areas, friction and dissipation are relative to the area of
    contact, the normal force and the work.
    """
    kind, force = kinds[name], abs(numbers["normal_force_N"])
    scale = largest_readings(numbers, kinds).get(kind, abs(numbers[name]))
    if kind.is_length:
        scale = numbers["contact_half_length_mm"]
    elif kind is Kind.FORCE:
        scale = force
    elif kind is Kind.MOMENT:
        scale = max(scale, force * numbers["contact_half_length_mm"])
    elif kind in _IF_ZERO and scale <= _ROUND_OFF * abs(numbers[_IF_ZERO[kind]]):
        scale = abs(numbers[_IF_ZERO[kind]])
    return error / scale if scale > 0.0 else (math.inf if error > 0.0 else 0.0)


def gain(ratio: float, order: float = ORDER) -> float:
    """Return the difference to the companion over the error, for a `ratio` of edge lengths, companion over mesh."""
    return abs(math.pow(ratio, order) - 1.0)


_FITTED = 0.9
"""Error bar over the root mean square of the errors that three companions give; see `spread_error`."""


def spread_error(
    numbers: Mapping[str, float],
    companions: Iterable[tuple[float, Mapping[str, float]]],
    own: PointResolution,
    readings: Iterable[Column],
) -> dict[str, float]:
    """Return the discretisation error by name, from the spread of a number q over several meshes.

    With edges k times as long a number q_k would be off by k^p - 1 times the error of q ::

        error of q = 0.9 root mean square over k of |q - q_k| / |k^p - 1|

    A single difference is small by chance in one of five numbers, which the spread over three meshes is not.  The
    factor was fitted to 79 drawn sections in small strain, of whose numbers 92 to 99 % then lie within two bars
    (dissipation 86 %); of 74 sections at large deformation 85 to 97 % do.

    Parameters
    ----------
    companions : edge length over that of the mesh, and numbers by name, of every companion
    own : resolution of the contact points, below which no error is
    readings : columns of the readings among the numbers
    """
    kinds, told = kinds_of(readings), list(companions)
    found = _least_errors(numbers, kinds, own)
    for name, value in numbers.items():
        order = _SPREAD_ORDERS.get(kinds[name], ORDER)
        errors = [(value - other[name]) / gain(ratio, order) for ratio, other in told]
        found[name] = max(found[name], _FITTED * math.sqrt(sum(error**2 for error in errors) / len(errors)))
    return {name: error for name, error in found.items() if math.isfinite(error)}


_SPREAD_ORDERS = dict.fromkeys((Kind.FRICTION_SUM, Kind.STRAIN, Kind.DISPLACEMENT), 1.5)
"""Orders of the errors of `spread_error`; of other kinds `ORDER`."""


def mesh_error(
    numbers: Mapping[str, float],
    companion: Mapping[str, float],
    ratio: float,
    resolutions: tuple[PointResolution, PointResolution],
    readings: Iterable[Column] = (),
) -> dict[str, float]:
    """Return the discretisation error by name.

    Parameters
    ----------
    numbers, companion : of the mesh and of its companion, by name
    ratio : edge length of the companion over that of the mesh; below 1 for a finer companion
    resolutions : of the contact points of both
    readings : columns of the readings among the numbers

    Returns
    -------
    dict
        Errors in the units of the numbers; names without a finite error are left out.
    """
    own, other = resolutions
    kinds = kinds_of(readings)
    found = _least_errors(numbers, kinds, own)
    for name, value in numbers.items():
        kind, change = kinds[name], abs(value - companion[name])
        if kind.is_length or kind is Kind.AREA:
            # a difference below the resolution of the companion's points does not count
            change = max(0.0, change - other.least.get(name, 0.0))
        found[name] = max(change / gain(ratio, ORDERS.get(kind, ORDER)), found[name])
    return {name: float(error) for name, error in found.items() if math.isfinite(error)}


def _least_errors(numbers: Mapping[str, float], kinds: Mapping[str, Kind], own: PointResolution) -> dict[str, float]:
    """Return what the contact points leave open of every number, whatever companions tell."""
    scales, found = largest_readings(numbers, kinds), dict[str, float]()
    for name, value in numbers.items():
        kind, bound = kinds[name], own.least.get(name, 0.0)
        if not (kind.is_length or kind is Kind.AREA):
            power = 2 if kind in (Kind.NORMAL_FORCE, Kind.DEPTH) else 1
            floor = _FLOORS.get(kind, _RESOLUTION_FLOOR) * own.share**power
            bound = max(bound, floor * scales.get(kind, abs(value)))
        if kind is Kind.DISSIPATION:
            bound = max(bound, UNRESOLVED_DISSIPATION * own.share * largest(numbers, kinds, Kind.WORK))
        found[name] = bound
    return found
