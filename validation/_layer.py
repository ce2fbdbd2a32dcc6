"""Frictionless indentation of a bonded elastic layer, in closed form but for one smooth integral equation.

The surface moves by C M(k h)/k under a pressure's Fourier (line) or Hankel (point) transform, C = 2/E*, with M(z) as in
validation/REFERENCES.md, 1.7.  A contact of half-width or radius a under a parabola x^2/2R is found from a function phi
on (0, a): the transform of the pressure is int phi(t) J0(k t) dt (line; phi = pi t/(C R) on a half-plane) or int phi(t)
cos(k t) dt (point; phi = 2 (d - t^2/R)/(pi C) on a half-space).  This turns the mixed problem into an equation of the
second kind, whose kernel contains 1 - M and decays as exp(-2z) (Lebedev and Ufliand 1958; Gladwell 1980, ch. 5).
Lengths are in units of h, 1/E* = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import j0

from finger3d._types import Float

_NODES = 40
_FAR = 40.0  # 1 - M(z) is below 1e-15 there


@dataclass(frozen=True)
class Indentation:
    """A parabola of radius R on a layer of thickness h, at the contact half-width or radius a.

    Attributes
    ----------
    force : over Hertz's at the same a: pi E* a^2/4R per width (line), 4 E* a^3/3R (point)
    depth : times R/a^2
    """

    force: float
    depth: float


def softness(z: Float, nu: float) -> Float:
    """M(z): 1 for a half-space, 0 for a rigid one."""
    k = 3.0 - 4.0 * nu
    e = np.exp(-2.0 * z)  # both sides times this, or large z would overflow
    return (k * (1.0 - e**2) - 4.0 * z * e) / (k * (1.0 + e**2) + (4.0 * z**2 + 1.0 + k**2) * e)


_gauss = cache(np.polynomial.legendre.leggauss)


def _rule(a: float, b: float, count: int) -> tuple[Float, Float]:
    x, w = _gauss(count)
    return 0.5 * (b - a) * (x + 1.0) + a, 0.5 * (b - a) * w


def _waves(a: float) -> tuple[Float, Float]:
    """Wave numbers (m,) and weights, for integrands that decay as exp(-2k) and swing as fast as 2 a k."""
    edges = np.linspace(0.0, _FAR, 41 + int(10 * a))
    parts = [_rule(lo, hi, 8) for lo, hi in zip(edges[:-1], edges[1:], strict=True)]
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


@cache
def line(a: float, nu: float) -> Indentation:
    """Cylinder on a layer, a = half-width over thickness."""
    t, w = _rule(0.0, a, _NODES)
    k, v = _waves(a)
    rest = v * (1.0 - softness(k, nu))
    wave = j0(np.outer(t, k))
    kernel = (wave * (rest * k)) @ wave.T * t[:, None]
    c = 2.0  # C = 2/E*
    phi = np.linalg.solve(np.eye(_NODES) - kernel * w, np.pi * t / c)
    # int M/k J0(kt) dk, its 1/k taken out as (1 - exp(-k))/k, whose integral is asinh(1/t)
    smooth = (v * (softness(k, nu) - 1.0 + np.exp(-k)) / k) @ wave.T
    depth = c / np.pi * (w * phi) @ (np.arcsinh(1.0 / t) + smooth)
    return Indentation(float(w @ phi / (np.pi * a**2 / 4.0)), float(depth / a**2))


@cache
def point(a: float, nu: float) -> Indentation:
    """Sphere on a layer, a = radius over thickness."""
    t, w = _rule(0.0, a, _NODES)
    k, v = _waves(a)
    rest = v * (1.0 - softness(k, nu))

    def solved(at: Float) -> tuple[Float, Float]:
        """phi at the points t for the right sides 1 and t^2, and both at `at`."""
        wave = np.cos(np.outer(t, k))
        kernel = 2.0 / np.pi * (wave * rest) @ wave.T
        sides = np.stack([np.ones(_NODES), t**2], axis=1)
        phi = np.linalg.solve(np.eye(_NODES) - kernel * w, sides)
        edge = 2.0 / np.pi * (np.cos(np.outer(at, k)) * rest) @ wave.T
        return phi, np.stack([np.ones(len(at)), at**2], axis=1) + (edge * w) @ phi

    inside, edge = solved(np.array([a]))
    depth = edge[0, 1] / edge[0, 0]  # the pressure is finite at the edge: phi(a) = 0
    c = 2.0
    phi = 2.0 / (np.pi * c) * (depth * inside[:, 0] - inside[:, 1])
    force = 2.0 * np.pi * w @ phi
    return Indentation(float(force / (4.0 / 3.0 * a**3)), float(depth / a**2))
