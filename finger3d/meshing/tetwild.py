"""Graded unstructured tetrahedra by pytetwild, with boundary nodes moved onto the CAD surface; meshes are cached.

pytetwild crashes or hangs on bad input and does not reproduce its meshes. Its input and output are checked, and it runs
in a child process under a time limit, up to three times.
"""

from __future__ import annotations

import io
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from finger3d._process import child_environment
from finger3d._ranges import at_least
from finger3d._types import Float, Int
from finger3d.errors import Finger3dError, MissingError
from finger3d.fem.quality import curved_volume
from finger3d.fem.simplex import Mesh, signed_volumes
from finger3d.geometry.design import Design
from finger3d.meshing import cache
from finger3d.meshing.grading import Grading
from finger3d.meshing.limits import MAX_TETS, check_count, check_sizes
from finger3d.meshing.options import MeshSizes, Zone
from finger3d.meshing.report import MeshReport, report
from finger3d.meshing.sizing import Sizing, forecast, rounded_zone, sizing

if TYPE_CHECKING:
    from finger3d.geometry.parts import Glued
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
_VOLUME_TOLERANCE = 0.01  # relative difference between the volumes of mesh, tessellation and design


def mesh_tetwild(
    design: Design,
    options: MeshSizes,
    zone: Zone,
    symmetry: tuple[str, ...] = (),
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Mesh, MeshReport]:
    """Mesh a design with quadratic tetrahedra, or read the mesh from the cache; see `finger3d.meshing.generate`."""
    check_sizes(design, options, 3)
    zone = rounded_zone(design, options, zone)
    path = cache.folder() / f"{cache.key(design, options, zone, symmetry)}.npz"
    multiple = 2.0 ** len(symmetry)
    start = time.perf_counter()
    if (found := cache.load(path)) is not None:
        mesh, volume = found
        say(f"mesh from the cache, {path}")
        seconds = {"cad": 0.0, "mesh": time.perf_counter() - start}
        return mesh, report(mesh, multiple, volume, seconds, from_cache=True, cache_path=str(path))
    mesh, volume, cad_seconds = new_mesh(design, options, zone, symmetry, say)
    stored = cache.save(path, mesh, volume)
    if not stored:
        say(f"the mesh could not be kept in {path.parent}; the next run will mesh again")
    seconds = {"cad": cad_seconds, "mesh": time.perf_counter() - start - cad_seconds}
    return mesh, report(mesh, multiple, volume, seconds, cache_path=str(path) if stored else None)


def new_mesh(
    design: Design, options: MeshSizes, zone: Zone, symmetry: tuple[str, ...], say: Callable[[str], None]
) -> tuple[Mesh, float, float]:
    """Return the mesh, the volume (mm3) of the whole body, and the seconds spent on CAD."""
    from finger3d.meshing.snap import UnusableMeshError, snap

    if find_spec("pytetwild") is None:
        raise MissingError("mesh.mesher = 'ftetwild' needs the package pytetwild; install it, or use mesher = 'swept'")
    start = time.perf_counter()
    low, high = box(design, symmetry)
    field = sizing(design, options, zone, low, high)
    cells = forecast(design, field)
    check_count(cells, 3, options, MAX_TETS)
    say("building the CAD solid")
    body, epsilon = _body(design, symmetry, field)
    if body.part_labels:
        field = _finer_in_layers(field, body)
        cells = forecast(design, field)
        check_count(cells, 3, options, MAX_TETS)
    cad_seconds = time.perf_counter() - start
    check_surface(body.points, body.surface)
    whole = design.volume_mm3
    if abs(body.volume_mm3 * 2 ** len(symmetry) / whole - 1.0) > _VOLUME_TOLERANCE:
        raise Finger3dError(
            f"{design.name}: the solid's volume is not the volume_mm3 it states, {whole:.6g}; mend the design"
        )
    say(f"meshing, about {cells:.0f} tetrahedra")
    reasons = []
    limit = _limit_seconds(cells, len(body.triangles))
    for _ in range(ATTEMPTS):
        try:
            points, tets = run_child(body.points, body.triangles, field, epsilon, limit, bool(body.part_labels))
            part = None
            if body.part_labels:
                points, tets, part = _in_parts(points, tets, body)
            check_tets(points, tets, body.volume_mm3)
            mesh = snap(points, tets, body, part)
            check_part_volumes(mesh, body)
            return mesh, whole, cad_seconds
        except UnusableMeshError as error:
            reasons.append(str(error))
            say(f"this mesh will not do: {error}; meshing again")
    raise Finger3dError(
        f"{design.name}: {ATTEMPTS} attempts to mesh with size_mm = {options.size_mm:g} failed, the last because "
        f"{reasons[-1]}; try other sizes, or mesher = 'swept'"
    )


