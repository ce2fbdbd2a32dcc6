"""Small triangulated bodies that tests compare with, and solids as STEP files."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from finger3d.geometry.surface import Triangles

CUBE = np.array([[x, y, z] for x in (0.0, 10.0) for y in (0.0, 10.0) for z in (0.0, 10.0)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def box(x: float, y: float, z: float, middle: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Triangles:
    """A box with these edges around a point."""
    points = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * [x, y, z] + middle
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])])
    return Triangles(points, faces)


def ball(radius: float, rings: int = 40, sectors: int = 80) -> Triangles:
    """A ball of latitude rings; its lowest point, (0, -radius, 0), is a vertex, and it is its own mirror image."""
    polar, turn = np.linspace(0.0, np.pi, rings + 1)[1:-1], 2.0 * np.pi * np.arange(sectors) / sectors
    y, r = -radius * np.cos(polar), radius * np.sin(polar)
    ring = np.stack(
        [np.outer(r, np.cos(turn)), np.repeat(y[:, None], sectors, axis=1), np.outer(r, np.sin(turn))], axis=2
    )
    points = np.vstack([ring.reshape(-1, 3), [[0.0, -radius, 0.0], [0.0, radius, 0.0]]])
    here, after = np.arange(sectors), (np.arange(sectors) + 1) % sectors
    south, north = len(points) - 2, len(points) - 1
    faces = [np.stack([south + 0 * here, here, after], axis=1)]
    for i in range(rings - 2):
        a, b = i * sectors + here, i * sectors + after
        faces += [np.stack([a, a + sectors, b], axis=1), np.stack([b, a + sectors, b + sectors], axis=1)]
    last = (rings - 2) * sectors
    faces.append(np.stack([north + 0 * here, last + after, last + here], axis=1))
    return Triangles(points, np.vstack(faces))


def channel(inner: float, leg: float, wall: float = 5.0, length: float = 40.0) -> Triangles:
    """A U upside down along z: `inner` between its legs, `leg` long."""
    a, b, top = 0.5 * inner, 0.5 * inner + wall, leg + wall
    outline = np.array([[-b, 0], [-a, 0], [-a, leg], [a, leg], [a, 0], [b, 0], [b, top], [-b, top]], dtype=float)
    caps = np.array([[0, 1, 2], [0, 2, 7], [2, 3, 6], [2, 6, 7], [3, 4, 5], [3, 5, 6]])
    points = np.vstack([np.insert(outline, 2, s * 0.5 * length, axis=1) for s in (-1.0, 1.0)])
    here, after = np.arange(8), (np.arange(8) + 1) % 8
    sides = [np.stack([here, after, after + 8], axis=1), np.stack([here, after + 8, here + 8], axis=1)]
    return Triangles(points, np.vstack([caps[:, ::-1], caps + 8, *sides]))


def random_points(count: int, seed: int = 0) -> np.ndarray:
    """Random points (count, 3) mm in a cube with edges of 3 mm about the origin."""
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, 3))


def write_stl(path: Path, surface: Triangles) -> Path:
    """Write a text STL, with all digits."""
    lines = ["solid test"]
    for corners in surface.corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {!r} {!r} {!r}".format(*map(float, p)) for p in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid test"]) + "\n", encoding="ascii")
    return path


def step_of(path: Path, solid: Any, **options: Any) -> Path:
    """Write a solid, and return where."""
    from build123d import export_step

    assert export_step(solid, path, **options)
    return path
