"""A press with fewer multipliers on the same condensed body, to estimate the error of the contact discretisation.

Every second contact point keeps its multiplier.  The tractions of the others are linear between those of the points
that are kept, with weights t_ij, so that the forces of the kept points, s_j, and those of all points are ::

    r_i = sum_j T_ij s_j,   T_ij = A_i t_ij / A'_j,   A'_j = sum_i A_i t_ij

with the tributary areas A_i.  Gaps, displacements and the Delassus operator follow by the transpose: ``W' = T^T W T``.
No mesh is made and nothing is factored.  Under an object that is not flat, gaps and normals are those of the press
itself, linearised about its increments and averaged, so that no distance is computed and every increment takes one
solution.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.fem.mesh.simplex import in_symmetry_planes
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.fem.tensors import bases_of, unit_normals
from finger3d.mechanics.discretise.contact_geometry import ContactGeometry
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.results.state import State

_LEAST_POINTS = 4
"""Points of a face that are all kept: fewer leave nothing to interpolate between."""

_FLAT = 1e-9
"""Extent of a face across its plane, over that along it, that is round-off."""


def with_coarse_multipliers(problem: Problem, steps: Sequence[StepResult]) -> Iterator[Problem]:
    """Yield the press with every second multiplier, for two choices of the points; both keep the corners of faces.

    Parameters
    ----------
    steps : all increments of the press, converged
    """
    for first in (0, 1):
        yield _coarsened(problem, steps, first)


def _coarsened(problem: Problem, steps: Sequence[StepResult], first: int) -> Problem:
    system, (c, d) = problem.system, problem.delassus.shape[:2]
    weights, kept = _weights(system.surface, first)
    area = system.surface.area
    coarse_area = np.asarray(weights.T @ area)
    mean = sp.csr_array(sp.diags_array(1.0 / coarse_area) @ weights.T @ sp.diags_array(area))
    spread = sp.csr_array(sp.diags_array(area) @ weights @ sp.diags_array(1.0 / coarse_area))
    both = sp.csr_array(sp.kron(spread, sp.eye_array(d)))
    delassus = np.asarray(both.T @ (both.T @ system.delassus.reshape(c * d, c * d)).T)
    count = len(kept)
    number = np.full(c, -1)
    number[kept] = np.arange(count)
    images = np.flatnonzero(number[problem.symmetry.image_of] >= 0)
    symmetric = replace(
        problem.symmetry,
        image_of=number[problem.symmetry.image_of[images]],
        mirror_sign=problem.symmetry.mirror_sign[images],
        multiplicity=problem.symmetry.multiplicity[images],
    )
    points = replace(
        system.points,
        nodes=system.points.nodes[images],
        face=system.points.face[images],
        points=system.points.points[images],
        area=coarse_area[symmetric.image_of] * symmetric.multiplicity,
        facets=np.zeros((0, problem.dim), dtype=np.int64),
        compliance=system.points.compliance[images],
    )
    active = np.isin(np.arange(c * d), system.active_dofs).reshape(c, d)[kept]
    coarse = replace(
        system,
        surface=_surface(system.surface, kept, weights, mean, coarse_area),
        points=points,
        delassus=delassus.reshape(count, d, count, d),
        reading_rows=system.reading_rows @ both,
        active_dofs=np.flatnonzero(active.ravel()),
    )
    parts = () if problem.model.object.is_flat else [part for step in steps for part in step.parts]
    known = {pose: _geometry(problem, state, mean, kept) for pose, state in parts} or None
    return replace(problem, symmetry=symmetric, system=coarse, contact_geometry=known)


def _geometry(
    problem: Problem, state: State[Float], mean: sp.csr_array, kept: NDArray[np.intp]
) -> tuple[ContactGeometry, Float]:
    """Return the mean contact geometry (c') of the coarse multipliers in a state, and their displacement."""
    contact, moved = state.contact, state.body
    normal = np.asarray(mean @ contact.own_bases[:, 0])
    normal = unit_normals(in_symmetry_planes(normal, problem.surface.points[kept], problem.axes))
    gap = np.asarray(mean @ contact.gap)
    return ContactGeometry(gap, np.ones_like(gap), np.zeros_like(normal), bases_of(normal)), np.asarray(mean @ moved)


def _surface(
    fine: BoundarySurface, kept: NDArray[np.intp], weights: sp.csr_array, mean: sp.csr_array, area: Float
) -> BoundarySurface:
    """Return the surface with the hats of the coarse multipliers."""
    normals = mean @ fine.normals
    return replace(
        fine,
        nodes=fine.nodes[kept],
        face=fine.face[kept],
        points=fine.points[kept],
        area=area,
        normals=normals / np.linalg.norm(normals, axis=1)[:, None],
        trace=sp.csr_matrix(mean @ fine.trace),
        average=sp.csr_matrix(mean @ fine.average),
        hats=sp.csr_matrix(weights.T @ fine.hats),
    )


def _weights(surface: BoundarySurface, first: int) -> tuple[sp.csr_array, NDArray[np.intp]]:
    """Return the weights t (c, c') and the numbers (c',) of the points that are kept, face by face."""
    blocks, kept, order = [], [], []
    for face in np.unique(surface.face):
        own = np.flatnonzero(surface.face == face)
        flat = _in_plane(surface.points[own])
        of_face = _every_second(surface, own, flat, first)
        blocks.append(_interpolation(flat, of_face))
        kept.append(own[of_face])
        order.append(own)
    weights = sp.csr_array(sp.block_diag(blocks, format="csr"))[np.argsort(np.concatenate(order))]
    numbers = np.concatenate(kept)
    return sp.csr_array(weights[:, np.argsort(numbers)]), np.sort(numbers)


def _interpolation(flat: Float, kept: NDArray[np.intp]) -> sp.csr_array:
    """Return the weights (n, n') that interpolate linearly between the points that are kept."""
    if len(kept) == len(flat):
        return sp.csr_array(sp.eye_array(len(flat)))
    return _between(flat[:, 0], kept) if flat.shape[1] == 1 else _in_triangles(flat, kept)


def _in_plane(points: Float) -> Float:
    """Return coordinates (n, d - 1) of points (n, d) along their plane; fewer columns where they lie on a line."""
    centred = points - points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(centred, full_matrices=False)
    along = [axis for size, axis in zip(sizes, axes, strict=True) if size > _FLAT * sizes[0]][: points.shape[1] - 1]
    return centred @ np.array(along).T if along else np.zeros((len(points), 0))


def _every_second(surface: BoundarySurface, own: NDArray[np.intp], flat: Float, first: int) -> NDArray[np.intp]:
    """Return a maximal set of points of a face no two of which are neighbours, and the corners of the face."""
    if len(own) <= _LEAST_POINTS or not flat.shape[1]:
        return np.arange(len(own))
    hats = surface.hats[own]
    neighbours = sp.csr_array((hats @ hats.T) > 0.0)
    state = np.zeros(len(own), dtype=np.int8)  # 1 kept, -1 a neighbour of one
    order = np.lexsort(np.round(flat.T[::-1], 9))
    if first:
        order = np.roll(order, -1)
    for point in order:
        if not state[point]:
            near = neighbours.indices[neighbours.indptr[point] : neighbours.indptr[point + 1]]
            state[near] = np.where(state[near] == 1, 1, -1)
            state[point] = 1
    corners = [k for axis in flat.T for k in (int(axis.argmin()), int(axis.argmax()))]
    if flat.shape[1] > 1:
        corners += [int(np.argmax(flat @ np.array(sign))) for sign in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    state[corners] = 1
    return np.flatnonzero(state == 1)


def _between(at: Float, kept: NDArray[np.intp]) -> sp.csr_array:
    """Return the weights (n, n') of linear interpolation on a line."""
    order = np.argsort(at[kept])
    out = np.zeros((len(at), len(kept)))
    for unit, j in zip(np.eye(len(kept)), order, strict=True):
        out[:, j] = np.interp(at, at[kept][order], unit)
    return sp.csr_array(out)


def _in_triangles(at: Float, kept: NDArray[np.intp]) -> sp.csr_array:
    """Return the weights (n, n') of linear interpolation in a triangulation of the points that are kept.

    A point outside of it has the values of the nearest one.
    """
    from scipy.spatial import Delaunay, cKDTree

    corners = at[kept]
    mesh = Delaunay(corners)
    inside = mesh.find_simplex(at, tol=1e-9)
    transform = mesh.transform[inside]
    part = np.einsum("nij,nj->ni", transform[:, :2], at - transform[:, 2])
    bary = np.clip(np.concatenate([part, 1.0 - part.sum(axis=1, keepdims=True)], axis=1), 0.0, 1.0)
    bary /= bary.sum(axis=1, keepdims=True)
    columns = mesh.simplices[inside]
    lost = inside < 0
    bary[lost] = [1.0, 0.0, 0.0]
    columns[lost] = cKDTree(corners).query(at[lost])[1][:, None]
    bary[kept], columns[kept] = [1.0, 0.0, 0.0], np.arange(len(kept))[:, None]
    rows = np.repeat(np.arange(len(at)), 3)
    out = sp.csr_array((bary.ravel(), (rows, columns.ravel())), shape=(len(at), len(kept)))
    out.eliminate_zeros()
    return out
