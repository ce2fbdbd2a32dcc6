"""Defects of triangulated surfaces: holes, flipped triangles, several pieces, no volume, self-intersection."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.geometry.surface import Triangles, connected

_FLAT = 1e-9  # thickness over length


def mistake(surface: Triangles, may_be_hollow: bool = False) -> str:
    """Return the defect of a surface that is not one closed body with triangles facing outward; empty if it is.

    A body that `may_be_hollow` has any number of closed inner surfaces, whose triangles face the voids.
    """
    points, faces = surface.points, surface.faces
    if len(faces) < 4:
        return f"has {len(faces)} triangles, which enclose nothing"
    if not np.isfinite(points).all():
        return "has a point that is not a number (NaN or infinite)"
    edges = surface.edges
    key = np.sort(edges, axis=1) @ [len(points), 1]
    _, number, owners = np.unique(key, return_inverse=True, return_counts=True)
    sides = owners[number]
    if surface.size == 0.0 or _flat(surface):
        return "has no volume: it is flat"
    if (sides == 1).any():
        where = _place(points[edges[np.argmax(sides == 1)]])
        count = int((sides == 1).sum())
        return f"is not closed: {count} edges border a hole or a missing triangle, the first at {where}"
    if (sides > 2).any():
        where = _place(points[edges[np.argmax(sides > 2)]])
        return f"is no body: more than two triangles meet in {int((owners > 2).sum())} edges, the first at {where}"
    forward = np.bincount(number, edges[:, 0] < edges[:, 1])
    if (forward != 1).any():
        first = edges[np.argmax((forward != 1)[number])]
        return (
            f"has flipped triangles: neighbours face opposite ways along {int((forward != 1).sum())} edges, the first "
            f"at {_place(points[first])}"
        )
    a, b = (np.argsort(number, kind="stable") // 3).reshape(-1, 2).T  # every edge has two triangles here
    piece = connected(len(faces), a, b)
    pieces = int(piece.max()) + 1
    if pieces > 1 and not (may_be_hollow and (_volumes(surface, piece) > 0.0).sum() == 1):
        return f"is in {pieces} pieces (or hollow); give one solid body"
    if surface.volume < 0.0:
        return "is inside out: its triangles face inward"
    return ""


def _flat(surface: Triangles) -> bool:
    used = surface.points[np.unique(surface.faces)]
    spread = np.linalg.svd(used - used.mean(axis=0), compute_uv=False)
    return bool(spread[-1] <= _FLAT * spread[0])


def _place(points: Float) -> str:
    return "({:.4g}, {:.4g}, {:.4g}) mm".format(*points.mean(axis=0))


def _volumes(surface: Triangles, piece: Int) -> Float:
    """Volume (p,) that each piece encloses, mm3; negative for the surface of a void."""
    reach = surface.corners[:, 0] - 0.5 * (surface.low + surface.high)
    return np.asarray(np.bincount(piece, np.einsum("ij,ij->i", reach, surface.area_vectors) / 3.0), dtype=float)


def crossings(surface: Triangles) -> Int:
    """Triangles (k,) that an edge of another triangle, which shares no point with it, passes through."""
    ends = np.unique(np.sort(surface.edges, axis=1), axis=0)
    start, stop = surface.points[ends[:, 0]], surface.points[ends[:, 1]]
    low, high = np.minimum(start, stop), np.maximum(start, stop)

    def overlap(query: Int, level: int, node: Int) -> NDArray[np.bool_]:
        box = surface.tree.boxes[level][node]
        inside: NDArray[np.bool_] = np.all((box[:, :3] <= high[query]) & (low[query] <= box[:, 3:]), axis=1)
        return inside

    pierced = []
    for query, item in surface.tree.pairs(len(ends), overlap):
        apart = ~np.any(surface.faces[item][:, :, None] == ends[query][:, None, :], axis=(1, 2))
        query, item = query[apart], item[apart]
        pierced.append(item[_pierced(start[query], stop[query], surface.corners[item], 1e-9 * surface.size)])
    return np.unique(np.concatenate(pierced))


def _pierced(start: Float, stop: Float, corner: Float, slack: float) -> NDArray[np.bool_]:
    """Whether segments pass through triangles (n, 3, 3), or their edges, and reach more than `slack` (mm) beyond."""
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(length, 1e-300)[:, None]
    a = np.einsum("ij,ij->i", start - corner[:, 0], normal)
    b = np.einsum("ij,ij->i", stop - corner[:, 0], normal)
    through: NDArray[np.bool_] = (np.minimum(a, b) < -slack) & (np.maximum(a, b) > slack) & (length > 0.0)
    crossing = start + (a / np.where(through, a - b, 1.0))[:, None] * (stop - start)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        along = corner[:, j] - corner[:, i]
        inward = np.cross(normal, along)
        inward /= np.maximum(np.linalg.norm(inward, axis=1), 1e-300)[:, None]
        through &= np.einsum("ij,ij->i", crossing - corner[:, i], inward) > -slack
    return through
