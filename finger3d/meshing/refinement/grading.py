"""Edge lengths prescribed at points of a body, between which they grow with the distance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Float, freeze_arrays

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_CLASSES_PER_DOUBLING = 2
"""Size classes in which points are looked up; a class errs by less than half a class, 19 % of the edge length."""


@dataclass(frozen=True, eq=False)
class SizedPlaces:
    """Edge length that is `size` (mm) within `reach` (mm) of places (k, d), and grows by `rate` per distance beyond."""

    places: Float
    size: float
    rate: float
    reach: float = 0.0

    @cached_property
    def tree(self) -> cKDTree:
        """The places, to be searched for the nearest one."""
        from scipy.spatial import cKDTree

        return cKDTree(self.places)

    def at(self, points: Float) -> Float:
        """Return the edge length (n,) mm at points (n, d)."""
        return np.asarray(self.size + self.rate * np.maximum(self.tree.query(points)[0] - self.reach, 0.0))


@dataclass(frozen=True, eq=False)
class Grading:
    """Edge length as a function of position: the least of ``h_k + rate |x - x_k|`` over points x_k.

    Attributes
    ----------
    points : (k, 3) mm, in the part where x and z are not negative
    sizes : (k,) mm
    """

    points: Float
    sizes: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def at(self, points: Float, rate: float) -> Float:
        """Return the edge length (n,) mm at points (n, d), at the mirror images of the part too."""
        places = np.zeros((len(points), 3))
        places[:, : points.shape[1]] = points
        places[:, [0, 2]] = np.abs(places[:, [0, 2]])
        classes = np.round(_CLASSES_PER_DOUBLING * np.log2(self.sizes)).astype(int)
        out = np.full(len(points), math.inf)
        for one in np.unique(classes):
            own = classes == one
            out = np.minimum(out, SizedPlaces(self.points[own], 2.0 ** (one / _CLASSES_PER_DOUBLING), rate).at(places))
        return out
