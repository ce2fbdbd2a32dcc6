"""What is embedded in a body: bars at finite strain, and foils in an infinite body.

A bar between two points of the body has the strain e = |t + r| - 1, with its direction t at rest and the displacement r
of one end relative to the other over its length.  The body around the bars deforms by S T under their forces T, beyond
what the mesh resolves, so that ``e = T / k + S T`` (with S relaxing, see `BarRelaxation`).

A foil transfers its force to the body in patches, and a patch displaces the body as Kelvin's point force does
(Timoshenko and Goodier 1970, sec. 130; in the plane sec. 42): ``u = c [(3 - 4 nu) t/r + x (x.t)/r^3]``, in plane stress
``c [-(3 - nu) t log r + (1 + nu) x (x.t)/r^2]``.  On the foil itself the patches are integrated, on others they are
points.  Bars between the patches' middles pull at both their ends, and read the strain between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.solvers.condense import spring_forces
from finger3d.fem.tensors import block_diagonal


@dataclass(frozen=True)
class BarRelaxation:
    """Relaxation over one increment of time: ``T = S^-1 (factor s - past)``, s (b,) the strain of the surroundings."""

    factor: float
    past: Float


@dataclass(frozen=True)
class Bars:
    """Bars between points of a mesh with n nodes.

    Attributes
    ----------
    directions : (b, d) unit vectors at rest
    relative : (b d, n d) sparse, 1/mm
        Displacement of one end relative to the other, over the bar's length.
    stiffness : (b,) N mm, forces times length per strain
    yielding : (b, b) strain of the bars' surroundings per force times length, which the mesh does not resolve
    """

    directions: Float
    relative: sp.csr_matrix
    stiffness: Float
    yielding: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def _vectors(self, u: Float) -> tuple[Float, Float]:
        """Deformed vectors (b, d) over the initial length, and their lengths (b,)."""
        vectors = self.directions + (self.relative @ u.ravel()).reshape(self.directions.shape)
        return vectors, np.linalg.norm(vectors, axis=1)

    def _whole_strain(self, u: Float) -> Float:
        """Strain (b,) of bars and surroundings; at rest without round-off, which a small force would not exceed."""
        vectors, length = self._vectors(u)
        apart = (self.relative @ u.ravel()).reshape(vectors.shape)
        return np.asarray(np.einsum("bk,bk->b", apart, vectors + self.directions) / (length + 1.0))

    def _stiffness(self, relaxation: BarRelaxation | None) -> Float:
        factor = 1.0 if relaxation is None else relaxation.factor
        return np.asarray(np.linalg.inv(np.diag(1.0 / self.stiffness) + self.yielding / factor))

    def tension(self, u: Float, relaxation: BarRelaxation | None = None) -> Float:
        """Return the forces times lengths (b,) N mm at displacements u (n, d) mm."""
        strain = self._whole_strain(u)
        if relaxation is not None:
            strain = strain - relaxation.past / relaxation.factor
        return np.asarray(self._stiffness(relaxation) @ strain)

    def strain(self, u: Float, yielded: Float) -> Float:
        """Return the strain (b,) of the bars themselves, less that by which their surroundings have yielded (b,)."""
        return np.asarray(self._whole_strain(u) - yielded)

    def yielded(self, u: Float, relaxation: BarRelaxation | None = None) -> Float:
        """Return the strain (b,) by which the surroundings have yielded."""
        return np.asarray(self._whole_strain(u) - self.tension(u, relaxation) / self.stiffness)

    def forces(self, u: Float, relaxation: BarRelaxation | None = None) -> Float:
        """Return the internal nodal forces (n d,) N of the bars."""
        vectors, length = self._vectors(u)
        pull = (self.tension(u, relaxation) / length)[:, None] * vectors
        return np.asarray(self.relative.T @ pull.ravel())

    def tangent(self, u: Float, relaxation: BarRelaxation | None = None) -> sp.csr_matrix:
        """Return the derivative (n d, n d) of the forces, N/mm."""
        vectors, length = self._vectors(u)
        unit = vectors / length[:, None]
        count = len(length)
        d = unit.shape[1]
        along = sp.csr_matrix((unit.ravel(), np.arange(count * d), np.arange(count + 1) * d)) @ self.relative
        across = np.eye(d) - unit[:, :, None] * unit[:, None, :]
        blocks = (self.tension(u, relaxation) / length)[:, None, None] * across
        stretching = along.T @ sp.csr_matrix(self._stiffness(relaxation)) @ along
        return sp.csr_matrix(stretching + self.relative.T @ block_diagonal(blocks) @ self.relative)

    @property
    def coupled_nodes(self) -> tuple[Int, Int]:
        """All pairs of nodes that the bars couple, as two arrays."""
        nodes = np.unique(self.relative.indices // self.directions.shape[1]).astype(np.int64)
        first, second = np.meshgrid(nodes, nodes, indexing="ij")
        return first.ravel(), second.ravel()


@dataclass(frozen=True, kw_only=True)
class AddedStiffness:
    """Stiffness of inclusions on the last rows of a condensed body.

    Attributes
    ----------
    bars : the inclusions at finite strain; None without
    gauge_weights : (g, s) strain of each gauge from those of the bars
    bar_stiffness : (s,) N mm
        Stiffness that the inclusions add to each of the last s rows.
    subgrid_compliance : (g + s, g + s)
        Compliance of the last rows, gauges and inclusions, that the mesh does not resolve.
    """

    bars: Bars | None = None
    gauge_weights: Float = field(default_factory=lambda: np.zeros((0, 0)))
    bar_stiffness: Float = field(default_factory=lambda: np.zeros(0))
    subgrid_compliance: Float = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def with_spring_forces(self, compliance: Float, rows: Float, moved: Float | None = None) -> Float:
        """Set the forces of inclusions in forces (r, ...) N on condensed rows, and return these.

        Parameters
        ----------
        compliance : (r, r) mm/N, of the body without inclusions
        moved : (r, ...) mm, displacements due to other causes, if any
        """
        if len(springs := self.bar_stiffness):
            without = compliance @ rows if moved is None else moved + compliance @ rows
            rows[-len(springs) :] = spring_forces(compliance, springs, without)
        return rows


_REGULARISATION = 0.3  # of a patch's size: length over which a point force is spread, since foils may cross


@dataclass(frozen=True)
class InfiniteBody:
    """Infinite elastic body; a section of it is `thickness` mm wide, and None stands for a solid."""

    E_MPa: float
    nu: float
    plane_stress: bool = False
    thickness: float | None = None

    @property
    def _equivalent_plane_stress(self) -> tuple[float, float]:
        """Young's modulus and Poisson's ratio of the equivalent plane stress."""
        if self.plane_stress:
            return self.E_MPa, self.nu
        return self.E_MPa / (1.0 - self.nu**2), self.nu / (1.0 - self.nu)

    def displacement(self, x: Float, t: Float, force: Float, length: Float) -> Float:
        """Return the displacement along t (3,) at x (..., 3) mm due to 1 N at 0 along `force`, spread over `length`."""
        square = (x**2).sum(axis=-1) + length**2
        radial = (x @ t) * (x @ force) / square
        if self.thickness is None:
            scale = (1.0 + self.nu) / (8.0 * math.pi * self.E_MPa * (1.0 - self.nu))
            return np.asarray(scale * ((3.0 - 4.0 * self.nu) * float(t @ force) + radial) / np.sqrt(square))
        E, nu = self._equivalent_plane_stress
        scale = (1.0 + nu) / (4.0 * math.pi * E * self.thickness)
        return np.asarray(scale * ((1.0 + nu) * radial - 0.5 * (3.0 - nu) * float(t @ force) * np.log(square)))

    def self_displacement(self, begin: Float, end: Float, low: Float, high: Float, s: Float, z: Float) -> Float:
        """Return the displacement along a foil at s (along it) and z (across it) due to 1 N on each of its patches."""
        if self.thickness is None:
            integral = sum(
                sign * _kernel_integral(x - s, y - z, self.nu)
                for x, y, sign in ((end, high, 1.0), (begin, high, -1.0), (end, low, -1.0), (begin, low, 1.0))
            )
            scale = (1.0 + self.nu) / (8.0 * math.pi * self.E_MPa * (1.0 - self.nu))
            return scale * np.asarray(integral) / ((end - begin) * (high - low))
        E, nu = self._equivalent_plane_stress
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
        return cls(middle, direction, _chebyshev_points(length, count), _chebyshev_points(width, lines))

    @property
    def area(self) -> Float:
        """Length times width (n m - m,) mm2 of the bars."""
        return np.outer(np.diff(_middles(self.along)), np.diff(self.across)).ravel()

    @property
    def centres(self) -> Float:
        """Centres (n, m, 3) mm of the patches: the ends of the bars."""
        across = _middles(self.across)[None, :, None] * np.array([0.0, 0.0, 1.0])
        return np.asarray(self.middle + _middles(self.along)[:, None, None] * self.direction + across)

    def strain_due_to(self, other: FoilPatches, body: InfiniteBody) -> Float:
        """Return the strain (n m - m, n' m' - m') of the bars per unit force of the bars of another foil, 1/(N mm)."""
        if other is self:
            s, z = _middles(self.along)[:, None, None, None], _middles(self.across)[None, :, None, None]
            begin, end = self.along[:-1, None], self.along[1:, None]
            displacement = body.self_displacement(begin, end, self.across[:-1], self.across[1:], s, z)
        else:
            offset = self.centres[:, :, None, None] - other.centres
            size = np.hypot(self._sizes(body)[:, :, None, None], other._sizes(body))
            displacement = body.displacement(offset, self.direction, other.direction, _REGULARISATION * size)
        steps = [np.diff(np.eye(len(f.along) - 1), axis=0) / np.diff(_middles(f.along))[:, None] for f in (self, other)]
        strain = np.einsum("ia,akbl,jb->ikjl", steps[0], displacement, steps[1], optimize=True)
        return np.asarray(strain.reshape(len(self.area), len(other.area)))

    def _sizes(self, body: InfiniteBody) -> Float:
        """Extent (n, m) mm of the patches."""
        along, across = np.diff(self.along)[:, None], np.diff(self.across)
        return np.sqrt(along * across) if body.thickness is None else along


def _middles(edges: Float) -> Float:
    return 0.5 * (edges[1:] + edges[:-1])


def _chebyshev_points(length: float, count: int) -> Float:
    return -0.5 * length * np.cos(np.pi * np.arange(count + 1) / count)


def _kernel_integral(x: Float, z: Float, nu: float) -> Float:
    """Integral of (3 - 4 nu)/r + x^2/r^3 over the rectangle from the origin to (x, z)."""
    x, z = np.broadcast_arrays(x, z)
    first = z * np.arcsinh(np.divide(x, np.abs(z), out=np.zeros(x.shape), where=z != 0.0))
    second = x * np.arcsinh(np.divide(z, np.abs(x), out=np.zeros(x.shape), where=x != 0.0))
    return (3.0 - 4.0 * nu) * (first + second) + first


def _log(x: Float) -> Float:
    """Integral of log|x|."""
    return x * (np.log(np.abs(x), out=np.zeros(x.shape), where=x != 0.0) - 1.0)
