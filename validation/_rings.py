"""A ball on the exact half-space under axisymmetric loads: the compliance of rings from its influence functions.

Rings of constant traction, displacements as means over a ring.  A ring of 1 N at radius s moves the surface at r by
uz = (1-nu)/(2 pi G) int J0(kr) J0(ks) dk (normal), ur = the same with J1 (radial), and crosswise by
-(1-2nu)/(4 pi G r) where r > s (Johnson 1985, secs. 3.2 and 3.6; the integrals are complete elliptic integrals).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipe, ellipkm1

from finger3d._types import Float
from finger3d.contact.friction import OPEN, STICK

from ._common import marched

_ORDER = 24


def _j0j0(r: Float, s: Float) -> Float:
    """int_0^inf J0(kr) J0(ks) dk."""
    return 2.0 / np.pi * ellipkm1(((r - s) / (r + s)) ** 2) / (r + s)


def _j1j1(r: Float, s: Float) -> Float:
    """int_0^inf J1(kr) J1(ks) dk."""
    rest = ((r - s) / (r + s)) ** 2
    k = np.sqrt(1.0 - rest)
    return ((2.0 / k - k) * ellipkm1(rest) - 2.0 / k * ellipe(1.0 - rest)) / (np.pi * np.sqrt(r * s))


@dataclass(frozen=True)
class Rings:
    """Rings of equal width that cover radii 0 to `edges[-1]` (mm), for E = 1 MPa; compliance (c, 2, c, 2) mm/N."""

    edges: Float
    compliance: Float

    @property
    def area(self) -> Float:
        """Areas (c,), mm2."""
        return np.pi * np.diff(self.edges**2)

    def gap(self, radius: float) -> Float:
        """Mean gap (c,) under a ball of a radius that touches, mm."""
        return (self.edges[1:] ** 2 + self.edges[:-1] ** 2) / (4.0 * radius)


def rings(nu: float, count: int, reach: float) -> Rings:
    """Compliance of `count` rings out to `reach` mm, E = 1 MPa; normal into the body, tangent outward."""
    edges = np.linspace(0.0, reach, count + 1)
    inner, outer = edges[:-1], edges[1:]
    area = np.pi * (outer**2 - inner**2)
    # s = r -+ t^2 on either side of r takes the logarithm out of a ring's effect on itself, and harms no other
    t, w = np.polynomial.legendre.leggauss(_ORDER)
    t, w = 0.5 * (t + 1.0), 0.5 * w
    at, share = _receivers(edges)
    normal, radial, cross = (np.zeros((count, count)) for _ in range(3))
    for i, (place, part) in enumerate(zip(at, share, strict=True)):
        for r, weight_r in zip(place, part, strict=True):
            cut = np.clip(r, inner, outer)
            for low, high, turn in ((inner, cut, True), (cut, outer, False)):
                length = (high - low)[:, None]
                s = high[:, None] - length * t**2 if turn else low[:, None] + length * t**2
                weight = weight_r * length * 2.0 * t * w * 2.0 * np.pi * s / area[:, None]
                normal[i] += np.sum(weight * _j0j0(r, s), axis=1)
                radial[i] += np.sum(weight * _j1j1(r, s), axis=1)
            cross[i] += weight_r * np.clip((r**2 - inner**2) * np.pi / area, 0.0, 1.0) / r  # load within r
    shear = 0.5 / (1.0 + nu)
    cross *= -(1.0 - 2.0 * nu) / (4.0 * np.pi * shear)
    whole = np.zeros((count, 2, count, 2))
    whole[:, 0, :, 0] = (1.0 - nu) / (2.0 * np.pi * shear) * normal
    whole[:, 1, :, 1] = (1.0 - nu) / (2.0 * np.pi * shear) * radial
    whole[:, 1, :, 0] = cross
    whole[:, 0, :, 1] = cross.T  # Betti
    flat = whole.reshape(2 * count, 2 * count)
    return Rings(edges, (0.5 * (flat + flat.T)).reshape(whole.shape))  # symmetric but for the quadrature


def _receivers(edges: Float) -> tuple[Float, Float]:
    """Radii (c, k) in every ring, and their shares of its area."""
    t, w = np.polynomial.legendre.leggauss(4)
    inner, outer = edges[:-1, None], edges[1:, None]
    r = 0.5 * (inner + outer) + 0.5 * (outer - inner) * t
    share = w * r
    return r, share / share.sum(axis=1, keepdims=True)


@dataclass(frozen=True)
class Press:
    """End of a press: P, T (N), dissipation D (mJ), a and c (mm), and the most iterations of an increment."""

    P: float
    T: float
    D: float
    a: float
    c: float
    iterations: int


def press(body: Rings, radius: float, mu: float, depths: Sequence[float]) -> Press:
    """Press a ball of a radius (mm) to each of the depths (mm) in turn."""
    steps = list(marched(body.gap(radius), body.compliance, mu, [(depth, 0.0) for depth in depths]))
    last, lost = steps[-1]
    force, status = last.state.force, last.state.status
    touching, sticking = (body.edges[1:][s].max(initial=0.0) for s in (status != OPEN, status == STICK))
    most = max(found.iterations for found, _ in steps)
    return Press(float(force[:, 0].sum()), float(np.abs(force[:, 1]).sum()), lost, touching, sticking, most)
