"""Triangulated surfaces: heights along vertical lines, closest points, and signed distances."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int, freeze_arrays

if TYPE_CHECKING:
    from scipy.spatial import KDTree


Bool = NDArray[np.bool_]
NodeTest = Callable[[Int, int, Int], Bool]

_ARITY = 4  # children of a node, and triangles in a leaf
_BITS = 16
_CHUNK = 8192


@dataclass(frozen=True)
class Tree:
    """Complete tree with four children for each node, over triangles in spatial order.

    Attributes
    ----------
    items : (leaves, 4) numbers of the triangles in every leaf, -1 where there is none
    boxes : per level from the root, (4^level, 6) low and high corner; an empty node has low = inf, high = -inf
    """

    items: Int
    boxes: tuple[Float, ...]

    @classmethod
    def over(cls, corners: Float) -> Tree:
        """Return the tree of triangles with corners (m, 3, 3), sorted along a Z-order curve (Morton 1966)."""
        low, high = corners.min(axis=1), corners.max(axis=1)
        order = np.argsort(_morton(0.5 * (low + high)), kind="stable")
        leaves = 1
        while leaves * _ARITY < len(low):
            leaves *= _ARITY
        slots = np.full(leaves * _ARITY, -1, dtype=np.int64)
        slots[: len(order)] = order
        items = slots.reshape(leaves, _ARITY)
        empty = (items < 0)[:, :, None]
        # low corner and minus high corner: one minimum does for both
        both = np.where(empty, np.inf, np.hstack([low, -high])[items]).min(axis=1)
        levels = [both]
        while len(levels[-1]) > 1:
            levels.append(levels[-1].reshape(-1, _ARITY, 6).min(axis=1))
        return cls(items, tuple(np.hstack([b[:, :3], -b[:, 3:]]) for b in reversed(levels)))

    def bounding_cylinders(self, corners: Float, area_vectors: Float) -> tuple[Float, ...]:
        """Return bounding cylinders of the nodes, per level (4^level, 8): centre, axis, radius, half height (mm).

        A small part of a surface is nearly flat, so that flat cylinders bound its distance much better than boxes.
        """
        empty = np.repeat((self.items < 0).ravel(), 3)
        points = corners[self.items].reshape(-1, 3)
        areas = np.where(self.items.reshape(-1, 1) < 0, 0.0, area_vectors[self.items].reshape(-1, 3))
        levels = []
        for box in self.boxes:
            n = len(box)
            used = np.isfinite(box[:, :3]).all(axis=1)
            centre = np.zeros((n, 3))
            centre[used] = 0.5 * (box[used, :3] + box[used, 3:])
            axis = areas.reshape(n, -1, 3).sum(axis=1)
            axis /= np.maximum(np.linalg.norm(axis, axis=1), 1e-300)[:, None]
            offset = points.reshape(n, -1, 3) - centre[:, None]
            along = np.matmul(offset, axis[:, :, None])[:, :, 0]
            across = np.einsum("nkx,nkx->nk", offset, offset) - along**2
            along, across = np.abs(along).ravel(), across.ravel()
            along[empty] = across[empty] = -np.inf
            half_height, square = along.reshape(n, -1).max(axis=1), across.reshape(n, -1).max(axis=1)
            radius = np.where(used, np.sqrt(np.maximum(square, 0.0)), -np.inf)
            levels.append(np.hstack([centre, axis, radius[:, None], half_height[:, None]]))
        return tuple(levels)

    def pairs(self, count: int, test: NodeTest) -> Iterator[tuple[Int, Int]]:
        """Yield portions of pairs (query, triangle) whose nodes at all levels pass `test(query, level, node)`."""
        for start in range(0, count, _CHUNK):
            query = np.arange(start, min(start + _CHUNK, count))
            node = np.zeros(len(query), dtype=np.int64)
            for level in range(len(self.boxes)):
                if level:
                    query, node = np.repeat(query, _ARITY), (_ARITY * node[:, None] + np.arange(_ARITY)).ravel()
                keep = test(query, level, node)
                query, node = query[keep], node[keep]
            items = self.items[node].ravel()
            query = np.repeat(query, _ARITY)
            yield query[items >= 0], items[items >= 0]


def cylinder_distance(p: Float, cylinder: Float) -> Float:
    """Return the distance (n,) mm of points (n, 3) from cylinders (n, 8), a lower bound of that from their contents."""
    offset = p - cylinder[:, :3]
    along = np.einsum("ij,ij->i", offset, cylinder[:, 3:6])
    across = np.sqrt(np.maximum(np.einsum("ij,ij->i", offset, offset) - along**2, 0.0))
    value: Float = np.hypot(np.maximum(np.abs(along) - cylinder[:, 7], 0.0), np.maximum(across - cylinder[:, 6], 0.0))
    return value


def _morton(points: Float) -> Int:
    """Return the interleaved bits (n,) of coordinates scaled to their bounding box."""
    low = points.min(axis=0)
    span = np.maximum(np.ptp(points, axis=0).max(), 1e-300)
    scaled = np.minimum((points - low) / span * 2**_BITS, 2**_BITS - 1).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((scaled[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


_SLACK = 1e-12  # over the surface's size: tolerance that makes vertical lines through shared edges hit a triangle
_EDGES = ((0, 1), (1, 2), (2, 0))
_SLENDER = 6.0  # longest edge squared over twice the area, from which a triangle is cut for its bounds
_SHORT = 2e-3  # longest edge over the surface's size, below which no triangle is cut
_MOST_CUTS, _MOST_PIECES = 12, 32


@dataclass(frozen=True, eq=False)
class Triangles:
    """A triangulated surface; surfaces with the same points and triangles are equal.

    Attributes
    ----------
    points : (n, 3) mm
    faces : (m, 3) outward where the surface is closed
    """

    points: Float
    faces: Int

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Triangles) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of points and faces."""
        text = hashlib.sha256(np.ascontiguousarray(self.points, dtype=np.float64).tobytes())
        text.update(np.ascontiguousarray(self.faces, dtype=np.int64).tobytes())
        return text.hexdigest()

    @cached_property
    def corners(self) -> Float:
        """Corners (m, 3, 3) of the triangles, mm."""
        return self.points[self.faces]

    @property
    def edges(self) -> Int:
        """Ends (3 m, 2) of the edges of every triangle, in its order."""
        return self.faces[:, _EDGES].reshape(-1, 2)

    @cached_property
    def neighbours(self) -> tuple[Int, Int, Int]:
        """Triangles a (e,) and b (e,) on both sides of every edge (e, 2).

        An edge of one triangle has no row; one of more than two has a row for each two that follow one another.
        """
        edges = np.sort(self.edges, axis=1)
        order = np.lexsort(edges.T)
        edges = edges[order]
        owner = np.repeat(np.arange(len(self.faces)), 3)[order]
        pair = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
        return owner[pair], owner[pair + 1], edges[pair]

    @cached_property
    def area_vectors(self) -> Float:
        """Normals (m, 3) as long as the area, mm2."""
        a, b, c = self.corners.transpose(1, 0, 2)
        return 0.5 * np.cross(b - a, c - a)

    @cached_property
    def normals(self) -> Float:
        """Unit normals (m, 3); 0 for a triangle without area."""
        return _normalise(self.area_vectors)

    @cached_property
    def sharpest_edge(self) -> float:
        """Largest angle (rad) between the normals of two triangles that share an edge."""
        # the pseudonormal of an edge halves the angle
        half = np.einsum("mek,mk->me", self._corner_normals[0], self.normals)
        return 2.0 * float(np.arccos(np.clip(half.min(), -1.0, 1.0)))

    @property
    def volume(self) -> float:
        """Enclosed volume of a closed surface, mm3; negative if it is inside out."""
        # Relative to the middle of the box: far from the origin round-off would cancel the volume.
        a = self.corners[:, 0] - 0.5 * (self.low + self.high)
        return float(np.einsum("ij,ij->", a, self.area_vectors) / 3.0)

    @property
    def low(self) -> Float:
        """Smallest coordinates (3,) of the triangles, mm."""
        value: Float = self.corners.min(axis=(0, 1))
        return value

    @property
    def high(self) -> Float:
        """Largest coordinates (3,) of the triangles, mm."""
        value: Float = self.corners.max(axis=(0, 1))
        return value

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around the triangles, mm."""
        return float(np.linalg.norm(self.high - self.low))

    @cached_property
    def tree(self) -> Tree:
        """Boxes around the triangles."""
        return Tree.over(self.corners)

    @cached_property
    def _facing_down(self) -> tuple[Int, Tree]:
        """Triangles that face down, the only ones that a line from below can meet first, and their tree."""
        facing = np.flatnonzero(self.area_vectors[:, 1] < 0.0)
        return facing, Tree.over(self.corners[facing])

    @cached_property
    def _facing_up(self) -> tuple[Int, Tree]:
        facing = np.flatnonzero(self.area_vectors[:, 1] > 0.0)
        return facing, Tree.over(self.corners[facing])

    @cached_property
    def _pieces(self) -> tuple[Float, Int, Tree]:
        """Slender triangles cut across: corners (p, 3, 3), the triangle (p,) of each piece, and their tree.

        Pieces are closer to their bounding cylinders than a slender triangle is.
        """
        corners = self.corners
        owner = np.arange(len(self.faces))
        for _ in range(_MOST_CUTS):
            edges = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)
            longest = edges.max(axis=1)
            area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            slender = np.flatnonzero((longest**2 > _SLENDER * area) & (longest > _SHORT * self.size))
            if not len(slender) or len(corners) + len(slender) > _MOST_PIECES * len(self.faces):
                break
            start = edges[slender].argmax(axis=1)
            a, b, c = (corners[slender, (start + i) % 3] for i in range(3))
            middle = 0.5 * (a + b)
            whole = np.setdiff1d(np.arange(len(corners)), slender)
            corners = np.concatenate([corners[whole], np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
            owner = np.concatenate([owner[whole], owner[slender], owner[slender]])
        return corners, owner, Tree.over(corners)

    @cached_property
    def _vertices(self) -> KDTree:
        """Corners of all pieces."""
        from scipy.spatial import KDTree

        corners, _, _ = self._pieces
        cut = [] if len(corners) == len(self.faces) else [corners.reshape(-1, 3)]
        vertices = np.vstack([self.points[np.unique(self.faces)], *cut])
        return KDTree(vertices, balanced_tree=False, compact_nodes=False)

    @cached_property
    def _bounding_cylinders(self) -> tuple[Float, ...]:
        corners, owner, tree = self._pieces
        return tree.bounding_cylinders(corners, self.normals[owner])

    @cached_property
    def _bounding_discs(self) -> Float:
        """Bounding disc of every piece: a cylinder (p, 8) of height zero."""
        corners, owner, _ = self._pieces
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        # without area there is no axis, and nothing lies off the middle's plane
        return np.hstack([middle, self.normals[owner], radius[:, None], np.zeros((len(radius), 1))])

    @cached_property
    def _corner_normals(self) -> tuple[Float, Float]:
        """Pseudonormals of every triangle's edges (m, 3, 3) and corners (m, 3, 3), which give the sign of the distance.

        A vertex normal is weighted by the angles of its triangles (Baerentzen and Aanaes 2005), an edge normal equally.
        """
        n = len(self.points)
        ends = self.faces[:, _EDGES]
        key = np.sort(ends, axis=2) @ [n, 1]
        _, number = np.unique(key, return_inverse=True)
        number = number.reshape(key.shape)
        edge = np.zeros((number.max() + 1, 3))
        np.add.at(edge, number, self.normals[:, None, :])
        vertex = np.zeros((n, 3))
        for i in range(3):
            along = self.corners[:, (i + 1) % 3] - self.corners[:, i]
            back = self.corners[:, (i + 2) % 3] - self.corners[:, i]
            sine = np.linalg.norm(np.cross(along, back), axis=1)
            angle = np.arctan2(sine, np.einsum("ij,ij->i", along, back))
            np.add.at(vertex, self.faces[:, i], angle[:, None] * self.normals)
        return _normalise(edge)[number], _normalise(vertex)[self.faces]

    def hits(self, x: Float, z: Float, lowest: bool = True) -> tuple[Int, Float]:
        """Find the first intersection of vertical lines with a closed surface, from below or from above.

        Returns
        -------
        face : (n,) triangle, -1 where the line misses the surface
        bary : (n, 3) barycentric coordinates in it
        """
        places = np.stack([x, z], axis=1).astype(float)
        slack = _SLACK * self.size

        facing, tree = self._facing_down if lowest else self._facing_up
        boxes = [b[:, [0, 2, 3, 5]] + np.array([-slack, -slack, slack, slack]) for b in tree.boxes]

        def inside(query: Int, level: int, node: Int) -> NDArray[np.bool_]:
            p = places[query]
            box = boxes[level][node]
            inside: NDArray[np.bool_] = (
                (box[:, 0] <= p[:, 0]) & (box[:, 1] <= p[:, 1]) & (p[:, 0] <= box[:, 2]) & (p[:, 1] <= box[:, 3])
            )
            return inside

        face = np.full(len(places), -1, dtype=np.int64)
        bary = np.zeros((len(places), 3))
        flat = self.corners[:, :, ::2]
        for query, number in tree.pairs(len(places), inside):
            item = facing[number]
            weight, met = _barycentric(places[query], flat[item], slack)
            query, item, weight = query[met], item[met], weight[met]
            y = np.einsum("ij,ij->i", weight, self.corners[item, :, 1]) * (1.0 if lowest else -1.0)
            order = np.lexsort((item, y, query))  # the number breaks ties, so that a result can be repeated
            first = order[np.unique(query[order], return_index=True)[1]]
            face[query[first]], bary[query[first]] = item[first], weight[first]
        return face, bary

    def height(self, x: Float, z: Float, lowest: bool = True) -> Float:
        """Return the height (mm) of the lowest or highest point at x, z, exact on the triangles; nan outside."""
        x, z = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(z, dtype=float))
        face, bary = self.hits(x.ravel(), z.ravel(), lowest)
        height = np.where(face < 0, np.nan, np.einsum("ij,ij->i", bary, self.corners[face, :, 1]))
        return height.reshape(x.shape)

    def closest(self, points: Float) -> tuple[Float, Int, Int]:
        """Find the closest points of the surface.

        Returns
        -------
        closest : (n, 3) mm
        face : (n,) a triangle it lies on
        feature : (n,) 0 inside the triangle, 1 to 3 on its edge 01, 12, 20, 4 to 6 at its corner
        """
        reach = self._distance_bound(points)
        closest = np.zeros_like(points)
        face = np.full(len(points), -1, dtype=np.int64)
        feature = np.zeros(len(points), dtype=np.int64)

        def near(query: Int, level: int, node: Int) -> NDArray[np.bool_]:
            return cylinder_distance(points[query], self._bounding_cylinders[level][node]) <= reach[query]

        _, owner, tree = self._pieces
        for query, piece in tree.pairs(len(points), near):
            close = cylinder_distance(points[query], self._bounding_discs[piece]) <= reach[query]
            pair = np.unique(query[close] * len(self.faces) + owner[piece[close]])
            query, item = np.divmod(pair, len(self.faces))
            p, which = _closest_on_triangle(points[query], self.corners[item], self.normals[item])
            distance = np.linalg.norm(points[query] - p, axis=1)
            order = np.lexsort((item, distance, query))
            first = order[np.unique(query[order], return_index=True)[1]]
            closest[query[first]], face[query[first]], feature[query[first]] = p[first], item[first], which[first]
        return closest, face, feature

    def _distance_bound(self, points: Float) -> Float:
        """Return an upper bound (n,) of the distance, from the nearest corner and from one descent of the tree."""
        _, owner, tree = self._pieces
        reach = self._vertices.query(points)[0]
        # The corners of a large triangle may be far away; the triangles in a leaf of the tree give a better bound.
        node = np.zeros(len(points), dtype=np.int64)
        for cylinder in self._bounding_cylinders[1:]:
            children = np.stack([cylinder_distance(points, cylinder[4 * node + i]) for i in range(4)])
            node = 4 * node + np.argmin(children, axis=0)
        for column in range(tree.items.shape[1]):
            piece = tree.items[node, column]
            item = owner[piece]
            there = piece >= 0
            p = _closest_on_triangle(points[there], self.corners[item[there]], self.normals[item[there]])[0]
            reach[there] = np.minimum(reach[there], np.linalg.norm(points[there] - p, axis=1))
        value: Float = reach * (1.0 + 1e-9) + 1e-12 * self.size
        return value

    def signed_distance(self, points: Float) -> tuple[Float, Float]:
        """Return the distance (n,) mm of points (n, 3), negative inside, and its gradient (n, 3), a unit vector.

        Pseudonormals make the sign exact where the closest point lies on an edge or a vertex.
        """
        closest, face, feature = self.closest(points)
        edge, vertex = self._corner_normals
        normal = self.normals[face].copy()
        on_edge, on_corner = (feature >= 1) & (feature <= 3), feature >= 4
        normal[on_edge] = edge[face[on_edge], feature[on_edge] - 1]
        normal[on_corner] = vertex[face[on_corner], feature[on_corner] - 4]
        out = points - closest
        length = np.linalg.norm(out, axis=1)
        sign = np.where(np.einsum("ij,ij->i", out, normal) < 0.0, -1.0, 1.0)
        far = length > 1e-9 * self.size
        normal[far] = out[far] * (sign[far] / length[far])[:, None]
        return sign * length, normal


def has_three_corners(faces: Int) -> Bool:
    """Return which triangles (m,) have three different corners."""
    a, b, c = faces.T
    return np.asarray((a != b) & (b != c) & (c != a))


def connected(count: int, a: Int, b: Int) -> Int:
    """Return the number (count,) of the connected piece of each item, where the items a and b (k,) are linked."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _normalise(vectors: Float) -> Float:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    value: Float = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return value


