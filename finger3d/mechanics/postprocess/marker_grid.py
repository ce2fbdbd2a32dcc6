"""Displacements of markers: those of the scene, and of a grid on the contact face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Tree
from finger3d.fem.mesh import FREE_FACES, in_space, signs_into_part
from finger3d.fem.recovery import displacement
from finger3d.fem.surface import values_over
from finger3d.geometry.design import Design
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, pose_entry
from finger3d.mechanics.readings import Column, Marker, displacement_columns
from finger3d.meshing.given import GivenMesh

_INWARD = 1e-9
"""Share of the way to the middle of a facet by which a point on its border is moved: its line then meets the facet."""


def grid_markers(design: Design, spacing_mm: float, dim: int) -> tuple[Marker, ...]:
    """Return markers every `spacing_mm` along x and z, with one in the middle, as far as the contact face goes.

    Their number, order and places follow from the shape of the finger alone, whatever the mesh.
    """
    x, z = (np.arange(-(half // spacing_mm), half // spacing_mm + 1.0) * spacing_mm
            for half in (design.half_length_mm, design.width_mm / 2.0))  # fmt: skip
    z = z if dim == 3 else np.zeros(1)
    x, z = x.repeat(len(z)), np.tile(z, len(x))
    places = np.stack([x, design.top(x, z), z], axis=1)
    there = np.isfinite(places[:, 1])
    if isinstance(design, GivenMesh):
        there &= values_over(design.mesh, design.mesh.facets["contact"], places, lowest=False)[1]
    return tuple(Marker(f"grid_{k}", *place) for k, place in enumerate(places[there].tolist(), start=1))


@dataclass(frozen=True)
class MarkerGrid:
    """Markers on the contact face of the whole finger.

    Attributes
    ----------
    markers : k of them
    rows : (k, n) sparse
        Interpolation from the nodes of the meshed part.
    sign : (k, d) factor of the components of a displacement, -1 in a mirror image
    """

    markers: tuple[Marker, ...]
    rows: sp.csr_matrix
    sign: Float

    @classmethod
    def of(cls, problem: Problem, spacing_mm: float) -> MarkerGrid:
        """Return the markers of `grid_markers`."""
        return cls.at(problem, grid_markers(problem.model.design, spacing_mm, problem.dim))

    @classmethod
    def at(cls, problem: Problem, markers: Sequence[Marker]) -> MarkerGrid:
        """Return markers on any mesh of the finger; one beside the facets of a curved rim is read at the nearest."""
        mesh, places = problem.mesh, np.array([m.place[: problem.dim] for m in markers])
        sign = signs_into_part(places, problem.axes)
        places *= sign
        facets = mesh.facets["contact"]
        if problem.dim == 3:
            facets = np.vstack([mesh.facets[label] for label in FREE_FACES if label in mesh.facets])
        rows, there = values_over(mesh, facets, places, lowest=False)
        if not there.all():
            surface = Triangles(mesh.points, facets[:, :3])
            nearest, face, _ = surface.closest(places[~there])
            places[~there] = nearest + _INWARD * (surface.corners[face].mean(axis=1) - nearest)
            rows, _ = values_over(mesh, facets, places, lowest=False)
        return cls(tuple(markers), rows, sign)

    @property
    def places(self) -> Float:
        """Places (k, 3) mm, at rest."""
        return np.array([m.place for m in self.markers])

    def displacements(self, u: Float) -> Float:
        """Return the displacements (k, d) of the markers from those (n, d) of the part's nodes."""
        return np.asarray(self.sign * (self.rows @ u))

    def readings(self, problem: Problem, step: StepResult) -> dict[Column, float]:
        """Return the displacements after an increment of a problem, as those of other markers."""
        (unknowns,) = formulation_of(problem.model).unknowns(problem, [step.meshed_state])
        moved = self.displacements(displacement(problem.mesh, unknowns))
        columns = (column for marker in self.markers for column in marker.columns(problem.dim))
        return dict(zip(columns, map(float, moved.ravel()), strict=True))


def marker_table(
    problem: Problem, steps: Sequence[StepResult], grid: MarkerGrid | None, errors: Mapping[str, float] | None = None
) -> Tree:
    """Return the columns of markers.csv: every marker of the scene and of its grid, after every increment.

    Parameters
    ----------
    steps : converged increments
    errors : of the displacements after the last increment, by the keys of their columns, mm
    """
    named = problem.model.markers
    markers = [*named, *(grid.markers if grid else ())]
    moved = [np.array([step.markers[m.name] for m in named]).reshape(-1, problem.dim) for step in steps]
    if grid is not None:
        unknowns = formulation_of(problem.model).unknowns(problem, [step.meshed_state for step in steps])
        fields = (grid.displacements(displacement(problem.mesh, x)) for x in unknowns)
        moved = [np.vstack(pair) for pair in zip(moved, fields, strict=True)]
    poses = [pose_entry(step.target) for step in steps]
    columns: Tree = {
        "step": np.repeat(np.arange(1, len(steps) + 1), len(markers)),
        **{key: np.repeat([pose[key] for pose in poses], len(markers)) for key in poses[0] if key != "time_s"},
        "marker": [m.name for m in markers] * len(steps),
    }
    places, displacements = np.tile([m.place for m in markers], (len(steps), 1)), in_space(np.vstack(moved))
    columns |= {f"{axis}_mm": places[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"displacement_{axis}_mm": displacements[:, k] for k, axis in enumerate("xyz")}
    known = np.full((len(steps), len(markers), 3), np.nan)
    known[-1] = [[(errors or {}).get(c.key, np.nan) for c in displacement_columns(m.name)] for m in markers]
    return columns | {f"error_{axis}_mm": known[..., k].ravel() for k, axis in enumerate("xyz")}
