"""Bodies of triangles: labels, and coarser triangles for the mesher."""

from __future__ import annotations

import numpy as np

from finger3d.geometry.faceted import body as faceted_body
from finger3d.geometry.faceted import coarser
from finger3d.geometry.imported import of_surface
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from tests.bodies import ball


def test_texture_is_taken_together_by_label() -> None:
    x, z = np.meshgrid(np.linspace(-5, 5, 61), np.linspace(-5, 5, 61), indexing="ij")
    bumps = 3.0 + 0.8 * np.maximum(0.0, np.sin(8.0 * x) * np.sin(8.0 * z))
    surface = height_field(x, z, bumps)
    assert mistake(surface) == ""
    body = faceted_body(of_surface(surface, "texture").surface)
    assert {f.label for f in body.faces} <= {"base", "contact", "ends", "walls"}
    assert len(body.faces) <= 150


def height_field(x: np.ndarray, z: np.ndarray, y: np.ndarray) -> Triangles:
    """A closed body under a height field (n, m)."""
    n, m = x.shape
    top = np.stack([x, y, z], axis=2).reshape(-1, 3)
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (number[i : n - 1 + i, j : m - 1 + j].ravel() for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))
    up = np.vstack([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    after = np.roll(rim, -1)
    skirt = np.vstack(
        [np.stack([rim, after, after + n * m], axis=1), np.stack([rim, after + n * m, rim + n * m], axis=1)]
    )
    return Triangles(np.vstack([top, top * [1.0, 0.0, 1.0]]), np.vstack([up, up[:, ::-1] + n * m, skirt]))


def test_fine_triangles_are_coarsened_for_the_mesher_only() -> None:
    half = ball(8.0, 80, 160)
    keep = half.corners[:, :, 1].max(axis=1) <= 1e-9
    rim = np.flatnonzero(np.abs(half.points[:, 1]) < 1e-9)
    rim = rim[np.argsort(np.arctan2(half.points[rim, 2], half.points[rim, 0]))]
    points = np.vstack([half.points, [[0.0, 0.0, 0.0]]])
    lid = np.stack([np.full(len(rim), len(half.points)), np.roll(rim, -1), rim], axis=1)
    bowl = of_surface(Triangles(points, np.vstack([half.faces[keep], lid])), "bowl", upside_down=True)
    body = faceted_body(bowl.surface)
    less = coarser(body, 2e-4)
    assert len(less.triangles) < 0.6 * len(body.triangles)
    found = Triangles(less.points, less.triangles)
    assert mistake(found) == ""
    assert np.abs(bowl.surface.signed_distance(found.corners.mean(axis=1))[0]).max() < 0.02
    assert less.faces is body.faces
    assert set(less.labels) == {"base", "contact"}
