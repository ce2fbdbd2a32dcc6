"""Limits of edge lengths and memory, checked before meshing."""

from __future__ import annotations

import math

from finger3d._cost import MAX_TETS, MEMORY_SHARE, mesh_gb, rows_gb
from finger3d._machine import memory_bytes
from finger3d._ranges import at_most
from finger3d.errors import Finger3dError
from finger3d.geometry.design import Design
from finger3d.meshing.sizing import MeshSizes, Sizing, count_cells


def check_sizes(design: Design, options: MeshSizes, dim: int) -> None:
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


def check_count(cells: float, dim: int, options: MeshSizes, cap: float = math.inf) -> None:
    """Raise a Finger3dError for a mesh estimated to need too much memory or more than `cap` cells."""
    if is_possible(cells, dim, cap):
        return
    need, have = mesh_gb(cells, dim), _machine_gb()
    kind = "triangles" if dim == 2 else "tetrahedra"
    limit = (
        f"at most {MEMORY_SHARE * have:.1f} GB of {have:.1f} GB"
        if need > MEMORY_SHARE * have
        else f"at most {cap:.0f} {kind}"
    )
    raise Finger3dError(
        f"mesh.size_mm = {options.size_mm:g} with base_size_mm = {options.base_size_mm:g} gives about "
        f"{cells:.2g} {kind}, forecast {need:.2g} GB; allowed: {limit}; choose larger sizes"
    )


def checked_tets(design: Design, field: Sizing, options: MeshSizes) -> float:
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
