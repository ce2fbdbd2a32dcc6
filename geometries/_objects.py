"""Bodies of the gallery that come from files, made here: python geometries/_objects.py writes them beside this file."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def spun(profile: Float, count: int) -> tuple[Float, NDArray[np.int64]]:
    """Points and outward triangles of a body of revolution about z: (k, 2) radius and z from end to end of the axis."""
    angle = 2.0 * math.pi * np.arange(count) / count
    rings = [np.stack([r * np.sin(angle), -r * np.cos(angle), np.full(count, z)], axis=1) for r, z in profile]
    return _sewn(np.array(rings), profile[0, 1], profile[-1, 1])


def extruded(outline: Float, thickness: float) -> tuple[Float, NDArray[np.int64]]:
    """Points and outward triangles of a prism along z over an outline (n, 2) that is star-shaped about the origin."""
    rings = [np.hstack([outline, np.full((len(outline), 1), z)]) for z in (-0.5 * thickness, 0.5 * thickness)]
    return _sewn(np.array(rings), -0.5 * thickness, 0.5 * thickness)


def _sewn(rings: Float, low: float, high: float) -> tuple[Float, NDArray[np.int64]]:
    """Triangulate between rings (k, n, 3), counterclockwise about z and ascending, closed by fans from the axis."""
    k, n, _ = rings.shape
    here = np.arange(n)
    after = (here + 1) % n
    faces = [np.stack([k * n + 0 * here, after, here], axis=1)]
    for i in range(k - 1):
        a, b, c, d = i * n + here, i * n + after, (i + 1) * n + here, (i + 1) * n + after
        faces += [np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)]
    faces.append(np.stack([k * n + 1 + 0 * here, (k - 1) * n + here, (k - 1) * n + after], axis=1))
    return np.vstack([rings.reshape(-1, 3), [[0.0, 0.0, low], [0.0, 0.0, high]]]), np.vstack(faces)


def coin() -> tuple[Float, NDArray[np.int64]]:
    """A coin on its rim: 25 mm across, 2 mm thick, edges broken by 0.25 mm, its axis along z."""
    return spun(np.array([[12.25, -1.0], [12.5, -0.75], [12.5, 0.75], [12.25, 1.0]]), 240)


def gear() -> tuple[Float, NDArray[np.int64]]:
    """A gear wheel of 24 teeth, module 1 mm, 16 mm thick, its axis along z, with a tooth straight down."""
    teeth, module = 24, 1.0
    pitch = 0.5 * teeth * module
    tip, root = pitch + module, pitch - 1.25 * module
    # Straight flanks of 20 degrees, a quarter pitch wide at the pitch circle, the tips' edges broken by a fifth.
    half = 0.25 * math.pi * module
    flank = math.tan(math.radians(20.0))
    broken = 0.2 * module
    shape = [(-half - flank * 1.25 * module, root), (-half + flank * (module - broken), tip - broken)]
    shape += [(-half + flank * module + broken, tip)]
    one = np.array([*shape, *[(-x, r) for x, r in reversed(shape)]])
    angle = -0.5 * math.pi + 2.0 * math.pi * np.arange(teeth) / teeth
    outline = []
    for turn in angle:
        along = np.array([math.cos(turn), math.sin(turn)])
        outline += [r * along + x * np.array([-along[1], along[0]]) for x, r in one]
    return extruded(np.array(outline), 16.0)


def write_stl(path: Path, points: Float, faces: NDArray[np.int64]) -> None:
    """Write a binary STL file, mm."""
    corners = points[faces].astype("<f4")
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    record["normal"], record["corners"] = normal, corners
    header = b"finger3d gallery, mm".ljust(80, b" ")
    path.write_bytes(header + np.uint32(len(faces)).astype("<u4").tobytes() + record.tobytes())


BODIES = {"coin": coin, "gear": gear}

if __name__ == "__main__":
    for name, make in BODIES.items():
        write_stl(Path(__file__).with_name(f"{name}.stl"), *make())
        print(f"{name}.stl written")
