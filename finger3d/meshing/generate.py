"""Mesh of a design, by the mesher that the options name; a finger that is a mesh already is not meshed."""

from __future__ import annotations

from collections.abc import Callable

from finger3d.fem.simplex import Mesh
from finger3d.geometry.design import Design
from finger3d.meshing.given import GivenMesh, mesh_given
from finger3d.meshing.options import MeshSizes, Zone
from finger3d.meshing.report import MeshReport
from finger3d.meshing.swept import mesh_swept


def mesh_solid(
    design: Design,
    options: MeshSizes,
    zone: Zone,
    symmetry: tuple[str, ...] = (),
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Mesh, MeshReport]:
    """Mesh a design with quadratic tetrahedra.

    Parameters
    ----------
    design : from geometries/
    options : edge lengths and mesher
    zone : (x_min, x_max, z_min, z_max) mm where contact is predicted
    symmetry : "x", "z": mesh only x >= 0, z >= 0
    say : called with a line at every stage

    Returns
    -------
    mesh : quadratic, facets labelled contact, base, ends, walls, symmetry_x, symmetry_z
    report : size and quality
    """
    if isinstance(design, GivenMesh):
        return mesh_given(design, options, zone)
    if options.mesher == "swept":
        say("meshing (swept)")
        return mesh_swept(design, options, zone, symmetry)
    from finger3d.meshing.tetwild import mesh_tetwild

    return mesh_tetwild(design, options, zone, symmetry, say)
