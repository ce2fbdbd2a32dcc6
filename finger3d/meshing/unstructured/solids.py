"""Common steps of the unstructured meshers: solids and size field before they run, checks and snapping after."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from finger3d._child import ChildError, in_child
from finger3d._types import Array, Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh, curved_volume, signed_volumes
from finger3d.geometry.design import Design
from finger3d.meshing.sizing import Grading, Sizing

if TYPE_CHECKING:
    from finger3d.geometry.cad import Glued
    from finger3d.geometry.tessellate import Tessellation

VOLUME_TOLERANCE = 0.01
"""Relative difference between the volumes of the curved mesh, the tessellation, and the design."""

_CHORD_TOLERANCE = 0.1
"""Likewise for straight cells, whose edges are chords: a ball of radius 5 with edges of 1.5 to 3 mm lacks 5.7 %."""


def box(design: Design, symmetry: tuple[str, ...]) -> tuple[Float, Float]:
    """Return the lowest and the highest corner (3,) of the meshed part's bounding box, mm."""
    high = np.array([design.half_length_mm, design.height_mm, 0.5 * design.width_mm])
    low = np.array([0.0 if "x" in symmetry else -high[0], 0.0, 0.0 if "z" in symmetry else -high[2]])
    return low, high


def glued_solids(design: Design, symmetry: tuple[str, ...]) -> Glued:
    """Return the CAD solids of the meshed part; those of a body of several parts share the faces between them."""
    from finger3d.geometry.cad import OUTSIDE, Glued, GluedFace, cut, cut_part, glue, labelled_faces

    if design.part_labels:
        return glue({label: cut_part(part, symmetry) for label, part in design.solids().items()}, design.name)
    solid = cut(design.solid(), symmetry)
    faces = tuple(GluedFace(face, 0, OUTSIDE) for face in labelled_faces(solid))
    return Glued(solid, ("",), (float(solid.volume),), faces)


def tessellated(design: Design, glued: Glued, tolerance_mm: float) -> Tessellation:
    """Return the triangles of the meshed part, within a tolerance."""
    from finger3d.geometry.tessellate import tessellate_parts, voids_of

    half_width, half_length = 0.5 * design.width_mm, design.half_length_mm
    exact = (0.0, half_width, -half_width, half_length, -half_length, design.height_mm)
    return tessellate_parts(glued, tolerance_mm, exact=exact, voids=voids_of(design.solid(), tolerance_mm))


def check_volume(design: Design, body: Tessellation, symmetry: tuple[str, ...]) -> None:
    """Raise a Finger3dError if the tessellated part does not have the volume that the design states."""
    whole = design.volume_mm3
    if abs(body.volume_mm3 * 2 ** len(symmetry) / whole - 1.0) > VOLUME_TOLERANCE:
        raise Finger3dError(
            f"{design.name}: the solid's volume is not the volume_mm3 it states, {whole:.6g}; mend the design"
        )


def finer_in_layers(field: Sizing, body: Tessellation) -> Sizing:
    """Return the size field with edge lengths at every part that are no longer than the part is thick."""
    from finger3d.meshing.unstructured.snap import points_on, thickness

    if not body.part_labels:
        return field
    points, sizes = [], []
    for number in range(len(body.part_labels) + 1):
        if not len((surface := body.part(number)).faces):
            continue
        limit = thickness(surface)
        places = points_on(surface, limit)
        few = places[field.at(places) > limit]
        points.append(np.abs(few) * [1, 0, 1] + few * [0, 1, 0])  # where a Grading has its points
        sizes.append(np.full(len(few), limit))
    grading = Grading(np.vstack(points), np.concatenate(sizes))
    return replace(field, grading=grading) if len(grading.sizes) else field


def on_cad(points: Float, tets: Int, body: Tessellation, mesher: str) -> Mesh:
    """Return the quadratic mesh on the CAD faces of a body, from the linear tets (t, 4) that a mesher returned.

    Tets outside a body of several parts are left out; of a body of one part the mesher returns none.

    Raises
    ------
    UnusableMeshError
        If the tets do not fill the body or one of its parts, are inverted, or cannot be snapped.
    """
    from finger3d.meshing.unstructured.snap import snap

    part = None
    if body.part_labels:
        points, tets, part = _in_parts(points, tets, body)
    check_tets(points, tets, body.volume_mm3, mesher)
    mesh = snap(points, tets, body, part)
    _check_volumes(mesh, body)
    return mesh


def _in_parts(points: Float, tets: Int, body: Tessellation) -> tuple[Float, Int, Int]:
    """Return the points and tets inside the body, and the part (t,) of each tet."""
    from finger3d.geometry.cad import OUTSIDE
    from finger3d.meshing.unstructured.snap import parts_of

    part = parts_of(points[tets].mean(axis=1), body)
    inside = part != OUTSIDE
    used, compact = np.unique(tets[inside], return_inverse=True)
    return points[used], compact.reshape(-1, 4), part[inside]


def _check_volumes(mesh: Mesh, body: Tessellation) -> None:
    """Raise an UnusableMeshError if the curved cells of a part do not fill its surface."""
    from finger3d.meshing.unstructured.snap import UnusableMeshError

    part = np.zeros(len(mesh.cells), dtype=np.int64) if mesh.part is None else mesh.part
    for number, label in enumerate(("", *body.part_labels)):
        surface = body.part(number)
        in_part = part == number
        wanted = surface.volume if len(surface.faces) else 0.0
        volume = curved_volume(replace(mesh, cells=mesh.cells[in_part], part=None)) if in_part.any() else 0.0
        if not math.isclose(volume, wanted, rel_tol=VOLUME_TOLERANCE):
            raise UnusableMeshError(f"the volume of {label or 'the main body'} is {volume:.6g} mm3, not {wanted:.6g}")


def check_tets(points: Float, tets: Int, volume_mm3: float, mesher: str = "pytetwild") -> None:
    """Raise an UnusableMeshError for no tets, inverted ones, or ones that do not fill the body."""
    from finger3d.meshing.unstructured.snap import UnusableMeshError

    if not len(tets):
        raise UnusableMeshError(f"{mesher} returned no cells")
    volumes = signed_volumes(Mesh(points, tets, {}))
    if not (volumes > 0.0).all():
        raise UnusableMeshError(f"{mesher} returned flat or inverted cells")
    if not math.isclose(float(volumes.sum()), volume_mm3, rel_tol=_CHORD_TOLERANCE):
        raise UnusableMeshError(f"its volume is {volumes.sum():.6g} mm3, the body's {volume_mm3:.6g}")


def run_mesher(mesher: Callable[..., Mapping[str, Array]], limit: float, **arguments: ArrayLike) -> tuple[Float, Int]:
    """Run a mesher in a child process; return points (n, 3), mm, and tets (t, 4).

    Parameters
    ----------
    mesher : a function of :mod:`finger3d.meshing.unstructured._meshers`, named like its package
    limit : seconds
    arguments : of the mesher

    Raises
    ------
    UnusableMeshError
        If the process crashes, or does not end in time.
    """
    from finger3d.meshing.unstructured.snap import UnusableMeshError

    try:
        result = in_child(mesher, limit, **arguments)
    except ChildError as error:
        raise UnusableMeshError(f"{mesher.__name__} {error}") from error
    return result["points"], result["tets"]
