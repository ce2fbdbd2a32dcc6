"""Friction laws: the coefficient of friction of every contact point."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.errors import Finger3dError

Status = NDArray[np.int8]

OPEN, STICK, SLIP = 0, 1, 2
STATUS_NAMES = ("open", "stick", "slip")


@dataclass(frozen=True)
class FrictionLaw(ABC):
    """Limit of the tangential force at every contact point, |f_t| <= mu f_n.

    The coefficient may depend on the status of a point and on its pressure, the normal force over its tributary area.
    The solver begins an increment with `coefficients` and solves again with those that `updated` returns until they
    no longer change.

    Attributes
    ----------
    mu : float
        Coefficient set by a scene, a sweep or a calibration, at least 0.
    """

    mu: float

    @property
    def largest(self) -> float:
        """Upper bound of the coefficient at any point; 0 for a frictionless contact."""
        return self.mu

    @property
    def depends_on_steps(self) -> bool:
        """Whether the solution depends on the number of increments and has no limit as they become many."""
        return False

    @property
    def is_defined_by_increments(self) -> bool:
        """Whether the law itself speaks of increments, so that these are not refined."""
        return False

    @abstractmethod
    def coefficients(self, status: Status, pressure: Float) -> Float:
        """Return the coefficients (c,) for points with this status (c,) and pressure (c,), MPa."""

    def updated(self, mu: Float, status: Status, pressure: Float) -> Float:
        """Return the coefficients (c,) that follow from a solution found with `mu` (c,); `mu` if they agree."""
        return mu

    def with_mu(self, mu: float) -> Self:
        """Return the same law with another `mu`.

        Raises
        ------
        Finger3dError
            If `mu` is not a finite number from 0 up.
        """
        if isinstance(mu, bool) or not (isinstance(mu, int | float | np.floating) and math.isfinite(mu) and mu >= 0.0):
            raise Finger3dError(f"mu = {mu}: must be a finite number from 0 up")
        return replace(self, mu=float(mu))


@dataclass(frozen=True)
class Coulomb(FrictionLaw):
    """Coulomb's law with one coefficient (Maeno 2004, Eqs. 3 and 4)."""

    mu: float = 0.0

    def coefficients(self, status: Status, pressure: Float) -> Float:
        """Return `mu` for every point."""
        return np.full(len(status), self.mu)


Branch = Literal["keep", "paper"]


@dataclass(frozen=True)
class TwoCoefficients(FrictionLaw):
    """Friction law with the static coefficient ``mu`` and the kinetic one ``ratio * mu``.

    mu_k < mu_s has no unique solution without a rule (validation/REFERENCES.md, 2.5).  ``keep``: a point that slips
    keeps slipping at mu_k until its slip would reverse; this converges to the solution with mu_k.  ``paper``: in every
    increment all points start stuck and slip only above mu_s (Maeno 2004, Fig. 8); the solution depends on mesh and
    increments.
    """

    ratio: float
    branch: Branch

    def __post_init__(self) -> None:
        if not 0.0 <= self.ratio <= 1.0:
            raise Finger3dError(f"ratio = {self.ratio}: must be a number from 0 to 1")
        if self.branch not in get_args(Branch):
            raise Finger3dError(f'branch = "{self.branch}": must be "keep" or "paper"')

    @property
    def depends_on_steps(self) -> bool:
        """True where every increment starts with all points stuck."""
        return self.branch == "paper"

    @property
    def is_defined_by_increments(self) -> bool:
        """True where the coefficients differ."""
        return self.ratio < 1.0

    def coefficients(self, status: Status, pressure: Float) -> Float:
        """Return the kinetic coefficient for points that slip, if they keep it, and the static one elsewhere."""
        keeps = (status == SLIP) & (self.branch == "keep")
        return np.where(keeps, self.ratio, 1.0) * self.mu

    def updated(self, mu: Float, status: Status, pressure: Float) -> Float:
        """Lower the limit of points that slip; it is never raised within an increment, so this ends."""
        return np.where(status == SLIP, self.ratio * self.mu, mu)
