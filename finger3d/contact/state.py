"""Contact states: status, force and displacement of every contact point at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Tree, freeze_arrays
from finger3d.contact.friction import OPEN
from finger3d.errors import Outcome

S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True)
class ContactState:
    """State of c contact points in d dimensions, in each point's frame: normal first, then tangents.

    Attributes
    ----------
    status : (c,) OPEN, STICK or SLIP
    force : (c, d) N, on the body
    gap : (c,) mm
    tangential_displacement : (c, d - 1) mm
        Tangential displacement relative to the object, w_t of Maeno 2004, Eq. 3; kept for open points too.
    accumulated_slip : (c, d - 1) mm
        Sum of the changes of `tangential_displacement` while the point touched.
    bases : (c, d, d), optional
        Each point's own directions, where they turn with the motion; otherwise the object's frame holds for all.
    """

    status: NDArray[np.int8]
    force: Float
    gap: Float
    tangential_displacement: Float
    accumulated_slip: Float
    bases: Float | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @classmethod
    def at_rest(cls, gap: Float, dim: int) -> ContactState:
        """Return the state without forces and displacements; gap (c,), mm."""
        c = len(gap)
        still = np.zeros((c, dim - 1))
        return cls(np.full(c, OPEN, dtype=np.int8), np.zeros((c, dim)), gap, still, still)

    @property
    def scene_force(self) -> Float:
        """Forces (c, d) N in x, y, z.

        Raises
        ------
        ValueError
            If the directions of the points are not known.
        """
        return np.asarray(np.einsum("ca,cak->ck", self.force, self.own_bases))

    @property
    def own_bases(self) -> Float:
        """Each point's own directions (c, d, d).

        Raises
        ------
        ValueError
            If they are not known.
        """
        if self.bases is None:
            raise ValueError("the directions of the points are not known")
        return self.bases

    def of_points(self, points: NDArray[np.intp]) -> ContactState:
        """Return the state of some points (k,)."""
        parts: Tree = {name: None if values is None else values[points] for name, values in vars(self).items()}
        return ContactState(**parts)


SNAPPED = "snapped"
"""Method of an increment in which the body snaps from an equilibrium that ends to another one."""


@dataclass(frozen=True)
class ContactSolution(Generic[S]):
    """Solution of one increment.

    Attributes
    ----------
    state : `ContactState`, or `finger3d.mechanics.history.State` with that of the body
        Valid only if `outcome` is CONVERGED; otherwise the state before the increment.
    residual : float
        Largest violation of Eqs. (1)-(4) and of "friction opposes slip", dimensionless.
    iterations : int
        Number of systems of equations that were factored, in all attempts.
    method : str
        Attempt that succeeded: newton, damped or full steps, ramp, pivots, sweeps; or paper; `SNAPPED` if the body
        went over to another equilibrium.
    detail : str
        Further information about a failure.
    """

    state: S
    outcome: Outcome
    residual: float
    iterations: int
    method: str
    detail: str = ""

    def with_state(self, state: T) -> ContactSolution[T]:
        """Return the solution with another state, such as that of contact and body."""
        return ContactSolution(state, self.outcome, self.residual, self.iterations, self.method, self.detail)


def pressure(force: Float, area: Float | None) -> Float:
    """Pressure (c,) MPa of contact forces (c, d) N on tributary areas (c,) mm2; NaN where these are unknown."""
    return np.full(len(force), np.nan) if area is None else force[:, 0] / area


def next_state(previous: ContactState, force: Float, moved: Float, status: NDArray[np.int8]) -> ContactState:
    """Return the state after an increment with forces, relative displacements `moved` (c, d) and status (c,)."""
    slid = np.where((status != OPEN)[:, None], moved[:, 1:], 0.0)
    return ContactState(
        status, force, moved[:, 0], previous.tangential_displacement + moved[:, 1:], previous.accumulated_slip + slid
    )
