"""The lines of a section that a picture shows, as matplotlib paths: the cells' edges, and the outline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d.fem.simplex import Mesh

if TYPE_CHECKING:
    from matplotlib.path import Path

Float = NDArray[np.float64]

_MANY_CELLS = 4000


def _runs(lines: Float) -> Path:
    """One path of separate polylines (k, p, 2): a thousand artists would take as long as the solution."""
    from matplotlib.path import Path

    codes = np.full(lines.shape[:2], Path.LINETO)
    codes[:, 0] = Path.MOVETO
    return Path(lines.reshape(-1, 2), codes.ravel())


def edges_of(mesh: Mesh, moved: Float) -> Path:
    """The cells' edges, each once; of a fine mesh none, which would be a grey area and no picture of it."""
    if len(mesh.cells) > _MANY_CELLS:
        return _runs(np.zeros((0, 2, 2)))
    sides = mesh.element.edges
    if mesh.element.is_quadratic:
        sides = np.insert(sides, 1, range(3, 6), axis=1)
    edges = mesh.cells[:, sides].reshape(-1, len(sides[0]))
    ends = np.sort(edges[:, [0, -1]], axis=1)
    return _runs(moved[edges[np.unique(ends, axis=0, return_index=True)[1]]])


def outline_of(mesh: Mesh, moved: Float) -> Path:
    """The boundary of a section as a closed path."""
    from matplotlib.path import Path

    facets = np.concatenate([f for f in mesh.facets.values() if len(f)])
    facets = facets[:, [0, 2, 1]] if mesh.element.is_quadratic else facets
    following = {int(a): i for i, a in enumerate(facets[:, 0])}
    ring = [0]
    while (after := following[int(facets[ring[-1], -1])]) != 0:
        ring.append(after)
    return Path(np.concatenate([moved[facets[ring, :-1]].reshape(-1, 2), moved[facets[:1, 0]]]), closed=True)
