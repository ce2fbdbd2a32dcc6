"""Inner free surfaces of hollow fingers, which take no part in contact."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.fem.mesh.elements import TRIANGLES
from finger3d.fem.mesh.simplex import Mesh

CAVITY = "cavity"
"""Label of the facets of inner surfaces."""


def cavity_warnings(mesh: Mesh, displacement: Float) -> list[str]:
    """Return a warning if the inner surface of a solid crosses itself: nothing keeps its faces apart.

    Parameters
    ----------
    mesh : the whole finger at rest, mm
    displacement : (n, 3) mm
    """
    facets = mesh.facets.get(CAVITY)
    if facets is None or not len(facets):
        return []
    from finger3d.geometry.surface import Triangles
    from finger3d.geometry.surface_checks import crossings

    triangles = facets[:, TRIANGLES].reshape(-1, 3) if facets.shape[1] == 6 else facets
    nodes, faces = np.unique(triangles, return_inverse=True)
    pairs = crossings(Triangles((mesh.points + displacement)[nodes], faces.reshape(-1, 3)))
    if not len(pairs):
        return []
    where = (mesh.points[nodes[faces.reshape(-1, 3)[pairs[0]]]]).mean(axis=0)
    return [
        "the inner surface of the finger crosses itself near x, y, z = "
        + ", ".join(f"{value:.3g}" for value in where)
        + " mm at rest: its faces do not touch in this model; press less deep, or make the wall thicker"
    ]
