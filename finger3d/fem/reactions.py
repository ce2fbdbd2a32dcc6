"""Mean traction of a support on a face, from the nodal forces that hold it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from finger3d._types import Float
from finger3d.errors import Finger3dError
from finger3d.fem.simplex import Mesh
from finger3d.fem.traces import surface
from finger3d.fem.transfer import values_over


def mean_traction_weights(mesh: Mesh, label: str, places: Float, thickness: float = 1.0) -> Float:
    """Return weights (n,), 1/mm2, of the nodal forces along one axis, whose sum is the mean traction at some places.

    The traction is the field of the face's shape functions that does the same work as the nodal forces (consistent
    boundary flux, Carey 1982): it converges faster than the stress of the cells at the face.

    Parameters
    ----------
    label : the face, which faces down
    places : (m, d) array, mm
        Places on the face.
    thickness : width of a section, mm

    Raises
    ------
    Finger3dError
        If a place is not on the face.
    """
    face, nodes = surface(mesh, label, thickness), np.unique(mesh.facets[label])
    values = face.interpolate[:, nodes]
    mass = values.T @ sp.diags_array(face.average.T @ face.area) @ values
    at_places, there = values_over(mesh, label, places - np.eye(mesh.dim)[1])
    if not there.all():
        raise Finger3dError(f"the place {np.round(places[np.argmin(there)], 6).tolist()} mm is not on the face {label}")
    mean = np.asarray(at_places.sum(axis=0)).ravel() / len(places)
    weights = np.zeros(len(mesh.points))
    weights[nodes] = splu(sp.csc_matrix(mass)).solve(mean[nodes])
    return weights
