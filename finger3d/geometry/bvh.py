"""Bounding volume hierarchy of triangles, traversed for many queries at once, level by level, with array operations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int

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
