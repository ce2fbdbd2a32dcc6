"""Strain gauges of the finger."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from finger3d._ranges import Turn
from finger3d._types import Float
from finger3d.fem.mesh.simplex import Mesh, reflect_into_part
from finger3d.fem.surface.traces import displacement_row, strain_row
from finger3d.mechanics.readings.columns import Column, strain_columns
from finger3d.mechanics.readings.reading import MeshedBody, moved_place


@dataclass(frozen=True)
class Gauge:
    """Normal strain at a point along a direction in the x-y plane; its mean over `length_mm` if that is not zero.

    The strain at finite deformation is the relative elongation of the line.  The angle is in radians.
    """

    name: str
    x_mm: float
    y_mm: float
    z_mm: float = 0.0
    angle: Turn = 0.0
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

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of the strain."""
        return strain_columns(self.name)[:1]

    def mirrored(self, name: str) -> tuple[Gauge, tuple[float, ...]]:
        """Return the gauge at the mirror image about x = 0."""
        return replace(self, name=name, x_mm=-self.x_mm, angle=math.pi - self.angle), (1.0,)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the row (1, n d) of the strain along the gauge."""
        return self.row(body.mesh, body.axes)

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the relative elongation of the line, (1,)."""
        return np.array([self.finite_strain(body.mesh, u, body.axes)])

    def row(self, mesh: Mesh, axes: tuple[str, ...]) -> sp.csr_matrix:
        """Return the row (1, n d) that gives the strain from small displacements of a meshed part."""
        along = self.direction
        if self.is_point:
            return strain_row(mesh, *reflect_into_part(self.middle, along, axes, mesh.dim))
        start, end = (displacement_row(mesh, *reflect_into_part(x, along, axes, mesh.dim)) for x in self.ends)
        return sp.csr_matrix((end - start) / self.length_mm)

    def finite_strain(self, mesh: Mesh, u: Float, axes: tuple[str, ...]) -> float:
        """Return the relative elongation of the line under displacements u (n, d), mm, of a meshed part."""
        from finger3d.fem.solids.deformed import stretch

        if self.is_point:
            return stretch(mesh, u, *reflect_into_part(self.middle, self.direction, axes, mesh.dim))
        start, end = (moved_place(mesh, u, place, axes) for place in self.ends)
        return float(np.linalg.norm(end - start)) / self.length_mm - 1.0
