"""Graded unstructured tetrahedra by pytetwild, with boundary nodes moved onto the CAD surface.

pytetwild crashes or hangs on bad input and does not reproduce its meshes. Its input and output are checked, and it runs
in a child process under a time limit, up to three times.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from finger3d._cost import meshing_limit_s
from finger3d._extras import require
from finger3d._ranges import at_least
from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import Design
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from finger3d.meshing.limits import checked_tets
from finger3d.meshing.sizing import MeshOptions, Sizing, Zone, sizing
from finger3d.meshing.unstructured import _meshers
from finger3d.meshing.unstructured.solids import (
    box,
    check_volume,
    finer_in_layers,
    glued_solids,
    on_cad,
    run_mesher,
    tessellated,
)
from finger3d.progress import Progress

if TYPE_CHECKING:
    from finger3d.geometry.cad import Glued
    from finger3d.geometry.tessellate import Tessellation


STOP_ENERGY = 10.0
ATTEMPTS = 3

_ENVELOPE = (
    2e-4,
    1e-3,
    3e-3,
)  # fTetWild's epsilon over the diagonal: least, default, largest; cost rises steeply below
_ENVELOPE_SHARE = 0.2  # largest envelope over the contact edge length, and chord error of CAD over the envelope
_DECIMATION_SHARE = 0.02  # of the envelope: displacement of an STL surface by the removal of one triangle


def new_mesh(
    design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...], report: Progress
) -> tuple[Mesh, float, float]:
    """Return the mesh, the volume (mm3) of the whole body, and the seconds spent on CAD."""
    from finger3d.meshing.unstructured.snap import UnusableMeshError

    require('mesh.mesher = "ftetwild"', "build123d", "pytetwild", instead='set mesh.mesher = "swept"')
    start = time.perf_counter()
    low, high = box(design, symmetry)
    field = sizing(design, options, zone, low, high)
    if not design.part_labels:
        checked_tets(design, field, options)  # before CAD, which takes seconds
    report.say("building the CAD solid")
    body, epsilon = _body(design, symmetry, field)
    field = finer_in_layers(field, body)
    cells = checked_tets(design, field, options)
    cad_seconds = time.perf_counter() - start
    check_surface(Triangles(body.points, body.surface))
    check_volume(design, body, symmetry)
    report.say(f"meshing, about {cells:.0f} tetrahedra")
    reasons = []
    limit = meshing_limit_s(cells, len(body.triangles))
    for _ in range(ATTEMPTS):
        try:
            points, tets = run_child(body.points, body.triangles, field, epsilon, limit, bool(body.part_labels))
            return on_cad(points, tets, body, "pytetwild"), design.volume_mm3, cad_seconds
        except UnusableMeshError as error:
            reasons.append(str(error))
            report.say(f"this mesh will not do: {error}; meshing again")
    raise Finger3dError(
        f"{design.name}: {ATTEMPTS} attempts to mesh with size_mm = {options.size_mm:g} failed, the last because "
        f"{reasons[-1]}; try other sizes, or mesher = 'swept'"
    )


def _body(design: Design, symmetry: tuple[str, ...], field: Sizing) -> tuple[Tessellation, float]:
    """Return the tessellated part, and fTetWild's envelope over its diagonal."""
    from finger3d.geometry.faceted import coarser
    from finger3d.geometry.tessellate import surface_of

    faceted = design.tessellation()
    glued = None if faceted else glued_solids(design, symmetry)
    surfaces = [f.surface for f in faceted.faces] if faceted else []
    surfaces += [surface_of(f.face) for f in glued.faces] if glued else []
    radius = min(getattr(surface, "radius", math.inf) for surface in surfaces)
    diagonal = float(np.linalg.norm(field.high - field.low))
    # With an envelope below the sagitta of the longest edge a hemisphere takes 20 times as long, with too fine a mesh.
    least, usual, most = _ENVELOPE
    epsilon = max(usual, field.base_mm**2 / (8.0 * radius * diagonal))
    epsilon = max(min(epsilon, most, _ENVELOPE_SHARE * field.size_mm / diagonal), least)
    if faceted:
        return coarser(faceted, _DECIMATION_SHARE * epsilon * diagonal), epsilon
    assert glued is not None
    epsilon = _within_layers(design, glued, epsilon, diagonal) if design.part_labels else epsilon
    return tessellated(design, glued, _ENVELOPE_SHARE * epsilon * diagonal), epsilon


def _within_layers(design: Design, glued: Glued, epsilon: float, diagonal: float) -> float:
    """Return an envelope that is small beside the thickness of every part, or raise a Finger3dError."""
    for number, label in enumerate(glued.labels):
        area = sum(f.face.area for f in glued.faces if number in (f.inside, f.outside))
        thickness = 2.0 * glued.volumes_mm3[number] / area if area else math.inf
        epsilon = min(epsilon, _ENVELOPE_SHARE * thickness / diagonal)
        if epsilon < _ENVELOPE[0]:
            raise Finger3dError(
                f"{design.name}: the part '{label}' is {thickness:.3g} mm thin; mesh.mesher = 'ftetwild' needs at "
                f"least {at_least(_ENVELOPE[0] * diagonal / _ENVELOPE_SHARE, 3)} mm, or mesher = 'swept' or 'netgen'"
            )
    return epsilon


def check_surface(surface: Triangles) -> None:
    """Raise a Finger3dError for a surface on which pytetwild crashes, hangs, or meshes another body."""
    if reason := mistake(surface, may_be_hollow=True) or _unfit(surface):
        raise Finger3dError(f"the finger's surface cannot be meshed: it {reason}; mend the design or the file")


def _unfit(surface: Triangles) -> str:
    """Return what makes the extent of a surface unfit for pytetwild; empty if nothing does."""
    extent = surface.high - surface.low
    if not 1e-2 < surface.size < 1e4:
        return f"has a diagonal of {surface.size:.3g} mm; allowed: 0.01 to 10000"
    if extent.min() <= 1e-3 * extent.max():
        return f"is {extent.min():.3g} mm thin and {extent.max():.3g} mm long; allowed: at most 1:1000"
    if np.linalg.norm(surface.points.mean(axis=0)) > 1e3 * surface.size:
        return "lies farther from the origin than 1000 times its size"
    return ""


def run_child(
    points: Float, triangles: Int, field: Sizing, epsilon: float, limit: float, keep_outside: bool = False
) -> tuple[Float, Int]:
    """Run pytetwild in a child process; `keep_outside` keeps the cells outside the surface, up to a box around it.

    pytetwild finds the inside by winding numbers, which triangles inside the body would make ambiguous.
    """
    bg_vertices, bg_tets, bg_values = field.background()
    return run_mesher(
        _meshers.pytetwild, limit, points=points, triangles=triangles.astype(np.int32),
        edge_length_abs=field.longest_mm, epsilon=epsilon, stop_energy=STOP_ENERGY, disable_filtering=keep_outside,
        bg_vertices=bg_vertices, bg_tets=bg_tets.astype(np.int32), bg_values=bg_values,
    )  # fmt: skip
