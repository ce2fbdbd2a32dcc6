"""Maps of strain over a section for several values of mu, which show where a gauge is sensitive to mu.

The displacement is linear in the contact forces, so one solution with the stored factor gives the fields of all mu.
The strain is evaluated at the middle of every square of a grid, inside the cell that holds it, as for a point gauge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.fem.mesh.locate import locate
from finger3d.fem.mesh.simplex import Mesh, axis_numbers
from finger3d.fem.recovery.recover import displacement
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.results.history import StepResult

PIXEL_MM = 1.0

ANGLES = np.radians(np.arange(0.0, 180.0, 5.0))
"""Gauge directions that are compared for the best one."""


@dataclass(frozen=True)
class Reader:
    """Reads the strain of a displacement field at points of a mesh, those in mirror images included.

    Attributes
    ----------
    inside : (p,) whether a point lies in the body
    cells : (m,) the cells that hold the points inside
    gradients : (m, k, d) of the shape functions there, 1/mm
    turn : (m, d) signs of the mirror image
    """

    mesh: Mesh
    inside: NDArray[np.bool_]
    cells: Int
    gradients: Float
    turn: Float

    @classmethod
    def at(cls, mesh: Mesh, points: Float, axes: tuple[str, ...]) -> Reader:
        """Find the cells of points (p, d)."""
        d = mesh.dim
        turn = np.ones_like(points)
        for i in axis_numbers(axes):
            turn[:, i] = np.where(points[:, i] < 0.0, -1.0, 1.0)
        cells, bary = locate(mesh, points * turn)
        inside = cells >= 0
        nodes = mesh.points[mesh.cells[cells[inside]]]
        reference = mesh.element.gradient(bary[inside])
        jacobian = np.einsum("ekD,ekd->eDd", nodes, reference)
        return cls(mesh, inside, cells[inside], reference @ np.linalg.inv(jacobian), turn[inside][:, :d])

    def strain(self, u: Float) -> Float:
        """Return the in-plane strain (p, 3), components xx, yy, xy, of displacements (n, d); NaN outside the body."""
        return self._in_plane(self._gradient(u))

    def green_lagrange(self, u: Float) -> Float:
        """Return the in-plane Green-Lagrange strain (p, 3), components xx, yy, xy; NaN outside the body."""
        gradient = self._gradient(u)
        return self._in_plane(gradient + 0.5 * gradient.transpose(0, 2, 1) @ gradient)

    def _gradient(self, u: Float) -> Float:
        """Return the displacement gradient (m, d, d), du_i / dX_j, at the points inside."""
        gradient = np.einsum("eki,ekj->eij", u[self.mesh.cells[self.cells]], self.gradients)
        return np.asarray(gradient * self.turn[:, :, None] * self.turn[:, None, :])

    def _in_plane(self, tensor: Float) -> Float:
        """Return the components xx, yy and the mean of xy and yx of tensors (m, d, d) at all points (p, 3)."""
        out = np.full((len(self.inside), 3), np.nan)
        out[self.inside] = np.stack(
            [tensor[:, 0, 0], tensor[:, 1, 1], 0.5 * (tensor[:, 0, 1] + tensor[:, 1, 0])], axis=1
        )
        return out


@dataclass(frozen=True)
class StrainMap:
    """Strain over a plane z = const for ascending mu (m,).

    Attributes
    ----------
    x, y : (nx,), (ny,) mm, the middles of the squares
    strain : (m, ny, nx, 3) xx, yy, xy (tensor component); nan outside the body
    """

    mu: Float
    x: Float
    y: Float
    z_mm: float
    strain: Float

    @classmethod
    def of(
        cls, problem: Problem, steps: Mapping[float, StepResult], pixel_mm: float = PIXEL_MM, z_mm: float = 0.0
    ) -> StrainMap:
        """Recover the field of every step with the factor at hand, and read it at every square of the plane z_mm."""
        design = problem.model.design
        half, top = design.half_length_mm, design.height_mm
        nx, ny = math.ceil(half / pixel_mm), math.ceil(top / pixel_mm)
        x = np.arange(-nx + 0.5, nx, dtype=np.float64) * pixel_mm
        y = np.arange(0.5, ny, dtype=np.float64) * pixel_mm
        grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        points = np.insert(grid, 2, z_mm, axis=1)[:, : problem.dim]
        reader = Reader.at(problem.mesh, points, problem.axes)
        mus = np.array(sorted(steps))
        fields = []
        for unknowns in formulation_of(problem.model).unknowns(problem, [steps[float(mu)].meshed_state for mu in mus]):
            fields.append(reader.strain(displacement(problem.mesh, unknowns)).reshape(len(y), len(x), 3))
        return cls(mus, x, y, z_mm, np.array(fields))

    def along(self, angle: float) -> Float:
        """Return the normal strain (m, ny, nx) along a direction (radians)."""
        c, s = math.cos(angle), math.sin(angle)
        return np.asarray(self.strain @ np.array([c * c, s * s, 2.0 * s * c]))

    def slope(self, angle: float) -> Float:
        """d strain / d mu (m - 1, ny, nx) along a direction, between neighbouring mu."""
        return np.diff(self.along(angle), axis=0) / np.diff(self.mu)[:, None, None]

    def slope_at(self, angle: float, mu: float) -> Float:
        """d strain / d mu (ny, nx) along a direction in the interval that holds mu."""
        interval = np.clip(np.searchsorted(self.mu, mu, side="right") - 1, 0, len(self.mu) - 2)
        return np.asarray(self.slope(angle)[interval])

    def worst_slope(self, angle: float, low: float = -math.inf, high: float = math.inf) -> Float:
        """Return the smallest |d strain / d mu| (ny, nx) over mu from `low` to `high`; 0 where it changes its sign."""
        middle = 0.5 * (self.mu[1:] + self.mu[:-1])
        part = self.slope(angle)[(middle >= low) & (middle <= high)]
        least, most = part.min(axis=0), part.max(axis=0)
        return np.where(
            least * most > 0.0, np.minimum(np.abs(least), np.abs(most)), np.where(np.isnan(least), least, 0.0)
        )

    def best(self, low: float = -math.inf, high: float = math.inf) -> tuple[Float, Float]:
        """Return the largest worst slope (ny, nx) over mu from `low` to `high`, and its direction (radians)."""
        every = np.array([self.worst_slope(float(a), low, high) for a in ANGLES])
        pick = np.nan_to_num(every, nan=-1.0).argmax(axis=0)
        value = np.take_along_axis(every, pick[None], axis=0)[0]
        return value, np.where(np.isnan(value), np.nan, ANGLES[pick])
