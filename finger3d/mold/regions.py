"""Booleans of closed triangles and plane regions, by the library Manifold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.geometry.surface import Triangles

if TYPE_CHECKING:
    from build123d import Solid
    from manifold3d import CrossSection, Manifold

CIRCLE_SEGMENTS = 64
"""Segments of a full circle where a region is widened."""

_SIMPLIFY_MM = 0.04  # deviation of the outlines of widened regions, below half of any clearance
_ORDER = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}  # right-handed axes with the normal of a section last


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


def section(surface: Triangles, axis: Literal["x", "y", "z"], coordinate: float) -> CrossSection:
    """Return the plane region in which a body is cut at a coordinate.

    Its coordinates are (x, y) for "z", (z, x) for "y" and (y, z) for "x".
    """
    turned = Triangles(surface.points[:, list(_ORDER[axis])], surface.faces)
    return manifold(turned).slice(coordinate)


def footprint(surface: Triangles, height: float) -> CrossSection:
    """Return the region (x, z) in which a body is cut a little above its base, by `height` times its own height."""
    region = section(surface, "y", float(surface.low[1] + height * (surface.high[1] - surface.low[1])))
    return exchanged(region)


def exchanged(region: CrossSection) -> CrossSection:
    """Return a region with its two coordinates exchanged."""
    from manifold3d import CrossSection

    return CrossSection([np.ascontiguousarray(p[::-1, ::-1]) for p in region.to_polygons()])


def widened(region: CrossSection, distance: float) -> CrossSection:
    """Return a region grown by a distance, mm, or shrunk by a negative one, with round corners."""
    from manifold3d import JoinType

    grown = region.offset(distance, JoinType.Round, 2.0, CIRCLE_SEGMENTS)
    return grown.simplify(min(_SIMPLIFY_MM, 0.1 * abs(distance)))


def rectangle(low: Sequence[float], high: Sequence[float]) -> CrossSection:
    """Return the rectangle between two corners."""
    from manifold3d import CrossSection

    return CrossSection.square((high[0] - low[0], high[1] - low[1])).translate((low[0], low[1]))


def disc(middle: Sequence[float], diameter: float) -> CrossSection:
    """Return a disc."""
    from manifold3d import CrossSection

    return CrossSection.circle(diameter / 2.0, CIRCLE_SEGMENTS).translate((middle[0], middle[1]))


def inside(region: CrossSection, points: Float) -> NDArray[np.bool_]:
    """Return the mask (n,) of the points (n, 2) that lie in a region, by the even-odd rule."""
    hit = np.zeros(len(points), dtype=bool)
    for polygon in region.to_polygons():
        a, b = polygon, np.roll(polygon, -1, axis=0)
        x, y = points[:, None, 0], points[:, None, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
        hit ^= (((a[:, 1] > y) != (b[:, 1] > y)) & (x < crossing)).sum(axis=1) % 2 == 1
    return hit


def nearest(region: CrossSection, point: Sequence[float]) -> tuple[float, float]:
    """Return the point of a region that is nearest to a point."""
    target = np.asarray(point, dtype=float)
    if inside(region, target[None])[0]:
        return float(target[0]), float(target[1])
    best, distance = target, np.inf
    for polygon in region.to_polygons():
        a, along = polygon, np.roll(polygon, -1, axis=0) - polygon
        length = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        fraction = np.clip(np.einsum("ij,ij->i", target - a, along) / length, 0.0, 1.0)
        feet = a + fraction[:, None] * along
        off = np.linalg.norm(feet - target, axis=1)
        if off.min() < distance:
            best, distance = feet[int(off.argmin())], float(off.min())
    return float(best[0]), float(best[1])


def prisms(region: CrossSection, axis: Literal["y", "z"], start: float, length: float) -> list[Solid]:
    """Return the CAD solids over a region, (x, y) or (x, z), from a coordinate of the axis over a signed length."""
    from build123d import Face, Location, Polyline, Wire, extrude

    def wire(polygon: Float) -> Wire:
        return Wire(Polyline(*((float(a), float(b)) for a, b in polygon), close=True).edges())

    solids = []
    for piece in region.decompose():
        outlines = sorted(piece.to_polygons(), key=lambda p: -abs(_area(p)))
        face = Face(wire(outlines[0]), [wire(p) for p in outlines[1:]])
        if face.normal_at().Z < 0.0:
            face = -face
        solid = extrude(face, amount=abs(length), dir=(0, 0, 1)).solids()[0]
        low = min(start, start + length)
        # A rotation about x by 90 degrees takes (x, y, h) to (x, -h, y).
        placed = Location((0, 0, low)) if axis == "z" else Location((0, low + abs(length), 0), (90, 0, 0))
        solids.append(solid.moved(placed))
    return solids


def _area(polygon: Float) -> float:
    x, y = polygon.T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def difference(body: Triangles, tools: Sequence[Triangles]) -> Triangles:
    """Return a body without the tools."""
    left = manifold(body)
    for tool in tools:
        left -= manifold(tool)
    return triangles(left)


def common(a: Triangles, b: Triangles) -> float:
    """Return the common volume of two bodies, mm3."""
    return float((manifold(a) ^ manifold(b)).volume())
