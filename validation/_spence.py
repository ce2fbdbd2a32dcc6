"""A cylinder pressed on an elastic half-plane with Coulomb friction: Spence's self-similar solution, computed.

While the load grows, the ratio c/a of the stick zone to the contact is constant, and every increment of the load adds
the tractions of a rigid flat punch of the present half-width a (Spence 1968).  So the flat punch is solved first, with
a = 1 and unit load; the cylinder follows by integration over a.  With the half-plane's surface slopes ::

    ux'/A = -beta p - H q,   uz'/A = beta q - H p,   H f(x) = (1/pi) PV int f(s) ds / (x - s)

the punch needs uz' = 0 for |x| < 1, ux' = 0 for |x| < c and q = mu p sign(x) beyond c.  Gauss-Chebyshev quadrature
(Erdogan and Gupta 1972) turns these into linear equations; mu is found for a given c by demanding that q is bounded at
c.  Results converge with the first order in the number of nodes and are extrapolated from three of them.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from finger3d._types import Float

_NODES = (96, 192, 384)


@dataclass(frozen=True)
class Pressed:
    """Constants of a press with friction; A = 2 (1 - nu^2)/E, R the radius, P the force per width.

    Attributes
    ----------
    stick : c/a
    force : P over Hertz's at the same a
    friction : integral of q over 0 < x < a, over P
    dissipation : energy dissipated per width, over A P^2
    shear : (11,) q A R/a at x/a = 0, 0.1, ... 1
    """

    stick: float
    force: float
    friction: float
    dissipation: float
    shear: Float


def dundurs(nu: float) -> float:
    """Return Dundurs' beta of an elastic body against a rigid one, plane strain."""
    return (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))


def line(nu: float, mu: float) -> Pressed:
    """Solve in plane strain; c/a must lie between 0.05 and 0.995."""
    count = _NODES[0] // 2
    # c is taken at grid angles, which all numbers of nodes share; mu falls as c does
    next_ = bisect_left(range(count - 1), mu, lo=2, key=lambda number: _extrapolated(nu, number)[0])
    first = min(max(next_ - 2, 1), count - 4)
    table = np.array([_extrapolated(nu, j) for j in range(first, first + 4)])
    values = KroghInterpolator(table[:, 0], table[:, 1:])(mu)
    return Pressed(*map(float, values[:4]), shear=values[4:])


@cache
def _extrapolated(nu: float, number: int) -> Float:
    """Return mu, c, and the constants of `Pressed` for c at a grid angle, extrapolated twice in 1/nodes."""
    coarse = _punch(dundurs(nu), _NODES[0], number, np.geomspace(0.01, 5.0, 120))
    near = coarse[0] * np.array([0.97, 1.03])
    middle, fine = (_punch(dundurs(nu), n, number * n // _NODES[0], near) for n in _NODES[1:])
    once, twice = 2.0 * middle - coarse, 2.0 * fine - middle
    return np.asarray((4.0 * twice - once) / 3.0)


def _punch(beta: float, nodes: int, stuck: int, trials: Float) -> Float:
    """Solve the flat punch with `stuck` nodes of the right half in the stick zone, and integrate.

    mu is sought between the first two of `trials` where the condition at c changes its sign without a pole.
    """
    half = nodes // 2
    angle = (np.arange(half) + 0.5) * np.pi / nodes  # from the middle of the contact, x = sin(angle)
    t, x = np.sin(angle), np.sin(np.arange(half) * np.pi / nodes)
    even = (1.0 / (x[:, None] - t) + 1.0 / (x[:, None] + t)) / nodes
    odd = (1.0 / (x[:, None] - t) - 1.0 / (x[:, None] + t)) / nodes
    mean = np.zeros((half, half))  # a value at x from those at t on either side
    mean[0, 0] = 1.0
    mean[np.arange(1, half), np.arange(half - 1)] = mean[np.arange(1, half), np.arange(1, half)] = 0.5
    mean /= np.sqrt(1.0 - x**2)[:, None]

    def solved(mu: float) -> tuple[float, Float, Float]:
        # unknown: p sqrt(1 - x^2) at all nodes, q sqrt(1 - x^2) at those that stick
        slip = np.where(np.arange(half) < stuck, 0.0, mu)
        normal = np.hstack([beta * mean * slip - even, beta * mean[:, :stuck]])[1:]
        load = np.concatenate([np.full(half, 2.0 * np.pi / nodes), np.zeros(stuck)])
        slope = np.hstack([-beta * mean - odd * slip, -odd[:, :stuck]])[: stuck + 1]
        right = np.zeros(half + stuck)
        right[half - 1] = 1.0
        z = np.linalg.solve(np.vstack([normal, load, slope[:-1]]), right)
        p = z[:half]
        return float(slope[-1] @ z), p, np.concatenate([z[half:], mu * p[stuck:]])

    misses = [solved(mu)[0] for mu in trials]
    at = next(
        k for k in range(len(trials) - 1) if misses[k] * misses[k + 1] < 0.0 and abs(misses[k] - misses[k + 1]) < 1e3
    )
    mu = brentq(lambda m: solved(m)[0], trials[at], trials[at + 1], xtol=1e-13)
    _, p, q = solved(mu)
    scale = 1.0 / np.sum(-p * np.log1p(-(t**2)) / t**2 / nodes)  # dP/da = scale a / (A R)
    step = np.pi / nodes
    slips = -(beta * mean @ p + odd @ q) * np.sqrt(1.0 - x**2) * step  # A-scaled increments of ux over one step
    moved = np.concatenate([np.zeros(stuck), np.cumsum(slips[stuck:]) - 0.5 * slips[stuck]])
    grown = np.append(np.cumsum((p / t**2 * step)[::-1])[::-1], 0.0)  # at x, from the edge inward
    loss = np.sum(mu * (x * grown[:-1] * np.abs(moved) * np.sqrt(1.0 - x**2))[stuck:]) * step
    sheared = np.append(np.cumsum((q / t**2 * step)[::-1])[::-1], 0.0)
    places = np.append(x, 1.0)
    shear = np.interp(np.linspace(0.0, 1.0, 11), places, scale * places * sheared)
    return np.array([mu, x[stuck], scale / np.pi, 2.0 * np.pi / nodes * q.sum() / 2.0, 2.0 * loss, *shear])
