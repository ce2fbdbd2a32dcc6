"""Variations of a condensed body: what a small change of a parameter changes in its displacements and its readings.

The displacements of contact points and readings under loads are ``L K^-1 f``.  Their derivative is
``L K^-1 (-dK u) + dL u`` with ``u = K^-1 f``, where dK and dL are central differences of assembled matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.mesh.parts import elasticity_of, moduli_of
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.symmetry import unfold_points
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.reading import MeshedBody
from finger3d.mechanics.results.state import State
from finger3d.objects import ObjectPose


class Side(NamedTuple):
    """A press at a parameter less or plus its step, to first order, at the end of an increment.

    Attributes
    ----------
    problem, state, pose : of the press
    readings : (g,)
    work_mJ, dissipation_mJ : since its start
    """

    problem: Problem
    state: State[Float]
    pose: ObjectPose
    readings: Float
    work_mJ: float
    dissipation_mJ: float


@dataclass(frozen=True)
class BodyChange:
    """Derivatives by a parameter of the stiffness (N, N) of a body and of the rows (g, N) of its readings."""

    stiffness: Any
    rows: Any

    def of(self, problem: Problem, unknowns: Float) -> tuple[Float, Float]:
        """Return the derivatives of contact displacements (c d, k) and readings (g, k) under the loads of a solution.

        Parameters
        ----------
        unknowns : (N, k), of the body under each of k loads
        """
        active = problem.system.active_dofs
        moved = problem.body.condensed.eliminated(-(self.stiffness @ unknowns)).displacement
        displacement = np.zeros((problem.surface.points.size, unknowns.shape[1]))
        displacement[active] = moved[: len(active)]
        return displacement, moved[len(active) :][: self.rows.shape[0]] + self.rows @ unknowns


@dataclass(frozen=True)
class Variation:
    """A parameter of a press, by the problem at its value less and plus a small step, with the same contact points.

    Attributes
    ----------
    low, high : with the compliance of the press itself
    step : of the parameter
    body : what changes in the body; None if nothing does
    """

    low: Problem
    high: Problem
    step: float
    body: BodyChange | None

    @property
    def ends(self) -> tuple[Problem, Problem]:
        """Both problems."""
        return self.low, self.high

    def difference(self, low: Float | float, high: Float | float) -> Float:
        """Return the central difference of two values."""
        return np.asarray((np.asarray(high) - low) / (2.0 * self.step))


def variation(problem: Problem, low: Model, high: Model, step: float) -> Variation:
    """Return the variation between two models with the mesh of a problem.

    They may differ in friction, path, object, materials and readings.

    Raises
    ------
    Finger3dError
        If the models differ in anything else.
    """
    own = problem.model
    changed = {"friction", "legs", "object", "material", "parts", "gauges", "markers", "taxels"}
    for model in (low, high):
        if replace(model, **{name: getattr(own, name) for name in changed}) != own:
            raise Finger3dError("it changes the mesh")
    ends = [replace(problem, model=replace(own, **{n: getattr(m, n) for n in changed})) for m in (low, high)]
    if any(end.model.object != own.object for end in ends):
        systems = [replace(problem.system, first_contact_mm=m.first_contact.first_contact_mm) for m in (low, high)]
        ends = [replace(end, system=system) for end, system in zip(ends, systems, strict=True)]
    names = ("material", "parts", "gauges", "markers", "taxels")
    if all(getattr(end.model, name) == getattr(own, name) for name in names for end in ends):
        return Variation(ends[0], ends[1], step, None)
    body = problem.body
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
    slope = (matrices[1].upper - matrices[0].upper) / (2.0 * step)
    change = BodyChange((slope + sp.triu(slope, 1).T).tocsr(), (rows[1] - rows[0]) / (2.0 * step))
    out = []
    for end, elastic in zip(ends, elastics, strict=True):
        points = unfold_points(end.model, body.mesh, problem.surface, problem.axes, elastic)[1]
        out.append(replace(end, system=replace(problem.system, points=points)))
    return Variation(out[0], out[1], step, change)


def _reading_rows(problem: Problem, body: MeshedBody) -> sp.csr_matrix:
    """Return the rows (g, N) of the readings."""
    size = body.stiffness.upper.shape[0]
    parts = [sp.csr_matrix(reading.rows(body)) for reading in problem.model.readings]
    wide = [sp.csr_matrix((p.data, p.indices, p.indptr), (p.shape[0], size)) for p in parts]
    return sp.vstack(wide, format="csr") if wide else sp.csr_matrix((0, size))
