"""Labels for learning: what happens at the contact face, on a regular grid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import STATUS_NAMES
from finger3d.fem.mesh import CONTACT, Mesh
from finger3d.fem.surface import values_over
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, pose_entry
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid, grid_markers
from finger3d.mechanics.readings import Marker

Sample: TypeAlias = Mapping[str, NDArray[Any]]
"""Arrays of a sample by name: fields (s, nx, nz) or (s, nx, nz, k) after s increments, poses (s,), and the grid."""

FIELDS = {
    "displacement_mm": "displacement along x, y and z of the material point that was on the grid at rest, mm",
    "depth_mm": "how far the surface above the place of the grid has gone down, mm",
    "pressure_MPa": "normal traction, MPa",
    "shear_MPa": "traction of friction on the finger along x and z, MPa",
    "status": ", ".join(f"{number}: {name}" for number, name in enumerate(STATUS_NAMES)) + "; -1 beside the finger",
}


@dataclass(frozen=True)
class LabelGrid:
    """Regular grid over the contact face of a finger without symmetry planes.

    Attributes
    ----------
    problem : the condensed body; all of its contact face are contact points
    spacing_mm : of the grid, along x and z
    last_only : whether the fields after the last increment are asked for, else those after all
    """

    problem: Problem
    spacing_mm: float
    last_only: bool

    @cached_property
    def markers(self) -> tuple[Marker, ...]:
        """Places of the grid that are on the contact face, with x first."""
        return grid_markers(self.problem.model.design, self.spacing_mm, self.problem.dim)

    @cached_property
    def x_mm(self) -> Float:
        """Coordinates (nx,) of the grid."""
        return np.unique(np.round([marker.x_mm for marker in self.markers], 9))

    @cached_property
    def z_mm(self) -> Float:
        """Coordinates (nz,) of the grid; zero in a section."""
        return np.unique(np.round([marker.z_mm for marker in self.markers], 9))

    @cached_property
    def _flat(self) -> NDArray[np.int64]:
        """Numbers (k,) of the markers' places on the grid."""
        x, z = (np.round([getattr(marker, axis) for marker in self.markers], 9) for axis in ("x_mm", "z_mm"))
        return np.asarray(np.searchsorted(self.x_mm, x) * len(self.z_mm) + np.searchsorted(self.z_mm, z))

    @cached_property
    def _displacements(self) -> MarkerGrid:
        return MarkerGrid.at(self.problem, self.markers)

    @cached_property
    def _facets(self) -> NDArray[np.int64]:
        """Facets (f, d) of the contact face, as numbers of contact points."""
        points = self.problem.points
        return np.asarray(points.facets[(points.face[points.facets] == CONTACT).all(axis=1)])

    @cached_property
    def _rows(self) -> sp.csr_matrix:
        """Interpolation (k, m) between the contact points at rest."""
        return self._over(self.problem.points.points)[0]

    @cached_property
    def _nearest(self) -> NDArray[np.int64]:
        """Contact point (k,) nearest to each place."""
        return np.asarray(self._rows.argmax(axis=1)).ravel()

    def _over(self, points: Float) -> tuple[sp.csr_matrix, NDArray[np.bool_]]:
        """Return the interpolation (k, m) on the contact face with its points (m, 3) above the grid's places."""
        dim = self.problem.dim
        surface = Mesh(points[:, :dim], np.zeros((0, dim + 1), dtype=np.int64), {"contact": self._facets})
        return values_over(surface, self._facets, self._displacements.places[:, :dim], lowest=False)

    def _fields(self, step: StepResult, u: Float) -> dict[str, NDArray[Any]]:
        """Return the fields at the markers (k,) after an increment with nodal displacements (n, d)."""
        points, state = self.problem.points, step.state
        traction = state.force[:, 0] / points.area, points.with_basis_of(state).friction(state.force)
        shear = traction[1][:, ::2] / points.area[:, None]
        at_rest, dim = points.points, self.problem.dim
        now = at_rest.copy()
        now[:, :dim] += u[points.nodes]
        above, there = self._over(now)
        lowered = np.where(there, self._rows @ at_rest[:, 1] - above @ now[:, 1], np.nan)
        displaced = np.zeros((len(self.markers), 3))
        displaced[:, :dim] = self._displacements.displacements(u)
        return {
            "displacement_mm": displaced,
            "depth_mm": lowered,
            "pressure_MPa": self._rows @ traction[0],
            "shear_MPa": self._rows @ shear,
            "status": state.status[self._nearest],
        }

    def chosen(self, steps: Sequence[StepResult]) -> Sequence[StepResult]:
        """Return the increments whose fields are asked for; the last is among them."""
        return steps[-1:] if self.last_only else steps

    def _on_grid(self, values: Sequence[NDArray[Any]]) -> NDArray[Any]:
        stacked = np.stack(values)
        empty = np.nan if stacked.dtype.kind == "f" else -1
        size = len(self.x_mm) * len(self.z_mm)
        out = np.full((len(stacked), size, *stacked.shape[2:]), empty, dtype=stacked.dtype)
        out[:, self._flat] = stacked
        return out.reshape(len(stacked), len(self.x_mm), len(self.z_mm), *stacked.shape[2:])

    def sample(self, steps: Sequence[StepResult], moved: Iterable[Float]) -> dict[str, NDArray[Any]]:
        """Return the arrays of a sample; fields are NaN, and a status is -1, beside the contact face.

        Parameters
        ----------
        steps : increments of the body under an object, all converged
        moved : nodal displacements (n, d) mm after the increments that are asked for
        """
        chosen = self.chosen(steps)
        each = [self._fields(step, u) for step, u in zip(chosen, moved, strict=True)]
        fields = {name: self._on_grid([one[name] for one in each]) for name in FIELDS}
        poses = [pose_entry(step.target) for step in chosen]
        named = {f"pose/{name}": np.array([pose[name] for pose in poses]) for name in poses[0]}
        return {**fields, **named, "x_mm": self.x_mm, "z_mm": self.z_mm}
