"""Seams where CAD faces meet smoothly: a node there is placed on one of the faces, not on the seam.

Two faces without a crease between them, such as a fillet and the flat it starts from, define no line on which a node
could be placed.  A node one edge length h from the seam is up to h^2/8R off one of the surfaces; moved onto both, it
would slide along them past its neighbours.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.geometry.faceted import Faceted
from finger3d.geometry.implicit import ImplicitPlane
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import Tessellation

Bool = NDArray[np.bool_]

SMOOTH = np.cos(np.radians(6.0))
"""Creases below 6 degrees count as none: an edge of length h that cuts across one misses it by h/80 at most, and a node
put onto two surfaces at a smaller angle moves by more than ten times its distance from them."""

_PLANES = ("base", "symmetry_x", "symmetry_z")  # stay exactly planar, whatever runs into them


class Seams:
    """The seams of a body, sampled where its tessellation has points on them."""

    def __init__(self, body: Tessellation) -> None:
        self.faces = body.faces
        self.exact_plane = np.array([f.label in _PLANES and isinstance(f.surface, ImplicitPlane) for f in body.faces])
        self._triangles = [Triangles(body.points, body.triangles[body.face == i]) for i in range(len(body.faces))]
        self._samples: dict[tuple[int, int], tuple[Float, Bool]] = {}
        if any(isinstance(f.surface, Faceted) for f in body.faces):
            return  # patches of an STL body are smooth themselves, and end at creases
        used = [np.unique(t.faces) for t in self._triangles]
        for i, j in combinations(range(len(body.faces)), 2):
            if len(shared := np.intersect1d(used[i], used[j])):
                seam_points = body.points[shared]
                a, b = (body.faces[k].sign * body.faces[k].surface.distance(seam_points)[1] for k in (i, j))
                self._samples[i, j] = seam_points, np.einsum("ij,ij->i", a, b) > SMOOTH

    def one_per_smooth_group(self, points: Float, sets: Bool, candidates: Bool | None = None) -> Bool:
        """Return the sets (n, f) with one face of each smooth group: an exact plane, or the one nearest to the point.

        The `candidates` (n, f) belong to a group as well if they join a face of the set smoothly.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        count = sets.shape[1]
        members = sets if candidates is None else sets | candidates
        links = []
        for (i, j), (seam_points, smooth) in self._samples.items():
            both = np.flatnonzero(members[:, i] & members[:, j])
            if len(both) and smooth.any():
                both = both[smooth[cKDTree(seam_points).query(points[both])[1]]]
                links.append(np.stack([both * count + i, both * count + j]))
        if not links or not (pairs := np.hstack(links)).size:
            return sets
        joined = coo_matrix((np.ones(pairs.shape[1]), pairs), shape=(sets.size, sets.size))
        group = connected_components(joined, directed=False)[1]
        several = np.unique(pairs)
        several = several[np.isin(group[several], group[several[sets.ravel()[several]]])]
        distance = self.distance(points, several // count, several % count)
        first = several[np.lexsort([distance, ~self.exact_plane[several % count], group[several]])]
        chosen = first[np.unique(group[first], return_index=True)[1]]
        rows = sets.copy()
        rows.ravel()[several] = False
        rows.ravel()[chosen] = True
        return rows

    def reduce_to_nearest(self, points: Float, sets: Bool) -> Bool:
        """Return the sets (n, f) reduced to the exact planes and the nearest of the other faces."""
        others = sets & ~self.exact_plane
        node, face = np.nonzero(others)
        order = np.lexsort([self.distance(points, node, face), node])
        node, face = node[order], face[order]
        first = np.unique(node, return_index=True)[1]
        rows: NDArray[np.bool_] = sets & self.exact_plane
        rows[node[first], face[first]] = True
        return rows

    def reduce_to_exact_planes(self, points: Float, sets: Bool) -> Bool:
        """Return the sets (n, f) reduced to the exact planes, if there are any."""
        planes = sets & self.exact_plane
        return np.where(planes.any(axis=1)[:, None], planes, sets)

    def distance(self, points: Float, node: Int, face: Int) -> Float:
        """Distance (k,), mm, of points[node] from the triangles of the faces (k,)."""
        out = np.empty(len(node))
        for i in np.unique(face):
            at = points[node[face == i]]
            out[face == i] = np.linalg.norm(self._triangles[i].closest(at)[0] - at, axis=1)
        return out
