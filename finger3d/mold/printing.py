"""Printability of the parts of a mold, and how they lie on the bed of a printer."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.mold.body import Shell
from finger3d.mold.regions import manifold

_OPPOSED = -0.9  # cosine between the normals of the two sides of a wall; sharp edges are no walls
_RAYS = 1500  # of a part
_NEAR_MM = 1e-4  # distance from a surface at which a ray starts
_BEND = 1e-3  # of a ray, so that it does not run along a face or hit an edge exactly
_LAYER_MM = 0.5  # height of the layers in which islands are looked for
_LEAST_OVERLAP = 1e-6  # of an island's area that must lie on the layer below


def thickness(part: Triangles) -> tuple[float, Float]:
    """Return the least thickness (mm) of the walls of a closed body and where it is (3,), by rays inward.

    Rays start in every triangle, in larger ones more often, and only hits on a face that looks the other way count.
    Thin walls narrower than the distance of rays may be missed.
    """
    body = manifold(part)
    area = np.linalg.norm(part.area_vectors, axis=1)
    order = np.argsort(-area)[:_RAYS]
    number = np.maximum(1, np.round(_RAYS * area[order] / area.sum()).astype(int))
    random = np.random.default_rng(0)
    owner = np.repeat(order, number)
    weights = random.dirichlet((1.0, 1.0, 1.0), len(owner))
    starts = np.einsum("ij,ijk->ik", weights, part.corners[owner])
    normals = part.normals[owner]
    ends = starts - (normals + _BEND * random.standard_normal(normals.shape)) * part.size
    starts = starts - normals * _NEAR_MM
    least, where = np.inf, starts[0]
    for start, end, normal in zip(starts, ends, normals, strict=True):
        crossed = body.ray_cast(tuple(start), tuple(end))
        if not crossed or np.dot(crossed[0].normal, normal) > _OPPOSED:
            continue
        far = float(np.linalg.norm(np.asarray(crossed[0].position) - start)) + _NEAR_MM
        if far < least:
            least, where = far, start
    return least, where


def islands(part: Triangles) -> Float:
    """Return the middles (n, 3), mm, of the pieces of a layer of which nothing lies on the layer below.

    The part lies on the bed: z up, its lowest point on z = 0.
    """
    body, middles = manifold(part), []
    heights = np.arange(0.5 * _LAYER_MM, float(part.high[2]), _LAYER_MM)
    below = body.slice(float(heights[0]))
    for height in heights[1:]:
        layer = body.slice(float(height))
        for piece in layer.decompose():
            if (piece ^ below).area() <= _LEAST_OVERLAP * piece.area():
                x0, y0, x1, y1 = piece.bounds()
                middles.append([0.5 * (x0 + x1), 0.5 * (y0 + y1), float(height)])
        below = layer
    return np.array(middles).reshape(-1, 3)


GAP_MM = 6.0
"""Distance between parts in the 3MF file."""

_OUTER_FACE_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_LYING = {"half_a": np.diag([-1.0, 1.0, -1.0]), "half_b": np.eye(3)}
"""Rotation of the halves onto the bed, their outer face down and z up; lids and inserts lie with y up."""


def as_printed(parts: Mapping[str, Shell]) -> dict[str, Shell]:
    """Return the parts as they are printed, each with its lowest corner at the origin."""
    lying = {name: part.moved(_LYING.get(name, _OUTER_FACE_DOWN), np.zeros(3)) for name, part in parts.items()}
    return {name: part.moved(np.eye(3), -part.surface.low) for name, part in lying.items()}


def in_a_row(printed: Mapping[str, Shell]) -> dict[str, Shell]:
    """Return the parts side by side along x; programs of printers arrange them on their beds."""
    starts = np.cumsum([0.0] + [float(part.extent[0]) + GAP_MM for part in printed.values()])
    return {
        name: part.moved(np.eye(3), np.array([x, 0.0, 0.0]))
        for (name, part), x in zip(printed.items(), starts, strict=False)
    }
