"""Structured, reproducible meshes: quadratic triangles of a section, and tetrahedra swept from them along z."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh, boundary, quadratic, unfold
from finger3d.geometry.design import Design, lacks_section
from finger3d.geometry.section import Arc, Flat, Section
from finger3d.meshing.grid import GridLayout, Sizes, folded_zone, rows
from finger3d.meshing.limits import MeshReport, check_count, check_sizes, mesh_report
from finger3d.meshing.sizing import MeshOptions, Zone

_AXIS = {"x": 0, "z": 2}
_LEAST_ANGLE_DEG = 0.5  # of a cell; smaller angles occur where a wall or an edge is far thinner than the mesh


def mesh_section(
    design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...] = ()
) -> tuple[Mesh, MeshReport]:
    """Mesh the section of an extruded design with quadratic triangles, an exact mirror image of itself about x = 0.

    Parameters
    ----------
    design : a design with a section
    options : size_mm, base_size_mm
    zone : (x_min, x_max, z_min, z_max) mm where contact is predicted; z is not read
    symmetry : ("x",) for the half x >= 0 only
    """
    start = time.perf_counter()
    check_sizes(design, options, 2)
    axes = tuple(_AXIS[a] for a in ("x",) if a not in symmetry)
    grid, section = _grid(design, options, zone, 2, _copies(design, options, 2, symmetry))
    cells, part = grid.triangulated()
    mesh = _on_curves(quadratic(_with_parts(Mesh(grid.points, cells, grid.facets), section, part)), grid.curves)
    whole = unfold(mesh, axes)[0]
    seconds = {"cad": 0.0, "mesh": time.perf_counter() - start}
    multiple = design.width_mm * (2 - len(axes))
    return whole, _fit(mesh_report(whole, multiple, section.area_mm2 * design.width_mm, seconds), design, options)


def mesh_swept(
    design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...] = ()
) -> tuple[Mesh, MeshReport]:
    """Mesh an extruded design with quadratic tets, exactly symmetric about x = 0 and z = 0; see :func:`mesh_section`.

    Layers along z are equal and at most ``size_mm`` thick; over half the width there are at least ``options.layers``.
    """
    start = time.perf_counter()
    check_sizes(design, options, 3)
    half = 0.5 * design.width_mm
    layers = _layers(design, options)
    axes = tuple(_AXIS[a] for a in ("x", "z") if a not in symmetry)
    grid, section = _grid(design, options, zone, 3, _copies(design, options, 3, symmetry))
    levels = np.linspace(0.0, half, layers + 1)
    triangles, part = grid.triangulated()
    swept = _with_parts(_sweep(grid, triangles, levels), section, np.tile(part, 3 * layers))
    mesh = _on_curves(quadratic(swept), tuple((curve, np.tile(u, layers + 1)) for curve, u in grid.curves))
    whole = unfold(mesh, axes)[0]
    seconds = {"cad": 0.0, "mesh": time.perf_counter() - start}
    multiple = 4.0 / 2 ** len(axes)
    return whole, _fit(mesh_report(whole, multiple, section.area_mm2 * design.width_mm, seconds), design, options)


def cell_count(design: Design, options: MeshOptions, zone: Zone, dim: int, symmetry: tuple[str, ...]) -> float:
    """Return the number of cells of a mesh of :func:`mesh_section` or :func:`mesh_swept`, without making it."""
    return 2.0 * len(_layout(design, options, zone, dim)[0].points) * _copies(design, options, dim, symmetry)


def _layers(design: Design, options: MeshOptions) -> int:
    """Return the number of layers over half the width."""
    # Friction varies along z as it does along x, so no layer is thicker than the edge length at the contact.
    return max(options.layers, math.ceil(0.5 * design.width_mm / options.size_mm - 1e-9))


def _copies(design: Design, options: MeshOptions, dim: int, symmetry: tuple[str, ...]) -> int:
    """Return the number of cells for each triangle of the half section."""
    each = 1 if dim == 2 else 3 * _layers(design, options)
    mirrors = sum(axis not in symmetry for axis in "xz"[: dim - 1])
    return int(each * 2**mirrors)


def _fit(quality: MeshReport, design: Design, options: MeshOptions) -> MeshReport:
    """Return the report, or raise a Finger3dError for cells that are too flat."""
    if quality.min_dihedral_deg >= _LEAST_ANGLE_DEG:
        return quality
    raise Finger3dError(
        f"{design.name}: mesh.size_mm = {options.size_mm:g} gives cells of {quality.min_dihedral_deg:.2g} deg, flatter "
        f"than {_LEAST_ANGLE_DEG:g}; a wall or an edge is too thin for it: choose smaller sizes, or edge_height_mm = 0"
    )


def _grid(design: Design, options: MeshOptions, zone: Zone, dim: int, copies: int) -> tuple[GridLayout, Section]:
    """Return the rows of the half section; a mesh of `copies` cells per triangle must fit the memory."""
    layout, section = _layout(design, options, zone, dim)
    check_count(2.0 * len(layout.points) * copies, dim, options)
    return layout, section


def _layout(design: Design, options: MeshOptions, zone: Zone, dim: int) -> tuple[GridLayout, Section]:
    section = design.section()
    if section is None:
        what, allowed = ("model.domain", "'solid'") if dim == 2 else ("mesh.mesher = 'swept'", "'ftetwild'")
        raise Finger3dError(f"{what}: {design.name} is {lacks_section(design)}; allowed: {allowed}")
    low, high = folded_zone(zone, section.half_length_mm)
    return rows(section, Sizes(options.size_mm, options.base_size_mm, low, high)), section


def _with_parts(mesh: Mesh, section: Section, part: Int) -> Mesh:
    """Return the mesh with the numbers (e,) of its cells' parts, if the section has parts."""
    return replace(mesh, part=part, part_labels=section.part_labels) if section.part_labels else mesh


