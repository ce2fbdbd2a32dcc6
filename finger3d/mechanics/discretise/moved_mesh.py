"""Meshes that move with the dimensions of what they are meshes of, so that their cells stay."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.fem.mesh.locate import locate
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.design import Design
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.meshing.structured.swept import mesh_section

_FARTHEST = 1e-2
"""Motion of the vertices, over the least size of the body, beyond which they are others."""

_VOLUME, _ROUND_OFF = 0.05, 1e-9
"""Relative errors of the growth of a stretched body, and of its volume, that are those of its mesh."""

_CELLS_OF_SECTION = 40
"""Edges along half the section in whose mesh the inside of a body of several parts moves."""

_INSIDE = 1.0 - 1e-9
"""Share of their distance from the axis at which points on the rim are inside in spite of round-off."""


def with_points_of(mesh: Mesh, other: Mesh) -> Mesh:
    """Return a mesh with the points of another one; where that has other diagonals, with those of its vertices."""
    if mesh.cells.shape != other.cells.shape or mesh.points.shape != other.points.shape:
        raise Finger3dError("it changes the cells of the mesh")
    if (mesh.cells == other.cells).all():
        return other
    moved, corners = other.points - mesh.points, mesh.cells[:, : mesh.dim + 1]
    moved[mesh.cells[:, mesh.dim + 1 :]] = 0.5 * moved[mesh.cells[:, mesh.element.edges]].sum(axis=2)
    if np.abs(moved[corners]).max() > _FARTHEST * np.ptp(mesh.points, axis=0).min():
        raise Finger3dError("it numbers the points of the mesh anew")
    return replace(mesh, points=mesh.points + moved)


def stretched(mesh: Mesh, design: Design, other: Design) -> Mesh:
    """Return an unstructured mesh of a design with the dimensions of another one of its kind.

    The footprint stretches along x and z, and every vertical line from the base to the contact face stretches as well.
    A body of several parts moves along x and y as a structured mesh of its section does.

    Raises
    ------
    Finger3dError
        If the body is not that between its base and its contact face, or has parts and no section.
    """
    scale = other.half_length_mm / design.half_length_mm, 1.0, other.width_mm / design.width_mm
    points = mesh.points * scale[: mesh.dim]
    if design.part_labels:
        size = design.half_length_mm / _CELLS_OF_SECTION
        zone = (-design.half_length_mm, design.half_length_mm, 0.0, 0.0)
        flat, end = (mesh_section(one, MeshOptions(size, size), zone)[0] for one in (design, other))
        cells, places = locate(flat, mesh.points[:, :2])
        motion = (with_points_of(flat, end).points - flat.points)[flat.cells[cells]]
        points[:, :2] = mesh.points[:, :2] + np.einsum("pk,pkd->pd", flat.element.shape(places), motion)
    else:
        ends = [_INSIDE * np.pad(at, ((0, 0), (0, 3 - mesh.dim))) for at in (mesh.points, points)]
        heights = [one.top(at[:, 0], at[:, 2]) for one, at in zip((design, other), ends, strict=True)]
        stands = mesh.points[:, 1] > 0.0
        points[stands, 1] *= heights[1][stands] / heights[0][stands]
    moved = replace(mesh, points=points)
    growth = curved_volume(moved) / curved_volume(mesh) - 1.0
    wanted = other.volume_mm3 / design.volume_mm3 - 1.0
    if mesh.dim == 2:
        wanted = (1.0 + wanted) * design.width_mm / other.width_mm - 1.0
    if not math.isclose(growth, wanted, rel_tol=_VOLUME, abs_tol=_ROUND_OFF):
        raise Finger3dError("it changes the cells of the mesh")
    return moved


def stretched_object(mesh: Mesh, model: Model, other: Model) -> Mesh:
    """Return the mesh of the elastic object of a model with the dimensions of another one.

    Raises
    ------
    Finger3dError
        If it is not the mesh of a design.
    """
    bodies = [one.object.held_body(one.design, mesh.dim == 3) for one in (model, other)]
    if bodies[0] is None or bodies[1] is None:
        raise Finger3dError("it changes the cells of the object")
    own = replace(mesh, points=bodies[0].to_design(mesh.points))
    if bodies[0].design != bodies[1].design:
        own = stretched(own, bodies[0].design, bodies[1].design)
    return replace(mesh, points=bodies[1].to_scene(own.points))
