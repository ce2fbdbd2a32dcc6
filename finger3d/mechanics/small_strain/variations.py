"""Variations of a condensed section: what a small change of a key changes in its compliance and its readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.mesh.parts import elasticity_of, moduli_of
from finger3d.mechanics.discretise.build import contact_rows
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.symmetry import unfold_points
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.reading import MeshedBody

_SAME_PLACE = 1e-12
"""Difference of shares of the path below which two events are at the same place."""

_JUMP = 1e-8
"""Share of the path below which forces that change by more than this, over the largest, jump."""

_NONE = ("largest_penetration_mm", "iterations", "residual", "time_s")
"""Numbers of an increment that have no derivative."""

Numbers: TypeAlias = dict[str, float]
"""Numbers of an increment by the names of their columns in history.csv, or their derivatives."""


@dataclass(frozen=True)
class Variation:
    """A parameter of a press, by the problem at its value less and plus a small step, with the same contact points."""

    low: Problem
    high: Problem
    step: float

    @property
    def ends(self) -> tuple[Problem, Problem]:
        """Both problems."""
        return self.low, self.high

    def difference(self, low: Float | float, high: Float | float) -> Float:
        """Return the central difference of two values."""
        return np.asarray((np.asarray(high) - low) / (2.0 * self.step))


def variation(problem: Problem, low: Model, high: Model, step: float) -> Variation:
    """Return the variation between two models with the mesh of a problem: of friction, path, materials or readings.

    Raises
    ------
    Finger3dError
        If the models differ in anything else.
    """
    own = problem.model
    changed = {"friction", "legs", "material", "parts", "gauges", "markers", "taxels"}
    for model in (low, high):
        if replace(model, **{name: getattr(own, name) for name in changed}) != own:
            raise Finger3dError("it changes the mesh or the object")
    ends = [replace(problem, model=replace(own, **{n: getattr(m, n) for n in changed})) for m in (low, high)]
    names = ("material", "parts", "gauges", "markers", "taxels")
    if all(getattr(end.model, name) == getattr(own, name) for name in names for end in ends):
        return Variation(ends[0], ends[1], step)
    body, system = problem.body, problem.system
    elastics = [
        elasticity_of(end.model.materials(body.mesh.part_labels), body.mesh, own.domain == "plane-stress")
        for end in ends
    ]
    if any(elastic.mixed != body.elastic.mixed for elastic in elastics):
        raise Finger3dError("it switches between elements for compressible and nearly incompressible materials")
    matrices = [stiffness(body.mesh, elastic, body.thickness) for elastic in elastics]
    rows = [
        _reading_rows(end, MeshedBody(body.mesh, problem.axes, matrix, body.thickness, moduli_of(elastic)))
        for end, matrix, elastic in zip(ends, matrices, elastics, strict=True)
    ]
    fields = body.condensed.unknowns(np.eye(len(body.condensed.compliance)))
    slope = matrices[1].upper - matrices[0].upper
    compliance = -(fields.T @ ((slope + sp.triu(slope, 1).T) @ fields))
    active = len(system.active_dofs)
    compliance[active:, :active] += (rows[1] - rows[0]) @ fields[:, :active]
    delassus, reading_rows = contact_rows(0.5 * compliance, system.active_dofs, system.surface, len(own.columns))
    unmoved = np.setdiff1d(np.arange(delassus.shape[0] * delassus.shape[1]), system.active_dofs)
    square = delassus.reshape(reading_rows.shape[1], -1)
    square[unmoved, unmoved] = 0.0
    out = []
    for sign, end, elastic in zip((-1.0, 1.0), ends, elastics, strict=True):
        points = unfold_points(end.model, body.mesh, system.surface, problem.axes, elastic)[1]
        changed_system = replace(
            system,
            points=points,
            delassus=system.delassus + sign * delassus,
            reading_rows=system.reading_rows + sign * reading_rows,
        )
        out.append(replace(end, system=changed_system))
    return Variation(out[0], out[1], step)


def _reading_rows(problem: Problem, body: MeshedBody) -> sp.csr_matrix:
    """Return the rows (g, N) of the readings."""
    size = body.stiffness.upper.shape[0]
    parts = [sp.csr_matrix(reading.rows(body)) for reading in problem.model.readings]
    wide = [sp.csr_matrix((p.data, p.indices, p.indptr), (p.shape[0], size)) for p in parts]
    return sp.vstack(wide, format="csr") if wide else sp.csr_matrix((0, size))
