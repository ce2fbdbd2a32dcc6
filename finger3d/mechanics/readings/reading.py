"""Readings of the finger: what its sensors measure, as rows that act on the unknowns, and at finite strain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Stiffness, times
from finger3d.fem.mesh.locate import cells_at
from finger3d.fem.mesh.simplex import Mesh, reflect_into_part
from finger3d.fem.surface.traces import displacement_rows
from finger3d.mechanics.readings.columns import Column, displacement_columns, pressure_column


@dataclass(frozen=True)
class MeshedBody:
    """The meshed part of the finger that readings are taken from.

    Attributes
    ----------
    axes : symmetry planes; a reading in a mirror image is taken from the part
    thickness : width of a section, 1 for a solid, mm
    moduli : shear modulus of each part by its number, MPa
    """

    mesh: Mesh
    axes: tuple[str, ...]
    stiffness: Stiffness
    thickness: float
    moduli: tuple[float, ...]


class Reading(Protocol):
    """Numbers read from the finger; linear in small strain."""

    @property
    def name(self) -> str:
        """Name in the output."""
        ...

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of each number, in 2 or 3 dimensions."""
        ...

    def mirrored(self, name: str) -> tuple[Reading, tuple[float, ...]]:
        """Return the reading at the mirror image about x = 0, and the sign of each number there in a mirrored press."""
        ...

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the rows (k, N) or (k, n d) that give the numbers from the unknowns of small strain."""
        ...

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the numbers (k,) under finite displacements u (n, d), mm, and internal forces (n, d), N."""
        ...


@dataclass(frozen=True)
class Marker:
    """Displacement of a material point in mm, as a camera sees a dot."""

    name: str
    x_mm: float
    y_mm: float
    z_mm: float = 0.0

    @property
    def place(self) -> Float:
        """Place (3,) mm at rest."""
        return np.array([self.x_mm, self.y_mm, self.z_mm])

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return a column for each component of the displacement."""
        return displacement_columns(self.name, dim)

    def mirrored(self, name: str) -> tuple[Marker, tuple[float, ...]]:
        """Return the marker at the mirror image about x = 0; its displacement along x changes its sign."""
        return replace(self, name=name, x_mm=-self.x_mm), (-1.0, 1.0, 1.0)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the rows (d, n d) of the displacement."""
        inside, sign = reflect_into_part(self.place, np.ones(3), body.axes, body.mesh.dim)
        return displacement_rows(body.mesh, inside, sign)

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the displacement (d,)."""
        return moved_place(body.mesh, u, self.place, body.axes) - self.place[: body.mesh.dim]


@dataclass(frozen=True)
class Taxel:
    """Mean pressure in MPa on a rectangle of the base, per area at rest, as a pressure cell below the finger reads it.

    Only a solid needs the width along z.
    """

    name: str
    x_mm: float
    z_mm: float
    length_mm: float
    width_mm: float | None = None

    def columns(self, dim: int) -> tuple[Column, ...]:
        """Return the column of the pressure."""
        return (pressure_column(self.name),)

    def mirrored(self, name: str) -> tuple[Taxel, tuple[float, ...]]:
        """Return the taxel at the mirror image about x = 0."""
        return replace(self, name=name, x_mm=-self.x_mm), (1.0,)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        """Return the row (1, N) of the pressure: nodal forces are the stiffness times the unknowns."""
        upper = body.stiffness.upper
        on_forces = np.zeros(upper.shape[0])
        on_forces[: body.mesh.points.size] = self.base_displacement(body)
        return sp.csr_matrix(times(upper, on_forces))

    def base_displacement(self, body: MeshedBody) -> Float:
        """Return the nodal displacements (n d,) whose work with the nodal forces is the pressure, per mm2."""
        displacement = np.zeros(body.mesh.points.shape)
        displacement[:, 1] = self._weights(body)
        return displacement.ravel()

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        """Return the pressure (1,)."""
        return np.array([self._weights(body) @ forces[:, 1]])

    def _weights(self, body: MeshedBody) -> Float:
        """Return the weights (n,) of the nodal forces along y."""
        from finger3d.fem.recovery.reactions import mean_traction_weights

        sides = [("x", self.x_mm, self.length_mm)]
        if body.mesh.dim == 3:
            if self.width_mm is None:
                raise Finger3dError(f"taxel {self.name}: width_mm is missing; a solid needs it")
            sides.append(("z", self.z_mm, self.width_mm))
        bounds = [_folded(at - 0.5 * extent, at + 0.5 * extent, axis in body.axes) for axis, at, extent in sides]
        boxes = np.array([np.transpose(box) for box in product(*bounds)])
        try:
            return mean_traction_weights(body.mesh, "base", boxes, body.thickness, body.moduli)
        except Finger3dError as error:
            raise Finger3dError(f"taxel {self.name}: {error}") from None


def _folded(low: float, high: float, mirrored: bool) -> list[tuple[float, float]]:
    """Return an interval as intervals of the meshed part, which a symmetry plane at 0 bounds if it is mirrored."""
    if not mirrored:
        return [(low, high)]
    images = (max(low, 0.0), high), (max(-high, 0.0), -low)
    return [(start, stop) for start, stop in images if stop > start]


def moved_place(mesh: Mesh, u: Float, place: Float, axes: tuple[str, ...]) -> Float:
    """Return where a material point (3,) of the whole finger goes, (d,), under displacements u (n, d) of the part."""
    d = mesh.dim
    inside, sign = reflect_into_part(place, np.ones(3), axes, d)
    cell, barycentric = cells_at(mesh, inside)[0]
    return np.asarray(place[:d] + sign * (mesh.element.shape(barycentric[None])[0] @ u[mesh.cells[cell]]))
