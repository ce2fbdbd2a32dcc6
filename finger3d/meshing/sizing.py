"""Edge lengths of a mesh: options, and sizes that grow with the distance from the contact zone and given places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from finger3d._cost import tets_made
from finger3d._types import Float, Int, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import in_space
from finger3d.geometry.design import Design

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


Mesher = Literal["ftetwild", "netgen", "swept"]
"""Unstructured tetrahedra by fTetWild or netgen, or tetrahedra swept along z."""

Zone = tuple[float, float, float, float]
"""x_min, x_max, z_min, z_max in mm: where contact is predicted."""


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


@dataclass(frozen=True)
class MeshOptions:
    """Edge lengths at the contact and far from it (mm), and the mesher (solids only; sections are structured).

    `layers` is the least number of layers of a swept mesh over half the width; one layer cannot follow the bulge of a
    free end.  `gauge_refinement` is the edge length at the contact over that around gauges and on the contact face
    close to them; at 1 the mesh is not refined.
    `stick_refinement` is the edge length at the contact over that at the border of stick, and `borders` are the edge
    lengths there, once a press has found it.
    """

    size_mm: float
    base_size_mm: float
    mesher: Mesher = "ftetwild"
    layers: int = 2
    gauge_refinement: float = 1.0
    stick_refinement: float = 1.0
    borders: SizedPlaces | None = None

    def as_table(self) -> dict[str, float | str]:
        """The keys of ``[mesh]`` in a scene."""
        sizes: dict[str, float | str] = {"size_mm": self.size_mm, "base_size_mm": self.base_size_mm}
        finer = {} if self.gauge_refinement == 1.0 else {"gauge_refinement": self.gauge_refinement}
        finer |= {} if self.stick_refinement == 1.0 else {"stick_refinement": self.stick_refinement}
        return sizes | finer | {"mesher": self.mesher}


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
        places = in_space(points)
        places[:, [0, 2]] = np.abs(places[:, [0, 2]])
        classes = np.round(_CLASSES_PER_DOUBLING * np.log2(self.sizes)).astype(int)
        out = np.full(len(points), math.inf)
        for one in np.unique(classes):
            own = classes == one
            out = np.minimum(out, SizedPlaces(self.points[own], 2.0 ** (one / _CLASSES_PER_DOUBLING), rate).at(places))
        return out


RATE = 0.5
"""Growth of the edge length per distance from the zone.  On Fig. 9 with as many contact points, 0.5 and a background
grid as fine as the contact take 13 % fewer unknowns than 0.3 and twice the step, with the same errors."""

_PLATEAU_STEPS = 1.2  # constant size around the zone, in background steps; the grid would miss a narrower zone
_TETS_PER_CUBE = 10.0  # tets per (edge length)^3; measured 9.6 to 11
_GRADED = 0.95  # edge length over the largest below which fewer tets are made
_LAYER_EDGE = 0.85  # edge length in a layer that is thinner than the edges asked for, over its thickness
_MAX_BACKGROUND_CELLS = 60  # along the longest side


@dataclass(frozen=True)
class Sizing:
    """Edge length (mm) as a function of position, sampled on a background grid.

    Attributes
    ----------
    size_mm, base_mm : edge length in the zone, and the largest one
    low, high : (3,) corners of the box around the meshed body, mm
    zone : (n, 3) points of the contact surface in the zone, mm
    step : spacing of the background grid, mm
    grading : shorter edges inside the body
    """

    size_mm: float
    base_mm: float
    low: Float
    high: Float
    zone: Float
    step: float
    grading: Grading | None = None

    def at(self, points: Float) -> Float:
        """Return the edge length (n,) at points (n, 3)."""
        zone = SizedPlaces(self.zone, self.size_mm, RATE, _PLATEAU_STEPS * self.step)
        value: Float = np.minimum(self.base_mm, zone.at(points))
        return value if self.grading is None else np.minimum(value, self.grading.at(points, RATE))

    def grid(self) -> tuple[list[Float], Float]:
        """Return the coordinates of the background grid along x, y, z, and its edge lengths (nx, ny, nz)."""
        low, high = self.low - self.step, self.high + self.step
        counts = np.maximum(1, np.ceil((high - low) / self.step - 1e-9)).astype(int)
        if self._fills_width:
            counts[2] = 1
        axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        if self._fills_width:
            points[:, 2] = np.clip(points[:, 2], self.zone[:, 2].min(), self.zone[:, 2].max())
        return axes, self.at(points).reshape(counts + 1)

    def background(self) -> tuple[Float, Int, Float]:
        """Return the background mesh: points (n, 3), tets (m, 4) by Kuhn's subdivision, edge lengths (n,)."""
        axes, values = self.grid()
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        nodes = np.array(values.shape)
        stride = np.array([nodes[1] * nodes[2], nodes[2], 1])
        cell = np.stack(np.meshgrid(*(np.arange(n - 1) for n in nodes), indexing="ij"), axis=-1).reshape(-1, 3) @ stride
        paths = [[i, j, 3 - i - j] for i in range(3) for j in range(3) if i != j]
        tets = np.vstack([cell[:, None] + np.concatenate([[0], np.cumsum(stride[p])]) for p in paths])
        return points, tets, values.ravel()

    @property
    def longest_mm(self) -> float:
        """Largest edge length that fTetWild is given; an edge longer than the body hangs it."""
        return min(self.base_mm, float((self.high - self.low).min()))

    @property
    def share_made(self) -> float:
        """Number of tets that are made over the number that the field asks for, where edges are shorter than that."""
        return tets_made(self.longest_mm / self.size_mm)

    @property
    def _fills_width(self) -> bool:
        # One layer of background cells is exact then, since the field does not depend on z.
        inner = self.low[2] + self.step, self.high[2] - self.step
        return bool(self.zone[:, 2].min() <= inner[0] and self.zone[:, 2].max() >= inner[1])


