"""Stress relaxation by a Prony series ``r(t) = 1 - sum g_i (1 - exp(-t/tau_i))``, integrated over time steps.

The recursion is exact for strain that changes at a constant rate within a step (Taylor, Pister and Goudreau 1970).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import exprel

from finger3d._types import Float, freeze_arrays
from finger3d.errors import Finger3dError

Prony = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Relaxation:
    """Relaxation of the moduli by a Prony series.

    Attributes
    ----------
    prony : relative modulus and time (s) of every branch
    bulk : whether the bulk modulus relaxes too, so that Poisson's ratio is constant
    """

    prony: Prony
    bulk: bool

    def check_domain(self, domain: str) -> None:
        """Refuse plane stress without `bulk`, where the thickness follows neither modulus alone.

        Raises
        ------
        Finger3dError
        """
        if domain == "plane-stress" and not self.bulk:
            raise Finger3dError(
                "effects.viscosity.bulk = false: not in plane stress, where the thickness follows neither modulus "
                'alone; set bulk = true, or model.domain = "plane-strain" or "solid"'
            )


@dataclass(frozen=True)
class InternalVariables:
    """Internal variables of a relaxing body.

    Attributes
    ----------
    elastic : (k,) present elastic response, such as displacements or stresses
    branches : (b, k) the part of it in each branch that has not relaxed yet
    """

    elastic: Float
    branches: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def at_rest(cls, prony: Prony, size: int) -> InternalVariables:
        """Return the internal variables before any deformation."""
        return cls(np.zeros(size), np.zeros((len(prony), size)))


@dataclass(frozen=True)
class Step:
    """A Prony series over a step of `seconds`, in which the elastic response changes at a constant rate."""

    prony: Prony
    seconds: float

    @property
    def _rates(self) -> Float:
        return self.seconds / np.array([time for _, time in self.prony])

    @property
    def decay(self) -> Float:
        """e_i: the fraction of each branch that remains at the end."""
        return np.exp(-self._rates)

    @property
    def gain(self) -> Float:
        """g_i gamma_i: increment of each branch per change of the elastic response."""
        return np.asarray(np.array([share for share, _ in self.prony]) * exprel(-self._rates))

    @property
    def alpha(self) -> float:
        """Stiffness against a change within the step, over the instantaneous stiffness."""
        return long_time_share(self.prony) + float(self.gain.sum())

    def history_load(self, memory: InternalVariables) -> Float:
        """Return the vector (k,) of the past: the stress at the end of the step is ``alpha now - past``."""
        return np.asarray(self.gain.sum() * memory.elastic - self.decay @ memory.branches)

    def after(self, memory: InternalVariables, now: Float) -> InternalVariables:
        """Return the internal variables at the end of the step, when the elastic response is `now`."""
        branches = self.decay[:, None] * memory.branches + self.gain[:, None] * (now - memory.elastic)
        return InternalVariables(now, branches)


def long_time_share(prony: Prony) -> float:
    """Return the long-time modulus over the instantaneous one, r_inf."""
    return 1.0 - math.fsum(share for share, _ in prony)


def relaxed(prony: Prony, memory: InternalVariables) -> Float:
    """Return the vector (k,) whose instantaneous elastic stress is the present stress."""
    return np.asarray(long_time_share(prony) * memory.elastic + memory.branches.sum(axis=0))
