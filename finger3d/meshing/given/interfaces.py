"""Parts of an unstructured mesh: the part of every cell, and the facets of the surface and between parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh import FACETS
from finger3d.geometry.parts import OUTSIDE
from finger3d.geometry.surface import Triangles
from finger3d.geometry.tessellate import Tessellation

_MOST_SAMPLES = 20_000
"""Largest number of points with which the surface of a part is sampled."""


class PartFacets(NamedTuple):
    """Facets between cells of different parts, and of the surface.

    Attributes
    ----------
    faces : (m, 3) oriented outward from the part inside them
    inside, outside : (m,) numbers of the parts on their sides; outside is OUTSIDE at the surface
    """

    faces: Int
    inside: Int
    outside: Int

    @property
    def free(self) -> Int:
        """Facets (k, 3) of the surface."""
        return np.asarray(self.faces[self.outside == OUTSIDE])


def part_facets(tets: Int, part: Int | None = None) -> PartFacets:
    """Return the facets of linear cells (t, 4) that belong to one cell only, or to cells of two parts (t,)."""
    faces = tets[:, FACETS[3]].reshape(-1, 3)
    owner = np.zeros(len(faces), dtype=np.int64) if part is None else np.repeat(part, 4)
    key = np.sort(faces, axis=1)
    order = np.lexsort([owner, key[:, 2], key[:, 1], key[:, 0]])
    twice = (key[order[1:]] == key[order[:-1]]).all(axis=1)
    single = ~(np.append(twice, False) | np.append(False, twice))
    first, second = order[:-1][twice], order[1:][twice]
    between = owner[first] != owner[second]
    chosen = np.concatenate([order[single], first[between]])
    outside = np.concatenate([np.full(single.sum(), OUTSIDE), owner[second[between]]])
    back = np.argsort(chosen, kind="stable")  # in the order of the cells
    chosen, outside = chosen[back], outside[back]
    return PartFacets(faces[chosen], owner[chosen], outside)


def parts_of(points: Float, body: Tessellation) -> Int:
    """Return the number (n,) of the part that holds each point (n, 3), OUTSIDE for points in none."""
    parts = np.full(len(points), OUTSIDE)
    depth = np.zeros(len(points))
    for number in range(len(body.part_labels) + 1):
        surface = body.part(number)
        if not len(surface.faces):
            continue
        box = np.all((surface.low <= points) & (points <= surface.high), axis=1)
        distance = np.ones(len(points))
        distance[box] = surface.signed_distance(points[box])[0]
        deeper = distance < depth
        parts[deeper], depth[deeper] = number, distance[deeper]
    return parts


def thickness(surface: Triangles) -> float:
    """Return twice the volume over the area of a closed surface, mm: the thickness of a layer."""
    return float(2.0 * surface.volume / np.linalg.norm(surface.area_vectors, axis=1).sum())


def points_on(surface: Triangles, step: float) -> Float:
    """Return points (n, 3), mm, on a surface, about a step (mm) apart."""
    area = np.linalg.norm(surface.area_vectors, axis=1)
    count = int(np.clip(4.0 * area.sum() / step**2, 100, _MOST_SAMPLES))
    random = np.random.default_rng(0)  # the same points every time
    chosen = random.choice(len(area), count, p=area / area.sum())
    weight = random.dirichlet(np.ones(3), count)
    return np.asarray(np.einsum("nk,nkd->nd", weight, surface.corners[chosen]))