def rounded_zone(design: Design, options: MeshOptions, zone: Zone) -> Zone:
    """Return the zone widened to multiples of the edge length in the footprint, so that similar zones share a mesh."""
    size = options.size_mm
    reach = (design.half_length_mm, design.half_length_mm, 0.5 * design.width_mm, 0.5 * design.width_mm)
    grid = [
        (math.floor if i % 2 == 0 else math.ceil)(z / size + (1e-9, -1e-9)[i % 2]) * size for i, z in enumerate(zone)
    ]
    clipped = [min(max(g, -r), r) for g, r in zip(grid, reach, strict=True)]
    return clipped[0], clipped[1], clipped[2], clipped[3]


def sizing(design: Design, options: MeshOptions, zone: Zone, low: Float, high: Float) -> Sizing:
    """Return the size field of a body in the box from `low` to `high` (3,), mm.

    Raises
    ------
    Finger3dError
        If the zone lies outside the box or the footprint.
    """
    step = float(max(options.size_mm, design.half_length_mm / 50.0, (high - low).max() / _MAX_BACKGROUND_CELLS))
    x0, x1 = max(zone[0], low[0]), min(zone[1], high[0])
    z0, z1 = max(zone[2], low[2]), min(zone[3], high[2])
    sides = [np.linspace(a, b, max(2, math.ceil(2.0 * (b - a) / step) + 1)) for a, b in ((x0, x1), (z0, z1))]
    x, z = np.meshgrid(*sides)
    points = np.stack([x.ravel(), design.top(x.ravel(), z.ravel()), z.ravel()], axis=1)
    points = points[np.isfinite(points[:, 1])]
    if x1 < x0 or z1 < z0 or not len(points):
        raise Finger3dError(f"{design.name}: the predicted contact zone {zone} mm lies outside the meshed part")
    return Sizing(options.size_mm, options.base_size_mm, low, high, points, step)


def count_cells(design: Design, field: Sizing, samples: int = 40) -> float:
    """Estimate the number of tets that are made: 10 times the integral of dV / h^3, and a share where h grows."""
    from scipy.interpolate import RegularGridInterpolator

    # fTetWild interpolates between the grid points, which gives larger edges than the field itself.
    seen = RegularGridInterpolator(*field.grid())
    middle = (np.arange(samples) + 0.5) / samples
    spans = field.high - field.low
    # Denser towards the surface, where the small elements are.
    depth = middle**3
    weight = 3.0 * middle**2 / samples
    x, z = np.meshgrid(field.low[0] + middle * spans[0], field.low[2] + middle * spans[2], indexing="ij")
    top = np.nan_to_num(design.top(x.ravel(), z.ravel()))
    column = spans[0] * spans[2] / samples**2 * top
    section, total = design.section(), 0.0
    thickness = section.height_mm - section.inner.height_mm if section else 0.0
    for d, w in zip(depth, weight, strict=True):
        h = seen(np.stack([x.ravel(), top * (1.0 - d), z.ravel()], axis=1))
        made = np.where(h < _GRADED * field.longest_mm, field.share_made, 1.0) * np.minimum(h, field.longest_mm) ** -3.0
        made = np.where(d * top < thickness, np.maximum(made, (_LAYER_EDGE * thickness or 1.0) ** -3.0), made)
        total += w * float(column @ made)
    return _TETS_PER_CUBE * total
