"""Slip limit: the largest tangential forces and the largest torque that a contact transmits before it slips as a whole.

With normal forces as they are, every point transmits at most mu times its own.  The resultants that these allow are the
limit surface (Goyal, Ruina and Papadopoulos 1991).  Margins are what is left of it, from 1 to 0, where a point or the
whole contact slips, or nothing can be held.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import STICK, FrictionLaw
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.contact_points import ContactPoints

Region: TypeAlias = "NDArray[np.bool_] | slice"
"""Which contact points (m,) a region has."""

EVERYWHERE = slice(None)


@dataclass(frozen=True)
class SlipLimit:
    """Largest net friction along x and z, and torque about y, each alone; and how much of them a contact uses.

    Attributes
    ----------
    tangential_force_x_N, tangential_force_z_N : N; None along z for a section
    moment_y_Nmm : N mm, about the centre of pressure; None for a section
    used : from 0 to 1, at which the whole contact slips; friction against the ellipsoid with these semi-axes (Howe and
        Cutkosky 1996)
    """

    tangential_force_x_N: float
    tangential_force_z_N: float | None
    moment_y_Nmm: float | None
    used: float

    def as_dict(self) -> dict[str, float | None]:
        """Return the limits as an entry of summary.json."""
        return asdict(self)


def largest_force(
    points: ContactPoints, state: ContactState, friction: FrictionLaw, direction: Float, region: Region = EVERYWHERE
) -> tuple[float, float]:
    """Return the largest friction and the pressure (N) along a unit vector (3,), with the normal forces of a state."""
    normal, limit = _normals(points, state)[region], limits(points, state, friction)[region]
    along = normal @ direction
    across = np.linalg.norm(direction - along[:, None] * normal, axis=1)
    return float(limit @ across), float(state.force[region, 0] @ along)


def margins(points: ContactPoints, state: ContactState, friction: FrictionLaw) -> Float:
    """Return the margin (m,) of every point, 1 - |friction| / (mu N); 0 where it does not stick."""
    sticks, limit = state.status == STICK, limits(points, state, friction)
    used = np.divide(np.linalg.norm(state.force[:, 1:], axis=1), limit, out=np.ones_like(limit), where=limit > 0.0)
    return np.where(sticks, np.clip(1.0 - used, 0.0, 1.0), 0.0)


def slip_margin(
    points: ContactPoints, state: ContactState, friction: FrictionLaw, region: Region = EVERYWHERE
) -> float:
    """Return 1 less the tangential load over the largest that the whole contact can hold in its direction.

    The load is that of pressure and friction; 0: the contact slips as a whole.  The margin of a region is that of its
    points (m,) alone.
    """
    load = points.with_basis_of(state).to_global(state.force)[region].sum(axis=0) * np.array([1.0, 0.0, 1.0])
    size = float(np.linalg.norm(load))
    if not (state.status[region] == STICK).any() or not limits(points, state, friction)[region].any():
        return 0.0
    direction = load / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
    held = sum(largest_force(points, state, friction, direction, region))
    return min(max(1.0 - size / held, 0.0), 1.0) if held > 0.0 else 0.0


def slip_limit(points: ContactPoints, state: ContactState, friction: FrictionLaw) -> SlipLimit | None:
    """Return the slip limit of the whole finger in a state; None without contact or friction."""
    limit = limits(points, state, friction)
    if not limit.any():
        return None
    force = points.with_basis_of(state).friction(state.force)
    x, _ = largest_force(points, state, friction, np.array([1.0, 0.0, 0.0]))
    used = [(force[:, 0].sum(), x)]
    z = moment = None
    if points.dim == 3:
        z, _ = largest_force(points, state, friction, np.array([0.0, 0.0, 1.0]))
        arm = points.points - state.force[:, 0] @ points.points / state.force[:, 0].sum()
        normal = _normals(points, state)
        around = np.column_stack([arm[:, 2], np.zeros(len(arm)), -arm[:, 0]])  # y x arm
        moment = float(limit @ np.linalg.norm(around - np.sum(around * normal, axis=1)[:, None] * normal, axis=1))
        used += [(force[:, 2].sum(), z), (np.sum(around * force), moment)]
    # a wall across x has no friction along it
    return SlipLimit(x, z, moment, math.hypot(*(own / most for own, most in used if most)))


def limits(points: ContactPoints, state: ContactState, friction: FrictionLaw) -> Float:
    """Return the largest friction (m,) N of the points."""
    mu = friction.coefficients(state.status, state.force[:, 0] / points.area)
    return np.asarray(mu * state.force[:, 0])


def _normals(points: ContactPoints, state: ContactState) -> Float:
    """Return the normals (m, 3) of the points, into the finger."""
    along = np.zeros((len(state.force), points.dim))
    along[:, 0] = 1.0
    return points.with_basis_of(state).to_global(along)
