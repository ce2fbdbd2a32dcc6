"""Foils in an infinite body: their compliance under their own forces, which a mesh of the body does not resolve.

A foil transfers its force to the body in patches, and a patch displaces the body as Kelvin's point force does
(Timoshenko and Goodier 1970, sec. 130; in the plane sec. 42): ``u = c [(3 - 4 nu) t/r + x (x.t)/r^3]``, in plane stress
``c [-(3 - nu) t log r + (1 + nu) x (x.t)/r^2]``.  On the foil itself the patches are integrated, on others they are
points.  Bars between the patches' middles pull at both their ends, and read the strain between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float

_BLUNT = 0.3  # of a patch's size: what a point force of another foil is spread over, where they cross


@dataclass(frozen=True)
class InfiniteBody:
    """Infinite elastic body; a section of it is `thickness` mm wide, and None stands for a solid."""

    E_MPa: float
    nu: float
    plane_stress: bool = False
    thickness: float | None = None

    @property
    def _plane(self) -> tuple[float, float]:
        """Young's modulus and Poisson's ratio of the equivalent plane stress."""
        if self.plane_stress:
            return self.E_MPa, self.nu
        return self.E_MPa / (1.0 - self.nu**2), self.nu / (1.0 - self.nu)

    def pushed(self, reach: Float, t: Float, force: Float, blunt: Float) -> Float:
        """Return the displacement along t (3,) at `reach` (..., 3), mm, of 1 N along `force` spread over `blunt`."""
        square = (reach**2).sum(axis=-1) + blunt**2
        ahead = (reach @ t) * (reach @ force) / square
        if self.thickness is None:
            scale = (1.0 + self.nu) / (8.0 * math.pi * self.E_MPa * (1.0 - self.nu))
            return np.asarray(scale * ((3.0 - 4.0 * self.nu) * float(t @ force) + ahead) / np.sqrt(square))
        E, nu = self._plane
        scale = (1.0 + nu) / (4.0 * math.pi * E * self.thickness)
        return np.asarray(scale * ((1.0 + nu) * ahead - 0.5 * (3.0 - nu) * float(t @ force) * np.log(square)))

    def pushed_by_own(self, begin: Float, end: Float, low: Float, high: Float, s: Float, z: Float) -> Float:
        """Return the displacement along a foil at s (along it) and z (across it) due to 1 N on each of its patches."""
        if self.thickness is None:
            whole = sum(
                sign * _corner(x - s, y - z, self.nu)
                for x, y, sign in ((end, high, 1.0), (begin, high, -1.0), (end, low, -1.0), (begin, low, 1.0))
            )
            scale = (1.0 + self.nu) / (8.0 * math.pi * self.E_MPa * (1.0 - self.nu))
            return scale * np.asarray(whole) / ((end - begin) * (high - low))
        E, nu = self._plane
        scale = (1.0 + nu) * (3.0 - nu) / (4.0 * math.pi * E * self.thickness)
        return scale * (_log(begin - s) - _log(end - s)) / (end - begin) * np.ones(np.broadcast(s, z, low).shape)


@dataclass(frozen=True)
class FoilPatches:
    """A foil cut into patches: `along` (n + 1,) and `across` (m + 1,) their edges, mm from the middle.

    Bars join the middles of patches that follow each other along the foil, numbered ``i * m + k``, i along and k across
    (z).  They cover the foil but for half a patch at its ends.  In a section m = 1.
    """

    middle: Float
    direction: Float
    along: Float
    across: Float

    @classmethod
    def of(cls, middle: Float, direction: Float, length: float, width: float, count: int, lines: int) -> FoilPatches:
        """Divide a foil at Chebyshev points: densely at its ends, where it transfers most of its force."""
        return cls(middle, direction, _cosines(length, count), _cosines(width, lines))

    @property
    def area(self) -> Float:
        """Length times width (n m - m,) mm2 of the bars."""
        return np.outer(np.diff(_middles(self.along)), np.diff(self.across)).ravel()

    @property
    def places(self) -> Float:
        """Middles (n, m, 3) mm of the patches: the ends of the bars."""
        aside = _middles(self.across)[None, :, None] * np.array([0.0, 0.0, 1.0])
        return np.asarray(self.middle + _middles(self.along)[:, None, None] * self.direction + aside)

    def strained_by(self, other: FoilPatches, body: InfiniteBody) -> Float:
        """Return the strain (n m - m, n' m' - m') of the bars per unit force of the bars of another foil, 1/(N mm)."""
        if other is self:
            s, z = _middles(self.along)[:, None, None, None], _middles(self.across)[None, :, None, None]
            begin, end = self.along[:-1, None], self.along[1:, None]
            moved = body.pushed_by_own(begin, end, self.across[:-1], self.across[1:], s, z)
        else:
            reach = self.places[:, :, None, None] - other.places
            size = np.hypot(self._sizes(body)[:, :, None, None], other._sizes(body))
            moved = body.pushed(reach, self.direction, other.direction, _BLUNT * size)
        steps = [np.diff(np.eye(len(f.along) - 1), axis=0) / np.diff(_middles(f.along))[:, None] for f in (self, other)]
        found = np.einsum("ia,akbl,jb->ikjl", steps[0], moved, steps[1], optimize=True)
        return np.asarray(found.reshape(len(self.area), len(other.area)))

    def _sizes(self, body: InfiniteBody) -> Float:
        """Extent (n, m) mm of the patches."""
        along, across = np.diff(self.along)[:, None], np.diff(self.across)
        return np.sqrt(along * across) if body.thickness is None else along


def _middles(edges: Float) -> Float:
    return 0.5 * (edges[1:] + edges[:-1])


def _cosines(length: float, count: int) -> Float:
    return -0.5 * length * np.cos(np.pi * np.arange(count + 1) / count)


def _corner(x: Float, z: Float, nu: float) -> Float:
    """Integral of (3 - 4 nu)/r + x^2/r^3 over the rectangle from the origin to (x, z)."""
    x, z = np.broadcast_arrays(x, z)
    first = z * np.arcsinh(np.divide(x, np.abs(z), out=np.zeros(x.shape), where=z != 0.0))
    second = x * np.arcsinh(np.divide(z, np.abs(x), out=np.zeros(x.shape), where=x != 0.0))
    return (3.0 - 4.0 * nu) * (first + second) + first


def _log(x: Float) -> Float:
    """Integral of log|x|."""
    return x * (np.log(np.abs(x), out=np.zeros(x.shape), where=x != 0.0) - 1.0)
