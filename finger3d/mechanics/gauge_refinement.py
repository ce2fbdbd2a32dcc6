"""Refinement of a mesh around the gauges of a model.

The strain at a gauge close to the edge of the contact varies over its distance from that edge.  Edges as long as those
at the contact do not resolve it, and its slope against friction then follows the mesh
(validation/slopes_of_readings.py).  Most of that error comes from the tractions close to the gauge, so that the contact
face is refined around it, and the body only close to that part of the face and to the gauge.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from finger3d._types import Float
from finger3d.fem.quality import curved_volume
from finger3d.fem.simplex import Mesh, reflect_into_part
from finger3d.mechanics.model import Model
from finger3d.meshing.bisection import refined
from finger3d.meshing.limits import check_count
from finger3d.meshing.report import MeshReport, report

_REACH = 2.5
"""Distance from a gauge up to which edges of the contact face are shortest, over its distance from that face."""

_LEAST_REACH, _LARGEST_REACH = 4.0, 12.0
"""Bounds of that distance, over the length of the shortest edges; the upper one bounds the number of cells."""

_AROUND_GAUGE = 2.0
"""Distance from a gauge up to which edges are shortest, over their length."""

_RATE = 0.7
"""Growth of the edge length per distance beyond."""


def refined_at_gauges(
    model: Model, mesh: Mesh, made: MeshReport, axes: tuple[str, ...] = ()
) -> tuple[Mesh, MeshReport]:
    """Return mesh and report with edges of ``mesh.size_mm / mesh.gauge_refinement`` around the gauges.

    Raises
    ------
    Finger3dError
        If the refined mesh is estimated to need too much memory.
    """
    options = model.mesh
    if options.gauge_refinement == 1.0 or not model.gauges:
        return mesh, made
    size = edge_lengths_at_gauges(model, mesh, axes)
    finer = refined(mesh, size, lambda cells: check_count(cells, mesh.dim, options))
    whole = report(finer, made.volume_mm3 / curved_volume(mesh), made.cad_volume_mm3, made.seconds)
    return finer, replace(whole, from_cache=made.from_cache, cache_path=made.cache_path)


def edge_lengths_at_gauges(model: Model, mesh: Mesh, axes: tuple[str, ...] = ()) -> Callable[[Float], Float]:
    """Return the function of points (n, d) that gives the longest edges (n,) mm which the gauges of a model allow."""
    names = model.mesh.refined_gauges
    shortest = model.mesh.size_mm / model.mesh.gauge_refinement
    face = mesh.points[np.unique(mesh.facets["contact"])]
    lines, near = [], np.zeros(len(face), dtype=bool)
    for gauge in (g for g in model.gauges if not names or g.name in names):
        start, end = (reflect_into_part(place, gauge.direction, axes, mesh.dim)[0] for place in gauge.ends)
        away = _distance(face, start, end)
        near |= away <= np.clip(_REACH * away.min(), _LEAST_REACH * shortest, _LARGEST_REACH * shortest)
        lines.append((start, end))
    part_of_face = cKDTree(face[near]) if near.any() else None

    def size(points: Float) -> Float:
        beyond = np.min([_distance(points, *line) for line in lines], axis=0) - _AROUND_GAUGE * shortest
        if part_of_face is not None:
            beyond = np.minimum(beyond, part_of_face.query(points)[0] - shortest)
        return np.asarray(shortest + _RATE * np.maximum(beyond, 0.0))

    return size


def _distance(points: Float, start: Float, end: Float) -> Float:
    """Return the distances (n,) of points (n, d) from the line between two ends (d,)."""
    along = end - start
    length2 = float(along @ along)
    share = np.clip((points - start) @ along / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))
