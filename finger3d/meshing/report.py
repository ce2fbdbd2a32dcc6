"""Size and quality of a mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from finger3d.fem.mesh import Mesh, curved_volume, min_angle_deg


@dataclass(frozen=True)
class MeshReport:
    """Size and quality of a mesh.

    Attributes
    ----------
    points, cells : of the meshed part
    min_dihedral_deg : smallest dihedral angle (2D: smallest angle) of the straight cells
    volume_mm3 : of the curved quadratic mesh, times its symmetry: the whole body (2D: area times width)
    cad_volume_mm3 : of the whole body, from CAD or in closed form
    hash : of points and cells; equal for equal meshes only
    from_cache, cache_path : whether the mesh was read from the cache, and its file there; None if it is not cached
    seconds : duration of "cad" and "mesh"
    """

    points: int
    cells: int
    min_dihedral_deg: float
    volume_mm3: float
    cad_volume_mm3: float
    hash: str
    from_cache: bool
    cache_path: str | None
    seconds: Mapping[str, float]


def content_hash(mesh: Mesh) -> str:
    """Return sixteen hexadecimal digits of the SHA-256 of points and cells."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes())
    digest.update(np.ascontiguousarray(mesh.cells).tobytes())
    return digest.hexdigest()[:16]


def mesh_report(
    mesh: Mesh,
    multiple: float,
    cad_volume_mm3: float,
    seconds: Mapping[str, float],
    *,
    from_cache: bool = False,
    cache_path: str | None = None,
) -> MeshReport:
    """Return the report on a quadratic mesh, the `multiple`-th part of the whole body."""
    return MeshReport(
        points=len(mesh.points),
        cells=len(mesh.cells),
        min_dihedral_deg=min_angle_deg(mesh),
        volume_mm3=multiple * curved_volume(mesh),
        cad_volume_mm3=cad_volume_mm3,
        hash=content_hash(mesh),
        from_cache=from_cache,
        cache_path=cache_path,
        seconds=dict(seconds),
    )