def _on_curves(mesh: Mesh, curves: tuple[tuple[Arc | Flat, Float], ...]) -> Mesh:
    """Move the nodes in the middle of edges between points of a curve onto it; every vertex (v,) has its parameter."""
    points = mesh.points.copy()
    pairs = mesh.cells[:, mesh.element.edges].reshape(-1, 2)
    middle = mesh.cells[:, mesh.dim + 1 :].ravel()
    for curve, u in curves:
        ends = u[pairs]
        bent = np.isfinite(ends).all(axis=1) & (ends[:, 0] != ends[:, 1])  # edges along z are straight
        points[middle[bent], :2] = curve.at(ends[bent].mean(axis=1))
    points[mesh.facets["symmetry_x"].ravel(), 0] = 0.0
    return replace(mesh, points=points)


def _sweep(grid: GridLayout, triangles: Int, levels: Float) -> Mesh:
    """Sweep triangles (m, 3) through z levels (l + 1,) from 0, three tets a prism, and label the boundary."""
    n, layers = len(grid.points), len(levels) - 1
    points = np.hstack([np.tile(grid.points, (layers + 1, 1)), np.repeat(levels, n)[:, None]])
    # Sorted corners make neighbouring prisms split their common quadrilateral along the same diagonal.
    order = np.argsort(triangles, axis=1)
    a, b, c = np.take_along_axis(triangles, order, axis=1).T
    even = np.isin(order @ [9, 3, 1], [0 * 9 + 1 * 3 + 2, 1 * 9 + 2 * 3 + 0, 2 * 9 + 0 * 3 + 1])[:, None]
    tets = [(a, b, c, c + n), (a, b, c + n, b + n), (a, b + n, c + n, a + n)]
    one = np.vstack([_oriented(np.stack(t, axis=1), even) for t in tets])
    cells = (one[None] + n * np.arange(layers)[:, None, None]).reshape(-1, 4)
    return Mesh(points, cells, _labelled(grid, boundary(cells, 3), n, layers))


def _oriented(tets: Int, even: NDArray[np.bool_]) -> Int:
    """Swap two corners of tets over triangles whose sorted corners run clockwise."""
    return np.where(even, tets, tets[:, [1, 0, 2, 3]])


def _labelled(grid: GridLayout, faces: Int, n: int, layers: int) -> dict[str, Int]:
    """Labels of boundary triangles: by level at the ends, by the section's edge in between."""
    level, node = faces // n, faces % n
    out = {
        "symmetry_z": faces[(level == 0).all(axis=1)],
        "ends": faces[(level == layers).all(axis=1)],
    }
    side = level.min(axis=1) != level.max(axis=1)
    key = node.min(axis=1) * n + node.max(axis=1)
    for label, edges in grid.facets.items():
        keys = edges.min(axis=1) * n + edges.max(axis=1)
        out[label] = faces[side & np.isin(key, keys)]
    return out