def box(design: Design, symmetry: tuple[str, ...]) -> tuple[Float, Float]:
    """Return the lowest and the highest corner (3,) of the meshed part's bounding box, mm."""
    high = np.array([design.half_length_mm, design.height_mm, 0.5 * design.width_mm])
    low = np.array([0.0 if "x" in symmetry else -high[0], 0.0, 0.0 if "z" in symmetry else -high[2]])
    return low, high


def _body(design: Design, symmetry: tuple[str, ...], field: Sizing) -> tuple[Tessellation, float]:
    """Return the tessellated part, and fTetWild's envelope over its diagonal."""
    from finger3d.geometry.cad import cut, cut_part, labelled_faces
    from finger3d.geometry.faceted import coarser
    from finger3d.geometry.implicit import surface_of
    from finger3d.geometry.parts import glue
    from finger3d.geometry.tessellate import tessellate, tessellate_parts, voids_of

    faceted = design.tessellation()
    glued = solid = None
    if faceted:
        surfaces = [f.surface for f in faceted.faces]
    elif design.part_labels:
        glued = glue({label: cut_part(part, symmetry) for label, part in design.solids().items()}, design.name)
        surfaces = [surface_of(f.face) for f in glued.faces]
    else:
        solid = cut(design.solid(), symmetry)
        surfaces = [surface_of(f) for f in labelled_faces(solid)]
    radius = min(getattr(surface, "radius", math.inf) for surface in surfaces)
    diagonal = float(np.linalg.norm(field.high - field.low))
    # With an envelope below the sagitta of the longest edge a hemisphere takes 20 times as long and gets too fine.
    least, usual, most = _ENVELOPE
    epsilon = min(
        max(usual, field.base_mm**2 / (8.0 * radius * diagonal)), most, _ENVELOPE_SHARE * field.size_mm / diagonal
    )
    epsilon = max(epsilon, least)
    if glued:
        epsilon = _within_layers(design, glued, epsilon, diagonal)
    if faceted:
        return coarser(faceted, _DECIMATION_SHARE * epsilon * diagonal), epsilon
    half_width, half_length = 0.5 * design.width_mm, design.half_length_mm
    exact = (0.0, half_width, -half_width, half_length, -half_length, design.height_mm)
    tolerance = _ENVELOPE_SHARE * epsilon * diagonal
    voids = voids_of(design.solid(), tolerance)
    if glued:
        return tessellate_parts(glued, tolerance, exact=exact, voids=voids), epsilon
    return tessellate(solid, tolerance, exact=exact, voids=voids), epsilon


def _within_layers(design: Design, glued: Glued, epsilon: float, diagonal: float) -> float:
    """Return an envelope that is small beside the thickness of every part, or raise a Finger3dError."""
    for number, label in enumerate(glued.labels):
        area = sum(f.face.area for f in glued.faces if number in (f.inside, f.outside))
        thickness = 2.0 * glued.volumes_mm3[number] / area if area else math.inf
        epsilon = min(epsilon, _ENVELOPE_SHARE * thickness / diagonal)
        if epsilon < _ENVELOPE[0]:
            raise Finger3dError(
                f"{design.name}: the part '{label}' is {thickness:.3g} mm thin; mesh.mesher = 'ftetwild' needs at "
                f"least {at_least(_ENVELOPE[0] * diagonal / _ENVELOPE_SHARE, 3)} mm, or mesher = 'swept'"
            )
    return epsilon


def _finer_in_layers(field: Sizing, body: Tessellation) -> Sizing:
    """Return the size field with edge lengths at every part that are no longer than the part is thick."""
    from finger3d.meshing.interfaces import points_on, thickness

    points, sizes = [np.zeros((0, 3))], [np.zeros(0)]
    for number in range(len(body.part_labels) + 1):
        if not len((surface := body.part(number)).faces):
            continue
        limit = thickness(surface)
        places = points_on(surface, limit)
        few = places[field.at(places) > limit]
        points.append(np.abs(few) * [1, 0, 1] + few * [0, 1, 0])  # where a Grading has its points
        sizes.append(np.full(len(few), limit))
    known = field.grading or Grading(points[0], sizes[0])
    grading = Grading(np.vstack([known.points, *points]), np.concatenate([known.sizes, *sizes]))
    return replace(field, grading=grading) if len(grading.sizes) else field


def _in_parts(points: Float, tets: Int, body: Tessellation) -> tuple[Float, Int, Int]:
    """Return the points and tets inside the body, and the part (t,) of each tet."""
    from finger3d.geometry.parts import OUTSIDE
    from finger3d.meshing.interfaces import parts_of

    part = parts_of(points[tets].mean(axis=1), body)
    inside = part != OUTSIDE
    used, compact = np.unique(tets[inside], return_inverse=True)
    return points[used], compact.reshape(-1, 4), part[inside]


