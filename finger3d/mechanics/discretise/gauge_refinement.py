"""Refinement of a mesh around the gauges of a model, and at the border of stick.

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
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh, reflect_into_part
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.meshing.limits import check_count
from finger3d.meshing.refinement.bisection import refined
from finger3d.meshing.refinement.grading import SizedPlaces
from finger3d.meshing.report import MeshReport, mesh_report

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
