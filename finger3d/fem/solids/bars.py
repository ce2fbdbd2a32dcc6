"""Bars embedded in a body at finite strain: axial forces and their tangent.

A bar between two points of the body has the strain e = |t + r| - 1, with its direction t at rest and the displacement r
of one end relative to the other over its length.  The body around the bars deforms by S T under their forces T, beyond
what the mesh resolves, so that ``e = T / k + S T`` (with S relaxing, see `BarRelaxation`).
"""

from __future__ import annotations

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
