"""Size and quality of a mesh, and limits of edge lengths and memory, checked before meshing."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from finger3d._cost import MAX_TETS, MEMORY_SHARE, mesh_gb, rows_gb
from finger3d._machine import memory_bytes
from finger3d._ranges import at_most
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh, curved_volume, min_angle_deg
from finger3d.geometry.design import Design
from finger3d.meshing.sizing import MeshOptions, Sizing, count_cells


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


def check_sizes(design: Design, options: MeshOptions, dim: int) -> None:
    """Raise a Finger3dError for edge lengths that are not positive, in the wrong order, or exceed the finger."""
    for key in ("size_mm", "base_size_mm"):
        value = getattr(options, key)
        if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
            raise Finger3dError(f"mesh.{key} = {value!r} is no edge length; allowed: a positive number of mm")
    size, base = options.size_mm, options.base_size_mm
    if base < size:
        raise Finger3dError(f"mesh.base_size_mm = {base:g} is smaller than size_mm; allowed: at least {size:g}")
    extents = {"height": design.height_mm, "length": 2.0 * design.half_length_mm}
    if dim == 3:
        extents["width"] = design.width_mm
    name = min(extents, key=lambda k: extents[k])
    if size > extents[name]:
        raise Finger3dError(
            f"mesh.size_mm = {size:g} is larger than the finger; allowed: at most its {name}, "
            f"{at_most(extents[name])} mm"
        )


def is_possible(cells: float, dim: int, cap: float = math.inf, rows: float = 0.0) -> bool:
    """Return whether a mesh with `rows` of contact is estimated to fit into memory and has at most `cap` cells."""
    return mesh_gb(cells, dim) + rows_gb(rows) <= MEMORY_SHARE * _machine_gb() and cells <= cap


def check_count(cells: float, dim: int, options: MeshOptions, cap: float = math.inf) -> None:
    """Raise a Finger3dError for a mesh estimated to need too much memory or more than `cap` cells."""
    if is_possible(cells, dim, cap):
        return
    need, have = mesh_gb(cells, dim), _machine_gb()
    kind = "triangles" if dim == 2 else "tetrahedra"
    limit = f"{MEMORY_SHARE * have:.1f} GB of {have:.1f} GB" if need > MEMORY_SHARE * have else f"{cap:.0f} {kind}"
    sizes = f"mesh.size_mm = {options.size_mm:g} with base_size_mm = {options.base_size_mm:g}"
    forecast = f"{cells:.2g} {kind}, forecast {need:.2g} GB"
    raise Finger3dError(f"{sizes} gives about {forecast}; allowed: at most {limit}; choose larger sizes")


def checked_tets(design: Design, field: Sizing, options: MeshOptions) -> float:
    """Return the estimated number of tets of an unstructured mesh; raise a Finger3dError if these are too many."""
    cells = count_cells(design, field)
    check_count(cells, 3, options, MAX_TETS)
    return cells


def check_rows(contact: int, readings: int) -> None:
    """Raise a Finger3dError if the dense compliance of the condensed rows is estimated to need too much memory."""
    rows = f"{contact} rows of contact points and {readings} of readings"
    cure = "fewer gauges and markers" if readings > contact else "a larger mesh.size_mm"
    check_memory(rows_gb(contact + readings), f"mesh.size_mm: {rows} are condensed to", cure)


def check_memory(
    need_gb: float, what: str, cure: str = "a larger mesh.size_mm, fewer increments or fewer gauges"
) -> None:
    """Raise a Finger3dError, which names a cure, if something is estimated to need too much memory."""
    have = _machine_gb()
    if need_gb > MEMORY_SHARE * have:
        limit = f"at most {MEMORY_SHARE * have:.1f} GB of {have:.1f} GB"
        raise Finger3dError(f"{what}: forecast {need_gb:.2g} GB; allowed: {limit}; choose {cure}")


def _machine_gb() -> float:
    total = memory_bytes()
    return total[0] / 1e9 if total else math.inf
