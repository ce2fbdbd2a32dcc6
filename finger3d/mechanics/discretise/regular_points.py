"""Contact points on a regular grid, as a mesh of a given edge length would have them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.fem.mesh.simplex import CONTACT
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.mechanics.model import Model

Box = tuple[float, float, float, float]


def regular_points(model: Model, box: Box, size_mm: float, middle: Float | None = None) -> BoundarySurface:
    """Return a regular grid of contact points over a box.

    Parameters
    ----------
    box : (x_min, x_max, z_min, z_max), mm
    size_mm : distance of the points
    middle : (2,) array, mm
        Place in the middle of four points; by default the origin.
    """
    design, solid = model.design, model.domain == "solid"
    half = (design.half_length_mm, 0.5 * design.width_mm)
    middle = np.zeros(2) if middle is None else middle
    lines = [_lines(box[2 * k : 2 * k + 2], half[k], size_mm, middle[k]) for k in range(2 if solid else 1)]
    hats = [_hats(line) for line in lines]
    places, means = [h[0] for h in hats], [h[1] for h in hats]
    samples = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(lines))
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    mean = means[0] if len(means) == 1 else sp.kron(*means, format="csr")
    height, y = (design.top(p[:, 0], p[:, 1] if solid else 0.0 * p[:, 0]) for p in (samples, points))
    used = np.isfinite(height)
    mean = sp.csr_matrix(mean)[:, used]
    weight = np.asarray(mean.sum(axis=1)).ravel()
    kept = (weight > 0.0) & np.isfinite(y)
    mean = sp.csr_matrix(sp.diags_array(1.0 / weight[kept]) @ mean[kept])
    samples, points = (np.insert(p, 1, v, axis=1) for p, v in ((samples[used], height[used]), (points[kept], y[kept])))
    return BoundarySurface(
        nodes=np.arange(len(points)),
        face=np.full(len(points), CONTACT, dtype=np.int8),
        points=points,
        area=np.ones(len(points)),
        normals=np.zeros_like(points),
        trace=sp.csr_matrix((len(points), 0)),
        samples=samples,
        average=mean,
        interpolate=sp.csr_matrix((len(samples), 0)),
        hats=mean,
    )


def _lines(box: Sequence[float], half: float, size: float, middle: float) -> Float:
    """Return the coordinates of contact points along one axis, with the ends of the finger."""
    low, high = max(box[0] - size, -half), min(box[1] + size, half)
    first, last = math.ceil((low - middle) / size - 0.5), math.floor((high - middle) / size - 0.5)
    inner = middle + (np.arange(first, last + 1) + 0.5) * size
    ends = [v for v in (low, high) if abs(v) == half]
    line = np.unique(np.concatenate([inner, ends]))
    return line if len(line) > 1 else np.array([low, high])


def _hats(line: Float) -> tuple[Float, sp.csr_matrix]:
    """Return quadrature points (q,) between coordinates (n,), and the mean of samples over each hat function (n, q)."""
    x, w = np.polynomial.legendre.leggauss(4)
    weight = 0.5 * (x + 1.0)
    steps = np.diff(line)
    places = (line[:-1, None] + weight * steps[:, None]).ravel()
    mean = np.zeros((len(line), len(steps), 4))
    number = np.arange(len(steps))
    mean[number, number] = (1.0 - weight) * w * steps[:, None]
    mean[number + 1, number] = weight * w * steps[:, None]
    rows = mean.reshape(len(line), -1)
    return places, sp.csr_matrix(rows / rows.sum(axis=1, keepdims=True))