def check_part_volumes(mesh: Mesh, body: Tessellation) -> None:
    """Raise an UnusableMeshError if a part's cells do not fill its surface."""
    from finger3d.meshing.snap import UnusableMeshError

    if mesh.part is None:
        return
    for number, label in enumerate(("", *body.part_labels)):
        wanted = body.part(number).volume if (mesh.part == number).any() else 0.0
        found = curved_volume(replace(mesh, cells=mesh.cells[mesh.part == number], part=None)) if wanted else 0.0
        if not math.isclose(found, wanted, rel_tol=_VOLUME_TOLERANCE):
            raise UnusableMeshError(f"the volume of part '{label}' is {found:.6g} mm3, not {wanted:.6g}")


def check_surface(points: Float, triangles: Int) -> None:
    """Raise a Finger3dError for a surface on which pytetwild crashes, hangs, or meshes another body."""
    reason = surface_defect(points, triangles)
    if reason:
        raise Finger3dError(f"the finger's surface cannot be meshed: {reason}; mend the design or the file")


def surface_defect(points: Float, triangles: Int) -> str:
    """Return what makes a surface unfit for pytetwild; empty if nothing does."""
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) < 4:
        return f"it needs (n, 3) points and at least 4 triangles (m, 3), and has {points.shape} and {triangles.shape}"
    if not np.isfinite(points).all():
        return "a point is not finite"
    if triangles.min() < 0 or triangles.max() >= len(points):
        return "a triangle names a point that does not exist"
    low, high = points.min(axis=0), points.max(axis=0)
    extent = high - low
    diagonal = float(np.linalg.norm(extent))
    if not 1e-2 < diagonal < 1e4:
        return f"its diagonal is {diagonal:.3g} mm; allowed: 0.01 to 10000"
    if extent.min() <= 1e-3 * extent.max():
        return f"it is {extent.min():.3g} mm thin and {extent.max():.3g} mm long; allowed: at most 1:1000"
    if np.linalg.norm(points.mean(axis=0)) > 1e3 * diagonal:
        return "it lies farther from the origin than 1000 times its size"
    import trimesh

    surface = trimesh.Trimesh(points, triangles, process=False)
    if not surface.is_watertight:
        return "it is not closed"
    if not surface.is_winding_consistent or not surface.volume > 0.0:
        return "its triangles do not all face outward"
    return ""


def _limit_seconds(cells: float, triangles: int) -> float:
    """Return five times the duration measured on a loaded machine of two cores.

    With a coarse surface: 6 s for 4 700 tets, 149 s for 219 000. With few tets: 27 s for 5 500
    triangles, 197 s for 34 000.
    """
    return 5.0 * (10.0 + 8e-4 * cells + 5e-3 * triangles)


def run_child(
    points: Float, triangles: Int, field: Sizing, epsilon: float, limit: float, keep_outside: bool = False
) -> tuple[Float, Int]:
    """Run pytetwild in a child process; `keep_outside` keeps the cells outside the surface, up to a box around it.

    With triangles inside the body pytetwild could not tell inside and outside, which it does by winding numbers.
    """
    from finger3d.meshing.snap import UnusableMeshError

    extent = np.ptp(points, axis=0)
    bg_points, bg_tets, bg_values = field.background()
    given = io.BytesIO()
    np.savez(
        given,
        points=points,
        triangles=triangles,
        edge_length=min(field.base_mm, float(extent.min())),  # an edge longer than the body hangs it
        epsilon=epsilon,
        stop_energy=STOP_ENERGY,
        keep_outside=keep_outside,
        bg_points=bg_points,
        bg_tets=bg_tets,
        bg_values=bg_values,
    )
    command = [sys.executable, "-P", "-m", "finger3d.meshing._tetwild_child", str(os.getpid())]
    try:
        done = subprocess.run(
            command, env=child_environment(), input=given.getbuffer(), timeout=limit, capture_output=True, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise UnusableMeshError(f"pytetwild did not finish within {limit:.0f} s") from error
    if done.returncode != 0:
        said = (done.stderr.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        raise UnusableMeshError(f"pytetwild crashed (return code {done.returncode}): {said}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as result:
        return result["points"], result["tets"]


def check_tets(points: Float, tets: Int, volume_mm3: float) -> None:
    """Raise an UnusableMeshError for no tets, inverted ones, or ones that do not fill the body."""
    from finger3d.meshing.snap import UnusableMeshError

    if not len(tets):
        raise UnusableMeshError("pytetwild returned no cells")
    volumes = signed_volumes(Mesh(points, tets, {}))
    if not (volumes > 0.0).all():
        raise UnusableMeshError("pytetwild returned flat or inverted cells")
    if not math.isclose(float(volumes.sum()), volume_mm3, rel_tol=_VOLUME_TOLERANCE):
        raise UnusableMeshError(f"its volume is {volumes.sum():.6g} mm3, the body's {volume_mm3:.6g}")
