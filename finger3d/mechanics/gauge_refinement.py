"""Refinement of a mesh around the gauges of a model.

The strain at a gauge close to the edge of the contact varies over its distance from that edge.  Edges as long as those
at the contact do not resolve it, and its slope against friction then follows the mesh
(validation/slopes_of_readings.py).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d._types import Float
from finger3d.fem.quality import curved_volume
from finger3d.fem.simplex import Mesh, reflect_into_part
from finger3d.mechanics.model import Model
from finger3d.meshing.bisection import refined
from finger3d.meshing.limits import check_count
from finger3d.meshing.report import MeshReport, report

_REACH = 1.5
"""Distance from a gauge up to which edges are shortest, over its distance from the contact face: the tractions that act
so near are those that its strain follows closely."""

_LEAST_REACH, _LARGEST_REACH = 4.0, 12.0
"""Bounds of that distance, over the length of the shortest edges; the upper one bounds the number of cells."""

_RATE = 0.3
"""Growth of the edge length per distance beyond, that of unstructured meshes."""


def refined_at_gauges(
    model: Model, mesh: Mesh, made: MeshReport, axes: tuple[str, ...] = ()
) -> tuple[Mesh, MeshReport]:
    """Return mesh and report with edges of ``mesh.size_mm / mesh.gauge_refinement`` around every gauge.

    Raises
    ------
    Finger3dError
        If the refined mesh is estimated to need too much memory.
    """
    options = model.mesh
    if options.gauge_refinement == 1.0 or not model.gauges:
        return mesh, made
    shortest = options.size_mm / options.gauge_refinement
    face = mesh.points[np.unique(mesh.facets["contact"])]
    lines = []
    for gauge in model.gauges:
        start, end = (reflect_into_part(place, gauge.direction, axes, mesh.dim)[0] for place in gauge.ends)
        depth = float(_distance(face, start, end).min())
        lines.append((start, end, np.clip(_REACH * depth, _LEAST_REACH * shortest, _LARGEST_REACH * shortest)))

    def size(points: Float) -> Float:
        beyond = np.min([_distance(points, start, end) - reach for start, end, reach in lines], axis=0)
        return np.asarray(shortest + _RATE * np.maximum(beyond, 0.0))

    finer = refined(mesh, size, lambda cells: check_count(cells, mesh.dim, options))
    whole = report(finer, made.volume_mm3 / curved_volume(mesh), made.cad_volume_mm3, made.seconds)
    return finer, replace(whole, from_cache=made.from_cache, cache_path=made.cache_path)


def _distance(points: Float, start: Float, end: Float) -> Float:
    """Return the distances (n,) of points (n, d) from the line between two ends (d,)."""
    along = end - start
    length2 = float(along @ along)
    share = np.clip((points - start) @ along / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))
