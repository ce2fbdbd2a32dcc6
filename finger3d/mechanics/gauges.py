"""Gauges: strain readings of the finger, as rows that act on displacements and at finite strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.locate import cells_at
from finger3d.fem.simplex import Mesh, reflect_into_part
from finger3d.fem.traces import displacement_row, strain_row


class Reading(Protocol):
    """A number read from the displacements of the finger; linear in small strain."""

    @property
    def name(self) -> str:
        """Name in the output."""
        ...

    def row(self, mesh: Mesh, axes: tuple[str, ...]) -> sp.csr_matrix:
        """Return the row (1, n d) that gives the reading from small displacements of the meshed part.

        Parameters
        ----------
        axes : symmetry planes; a reading in a mirror image is taken from the part
        """
        ...

    def finite_strain(self, mesh: Mesh, u: Float, axes: tuple[str, ...]) -> float:
        """Return the reading under finite displacements u (n, d) mm of the meshed part."""
        ...


@dataclass(frozen=True)
class Gauge:
    """Normal strain at a point along a direction in the x-y plane; its mean over `length_mm` if that is not zero.

    The strain at finite deformation is the relative elongation of the line.  The angle is in radians.
    """

    name: str
    x_mm: float
    y_mm: float
    z_mm: float = 0.0
    angle: float = 0.0
    length_mm: float = 0.0

    @property
    def is_point(self) -> bool:
        """Whether the strain is read at a point and not as a mean."""
        return self.length_mm == 0.0

    @property
    def middle(self) -> Float:
        """Place (3,) mm."""
        return np.array([self.x_mm, self.y_mm, self.z_mm])

    @property
    def direction(self) -> Float:
        """Unit vector (3,)."""
        return np.array([np.cos(self.angle), np.sin(self.angle), 0.0])

    @property
    def ends(self) -> tuple[Float, Float]:
        """Both ends (3,) mm."""
        half = 0.5 * self.length_mm * self.direction
        return self.middle - half, self.middle + half

    def row(self, mesh: Mesh, axes: tuple[str, ...]) -> sp.csr_matrix:
        """Return the row of the strain along the gauge; see `Reading.row`."""
        along = self.direction
        if self.is_point:
            return strain_row(mesh, *reflect_into_part(self.middle, along, axes, mesh.dim))
        start, end = (displacement_row(mesh, *reflect_into_part(x, along, axes, mesh.dim)) for x in self.ends)
        return sp.csr_matrix((end - start) / self.length_mm)

    def finite_strain(self, mesh: Mesh, u: Float, axes: tuple[str, ...]) -> float:
        """Return the relative elongation of the line; see `Reading.finite_strain`."""
        from finger3d.fem.hyperelastic import stretch

        if self.is_point:
            return stretch(mesh, u, *reflect_into_part(self.middle, self.direction, axes, mesh.dim))
        start, end = (_moved(mesh, u, place, axes) for place in self.ends)
        return float(np.linalg.norm(end - start)) / self.length_mm - 1.0


def _moved(mesh: Mesh, u: Float, place: Float, axes: tuple[str, ...]) -> Float:
    """Return where a material point (3,) of the whole finger goes, (d,)."""
    d = mesh.dim
    inside, sign = reflect_into_part(place, np.ones(3), axes, d)
    cell, barycentric = cells_at(mesh, inside)[0]
    return np.asarray(place[:d] + sign * (mesh.element.shape(barycentric[None])[0] @ u[mesh.cells[cell]]))
