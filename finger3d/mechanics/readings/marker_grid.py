"""Displacements of markers: those of the scene, and of a grid on the contact face."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Tree
from finger3d.fem.mesh.simplex import axis_numbers
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.surface.traces import values_over
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.readings.columns import Column, displacement_columns
from finger3d.mechanics.results.history import StepResult
from finger3d.objects import ObjectPose

_POSE: dict[str, Callable[[ObjectPose], float]] = {
    "depth_mm": lambda pose: pose.depth_mm,
    "slide_x_mm": lambda pose: pose.slide_x_mm,
    "slide_z_mm": lambda pose: pose.slide_z_mm,
    "turn_x_deg": lambda pose: math.degrees(pose.turn_x),
    "turn_y_deg": lambda pose: math.degrees(pose.turn_y),
    "turn_z_deg": lambda pose: math.degrees(pose.turn_z),
}
"""Columns of the pose of the object, as in history.csv."""


@dataclass(frozen=True)
class MarkerGrid:
    """Markers on the contact face of the whole finger.

    Attributes
    ----------
    places : (k, d) mm, at rest
    rows : (k, n) sparse
        Interpolation from the nodes of the meshed part.
    sign : (k, d) factor of the components of a displacement, -1 in a mirror image, NaN beside the contact face
    """

    places: Float
    rows: sp.csr_matrix
    sign: Float

    @classmethod
    def of(cls, problem: Problem, spacing_mm: float) -> MarkerGrid:
        """Return markers every `spacing_mm` along x and z, with one in the middle, as far as the contact face goes."""
        design, d = problem.model.design, problem.dim
        x, z = (np.arange(-(half // spacing_mm), half // spacing_mm + 1.0) * spacing_mm
                for half in (design.half_length_mm, design.width_mm / 2.0))  # fmt: skip
        z = z if d == 3 else np.zeros(1)
        places = np.zeros((len(x) * len(z), d))
        places[:, 0] = x.repeat(len(z))
        places[:, 2:] = np.tile(z, len(x))[:, None]
        grid = cls.at(problem, places)
        there = ~np.isnan(grid.sign[:, 0])
        return cls(grid.places[there], grid.rows[there], grid.sign[there])

    @classmethod
    def at(cls, problem: Problem, places: Float) -> MarkerGrid:
        """Return markers at the x and z of places (k, d) on any mesh of the finger."""
        mesh, sign = problem.mesh, np.ones_like(places)
        for k in axis_numbers(problem.axes):
            sign[places[:, k] < 0.0, k] = -1.0
        below = places * sign
        below[:, 1] = mesh.points[:, 1].min() - 1.0
        rows, there = values_over(mesh, "contact", below, lowest=False)
        at = places.copy()
        at[:, 1] = rows @ mesh.points[:, 1]
        return cls(at, rows, np.where(there[:, None], sign, np.nan))

    def displacements(self, u: Float) -> Float:
        """Return the displacements (k, d) of the markers from those (n, d) of the part's nodes."""
        return np.asarray(self.sign * (self.rows @ u))

    def readings(self, problem: Problem, step: StepResult) -> dict[Column, float]:
        """Return the displacements after an increment of a problem, as those of other markers."""
        (unknowns,) = formulation_of(problem.model).unknowns(problem, [step.meshed_state])
        moved = self.displacements(displacement(problem.mesh, unknowns))
        columns = (column for k in range(len(moved)) for column in displacement_columns(f"grid_{k + 1}", problem.dim))
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
    positions = [m.place[: problem.dim] for m in named] + ([] if grid is None else list(grid.places))
    count = len(positions) - len(named)
    moved = [np.array([step.markers[m.name] for m in named]).reshape(-1, problem.dim) for step in steps]
    if grid is not None:
        unknowns = formulation_of(problem.model).unknowns(problem, [step.meshed_state for step in steps])
        fields = (grid.displacements(displacement(problem.mesh, x)) for x in unknowns)
        moved = [np.vstack(pair) for pair in zip(moved, fields, strict=True)]
    columns: Tree = {
        "step": np.repeat(np.arange(1, len(steps) + 1), len(positions)),
        **{key: np.repeat([value(step.target) for step in steps], len(positions)) for key, value in _POSE.items()},
        "marker": [*(m.name for m in named), *(f"grid_{k + 1}" for k in range(count))] * len(steps),
    }
    places, displacements = np.tile(_in_space(np.array(positions)), (len(steps), 1)), _in_space(np.vstack(moved))
    columns |= {f"{axis}_mm": places[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"displacement_{axis}_mm": displacements[:, k] for k, axis in enumerate("xyz")}
    known = np.full((len(steps), len(positions), 3), np.nan)
    last, errors = columns["marker"][: len(positions)], errors or {}
    known[-1] = [[errors.get(c.key, np.nan) for c in displacement_columns(name)] for name in last]
    return columns | {f"error_{axis}_mm": known[..., k].ravel() for k, axis in enumerate("xyz")}


def _in_space(vectors: Float) -> Float:
    """Return vectors (k, d) with three components."""
    return np.hstack([vectors, np.zeros((len(vectors), 3 - vectors.shape[1]))])