def _barycentric(p: Float, corner: Float, slack: float) -> tuple[Float, NDArray[np.bool_]]:
    """Barycentric coordinates (n, 3) of points (n, 2) in triangles (n, 3, 2) of the plane; whether they lie inside."""
    weight = np.empty((len(p), 3))
    inside = np.ones(len(p), dtype=bool)
    edges = corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]]
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    turn = np.where(area < 0.0, -1.0, 1.0)
    for i in range(3):
        from_start = p - corner[:, (i + 1) % 3]
        weight[:, i] = turn * (edges[:, i, 0] * from_start[:, 1] - edges[:, i, 1] * from_start[:, 0])
        inside &= weight[:, i] >= -slack * np.linalg.norm(edges[:, i], axis=1)
    total = np.abs(area)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    inside &= total > slack * longest  # edge-on
    weight = np.clip(weight, 0.0, None)
    return weight / np.maximum(weight.sum(axis=1), 1e-300)[:, None], inside


def _closest_on_triangle(p: Float, corner: Float, normal: Float) -> tuple[Float, Int]:
    """Closest points (n, 3) of triangles (n, 3, 3) with unit normals (n, 3), and the feature they lie on."""
    out = np.zeros_like(p)
    feature = np.zeros(len(p), dtype=np.int64)
    best = np.full(len(p), np.inf)
    inside = np.any(normal != 0.0, axis=1)
    for k, (i, j) in enumerate(_EDGES):
        along, start = corner[:, j] - corner[:, i], p - corner[:, i]
        square = np.einsum("ij,ij->i", along, along)
        t = np.clip(np.einsum("ij,ij->i", start, along) / np.maximum(square, 1e-300), 0.0, 1.0)
        q = corner[:, i] + t[:, None] * along
        distance = np.einsum("ij,ij->i", p - q, p - q)
        closer = distance < best
        best[closer] = distance[closer]
        out[closer] = q[closer]
        feature[closer] = np.where(t <= 0.0, 4 + i, np.where(t >= 1.0, 4 + j, 1 + k))[closer]
        inside &= np.einsum("ij,ij->i", np.cross(along, start), normal) > 0.0
    height = np.einsum("ij,ij->i", p - corner[:, 0], normal)
    out[inside] = (p - height[:, None] * normal)[inside]
    feature[inside] = 0
    return out, feature
