"""Elastic constants of a material that is given by one of several keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from finger3d.materials.modulus import YoungsModulus, of_shore, youngs_modulus
from finger3d.materials.silicones import silicone_named

MODULUS_KEYS = ("E_MPa", "shore_A", "shore_00", "silicone")
"""Keys of which exactly one gives Young's modulus."""

NU = 0.49
"""Poisson's ratio of a silicone: its bulk modulus is about 50 times its shear modulus or more."""


@dataclass(frozen=True)
class ElasticConstants:
    """Young's modulus and Poisson's ratio, and where they come from.

    Attributes
    ----------
    E_MPa, nu : the constants
    spread : relative standard deviation of E_MPa; None if the user gave it
    origin : where E_MPa comes from, "given" if the user gave it
    """

    E_MPa: float
    nu: float
    spread: float | None
    origin: str

    def __str__(self) -> str:
        """Young's modulus with its spread and origin, in one line."""
        spread = "" if self.spread is None else f" +- {100.0 * self.spread:.0f} %"
        return f"{self.E_MPa:.3g} MPa{spread}, {self.origin}"


def elastic_constants(table: Mapping[str, object]) -> ElasticConstants:
    """Return the elastic constants that the keys of a table give, such as [material].

    Parameters
    ----------
    table : exactly one of `MODULUS_KEYS`, and ``nu``, which only E_MPa needs; keys that are None count as absent

    Raises
    ------
    Finger3dError
        If the silicone is unknown.

    Examples
    --------
    >>> elastic_constants({"E_MPa": 1.0, "nu": 0.4})
    ElasticConstants(E_MPa=1.0, nu=0.4, spread=None, origin='given')
    >>> print(elastic_constants({"shore_00": 30.0}))
    0.103 MPa +- 45 %, Shore 00-30 by Hertz's solution
    """
    nu = table.get("nu")
    found = _modulus(table)
    return ElasticConstants(found.E_MPa, NU if nu is None else _number(nu), found.spread, found.origin)


def _modulus(table: Mapping[str, object]) -> YoungsModulus:
    ((key, value),) = [(key, table[key]) for key in MODULUS_KEYS if table.get(key) is not None]
    if key == "silicone":
        return youngs_modulus(silicone_named(str(value)))
    if key == "E_MPa":
        return YoungsModulus(_number(value), None, "given")
    return of_shore(key.removeprefix("shore_"), _number(value))


def _number(value: object) -> float:
    if not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)
