"""Booleans of closed triangles and plane regions, by the library Manifold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.geometry.faceted import on_segments
from finger3d.geometry.surface import Triangles

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

CIRCLE_SEGMENTS = 64
"""Segments of a full circle where a region is widened."""

_SIMPLIFY_MM = 0.04  # deviation of the outlines of widened regions, below half of any clearance
_BASE_HEIGHT = 1e-4  # over the body's height: where its base is cut


def manifold(surface: Triangles) -> Manifold:
    """Return closed triangles as a solid of the library.

    Raises
    ------
    Finger3dError
        If the triangles are not closed.
    """
    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(
        # copies: the library refuses arrays that are read-only
        Mesh64(
            np.array(surface.points, dtype=np.float64, order="C"), np.array(surface.faces, dtype=np.uint64, order="C")
        )
    )
    if solid.status() != Error.NoError or solid.is_empty():
        raise Finger3dError("mold: the triangles of the body are not closed; mend it where it was drawn")
    return solid


def triangles(solid: Manifold) -> Triangles:
    """Return the surface of a solid of the library."""
    mesh = solid.to_mesh64()
    return Triangles(np.array(mesh.vert_properties[:, :3], dtype=np.float64), np.array(mesh.tri_verts, dtype=np.int64))


def base_region(surface: Triangles) -> CrossSection:
    """Return the region (x, z) of a body's base."""
    turned = Triangles(surface.points[:, [0, 2, 1]], surface.faces[:, ::-1])
    return manifold(turned).slice(float(turned.low[2] + _BASE_HEIGHT * (turned.high[2] - turned.low[2])))


def widened(region: CrossSection, distance: float) -> CrossSection:
    """Return a region grown by a distance, mm, or shrunk by a negative one, with round corners."""
    from manifold3d import JoinType

    grown = region.offset(distance, JoinType.Round, 2.0, CIRCLE_SEGMENTS)
    return grown.simplify(min(_SIMPLIFY_MM, 0.1 * abs(distance)))


def disc(middle: Sequence[float], diameter: float) -> CrossSection:
    """Return a disc."""
    from manifold3d import CrossSection

    return CrossSection.circle(diameter / 2.0, CIRCLE_SEGMENTS).translate((middle[0], middle[1]))


def inside(region: CrossSection, point: Sequence[float]) -> bool:
    """Return whether a point lies in a region, by the even-odd rule."""
    from matplotlib.path import Path

    place = point[0], point[1]
    return sum(Path(polygon).contains_point(place) for polygon in region.to_polygons()) % 2 == 1


def nearest(region: CrossSection, point: Sequence[float]) -> tuple[float, float]:
    """Return the point of a region that is nearest to a point."""
    target = np.asarray(point, dtype=float)
    if inside(region, point):
        return float(target[0]), float(target[1])
    sides = [np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1) for polygon in region.to_polygons()]
    x, z = on_segments(target[None], np.concatenate([*sides, np.zeros((0, 2, 2))]))[0]
    return float(x), float(z)


def difference(body: Triangles, tool: Triangles) -> Triangles:
    """Return a body without another."""
    return triangles(manifold(body) - manifold(tool))


def common(a: Triangles, b: Triangles) -> float:
    """Return the common volume of two bodies, mm3."""
    return float((manifold(a) ^ manifold(b)).volume())
