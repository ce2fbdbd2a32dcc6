"""Mesh of the body: refined around gauges and at the border of stick, and moved with dimensions that change.

The strain at a gauge close to the edge of the contact varies over its distance from that edge.  Edges as long as those
at the contact do not resolve it, and its derivative by mu then depends on the mesh
(validation/slopes_of_readings.py).  Most of that error comes from the tractions close to the gauge, so that the contact
face is refined around it, and the body only close to that part of the face and to the gauge.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh, curved_volume, locate, reflect_into_part
from finger3d.geometry.design import Design
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.mechanics.readings import Gauge
from finger3d.meshing.bisection import refined
from finger3d.meshing.limits import MeshReport, check_count, mesh_report
from finger3d.meshing.sizing import SizedPlaces
from finger3d.meshing.swept import mesh_section

_REACH = 2.5
"""Distance from a gauge up to which the contact face is refined, over the depth of the gauge under it."""

_LEAST_REACH = 4.0
"""Least distance up to which it is refined, over the length of the shortest edges."""

_EDGES_PER_DEPTH = 8.0
"""Depth of a gauge over the edges of the face that resolve the tractions well enough for its strain."""

_AROUND_GAUGE = 2.0
"""Distance from a gauge up to which edges are shortest, over their length."""

_RATE = 0.7
"""Growth of the edge length per distance beyond."""


def locally_refined(model: Model, mesh: Mesh, made: MeshReport, axes: tuple[str, ...] = ()) -> tuple[Mesh, MeshReport]:
    """Return mesh and report with shorter edges around the gauges, and at the border of stick if it is known.

    Raises
    ------
    Finger3dError
        If the refined mesh is estimated to need too much memory.
    """
    options = model.mesh
    sizes = [] if options.gauge_refinement == 1.0 or not model.gauges else [edge_lengths_at_gauges(model, mesh, axes)]
    sizes += [options.borders.at] if options.borders else []
    if not sizes:
        return mesh, made

    def size(points: Float) -> Float:
        return np.asarray(np.min([wanted(points) for wanted in sizes], axis=0))

    finer = refined(mesh, size, lambda cells: check_count(cells, mesh.dim, options))
    whole = mesh_report(finer, made.volume_mm3 / curved_volume(mesh), made.cad_volume_mm3, made.seconds)
    return finer, replace(whole, from_cache=made.from_cache, cache_path=made.cache_path)


def edge_lengths_at_gauges(model: Model, mesh: Mesh, axes: tuple[str, ...] = ()) -> Callable[[Float], Float]:
    """Return the longest edges (n,) mm that the gauges of a model allow at points (n, d), as a function of these."""
    options = model.mesh
    shortest = options.size_mm / options.gauge_refinement
    zones: list[SizedPlaces] = []
    for gauge in model.gauges:
        line = _places_along(gauge, shortest, axes, mesh.dim)
        zones.append(SizedPlaces(line, shortest, _RATE, _AROUND_GAUGE * shortest))
        places, edge = _places_on_face(mesh, zones[-1].tree, shortest)
        zones.append(SizedPlaces(places, edge, _RATE, edge))
    return lambda points: np.min([np.full(len(points), np.inf), *(zone.at(points) for zone in zones)], axis=0)


def _places_along(gauge: Gauge, spacing: float, axes: tuple[str, ...], dim: int) -> Float:
    """Return places (k, d) along a gauge, or their mirror images in the part that is meshed."""
    start, end = gauge.ends
    shares = np.linspace(0.0, 1.0, math.ceil(np.linalg.norm(end - start) / spacing) + 1)
    return np.array([reflect_into_part(start + s * (end - start), gauge.direction, axes, dim)[0] for s in shares])


def _places_on_face(mesh: Mesh, gauge: cKDTree, shortest: float) -> tuple[Float, float]:
    """Return places (k, d) of the contact face close to a gauge, and the edge length there."""
    facets = mesh.points[mesh.facets["contact"]]
    away = gauge.query(facets)[0].min(axis=1)
    depth = float(away.min())
    reach, edge = face_near_gauge(depth, shortest)
    facets = facets[away <= reach]
    diameter = float(np.linalg.norm(np.ptp(facets, axis=1), axis=1).max())
    places = mesh.facet_element.shape(_lattice(mesh.dim, math.ceil(diameter / edge))) @ facets
    places = places.reshape(-1, mesh.dim)
    return places[gauge.query(places)[0] <= reach], edge


def face_near_gauge(depth: float, shortest: float) -> tuple[float, float]:
    """Return how far from a gauge the contact face is refined, and the edge length there, mm.

    Parameters
    ----------
    depth : of the gauge under the face, mm
    shortest : length of the shortest edges, mm
    """
    return max(_REACH * depth, _LEAST_REACH * shortest), max(shortest, depth / _EDGES_PER_DEPTH)


def _lattice(corners: int, count: int) -> Float:
    """Return the barycentric coordinates (k, corners) of a lattice that divides the edges of a simplex into `count`."""
    steps = [s for s in product(range(count + 1), repeat=corners - 1) if sum(s) <= count]
    return np.array([(count - sum(s), *s) for s in steps]) / count


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
