"""Graded unstructured tetrahedra by netgen, the same on every run; several solids share the faces between them.

netgen brings an OpenCASCADE of its own and runs in a child process, which reads the solids from a STEP file.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from finger3d._cost import netgen_limit_s
from finger3d._extras import require
from finger3d._types import Float, Int
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import Design
from finger3d.meshing.limits import checked_tets
from finger3d.meshing.sizing import RATE, MeshOptions, Sizing, Zone, sizing
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

_EDGE_SHARE = 0.88  # netgen's size over the mean edge length; measured 1 / 1.13 to 1 / 1.19 on Fig. 9 and a hemisphere
_CHORD_ERROR = 2e-4  # of the triangles, over the diagonal; nodes are moved onto the surfaces themselves
_MOST_POINTS = 2_000_000  # of the size field


def new_mesh(
    design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...], report: Progress
) -> tuple[Mesh, float, float]:
    """Return the mesh, the volume (mm3) of the whole body, and the seconds spent on CAD."""
    from finger3d.meshing.unstructured.snap import UnusableMeshError

    require('mesh.mesher = "netgen"', "build123d", "netgen", instead='set mesh.mesher = "swept"')
    if design.tessellation() is not None:
        raise Finger3dError(f"{design.name}: mesh.mesher = 'netgen' needs CAD, and this is STL; use 'ftetwild'")
    start = time.perf_counter()
    low, high = box(design, symmetry)
    field = sizing(design, options, zone, low, high)
    checked_tets(design, field, options)
    report.say("building the CAD solid")
    glued = glued_solids(design, symmetry)
    body = tessellated(design, glued, _CHORD_ERROR * float(np.linalg.norm(high - low)))
    check_volume(design, body, symmetry)
    field = finer_in_layers(field, body)
    cells = checked_tets(design, field, options)
    cad_seconds = time.perf_counter() - start
    report.say(f"meshing by netgen, about {cells:.0f} tetrahedra")
    try:
        points, tets = run_child(glued, field, netgen_limit_s(cells))
        return on_cad(points, tets, body, "netgen"), design.volume_mm3, cad_seconds
    except UnusableMeshError as error:  # the same again
        raise Finger3dError(
            f"{design.name}: netgen cannot mesh with size_mm = {options.size_mm:g}: {error}; try other sizes, or "
            "mesher = 'ftetwild'"
        ) from error


def size_points(field: Sizing) -> tuple[Float, Float]:
    """Return points (n, 3), mm, in the box of a size field, as dense as its edge lengths are short, and these (n,)."""
    counts = np.maximum(1, np.ceil((field.high - field.low) / field.base_mm - 1e-9)).astype(int)
    extent = (field.high - field.low) / counts
    middles = [low + (np.arange(n) + 0.5) * e for low, n, e in zip(field.low, counts, extent, strict=True)]
    centre = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, 3)
    octants = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points, sizes = [], []
    total = 0
    while len(centre):
        size = field.at(centre)
        large = extent.max() > size
        points.append(centre[~large])
        sizes.append(size[~large])
        total += len(centre)
        if total > _MOST_POINTS:
            raise Finger3dError(f"mesh.size_mm = {field.size_mm:g} is too small for netgen's size field; choose larger")
        centre = (centre[large, None] + octants * extent).reshape(-1, 3)
        extent = 0.5 * extent
    return np.vstack(points), np.concatenate(sizes)


def run_child(glued: Glued, field: Sizing, limit: float) -> tuple[Float, Int]:
    """Run netgen in a child process; return points (n, 3), mm, and tets (t, 4)."""
    from build123d import Compound, export_step

    with tempfile.TemporaryDirectory(prefix="finger3d_") as folder:
        path = Path(folder) / "body.step"
        export_step(Compound(glued.shape.solids()), path)
        step = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    points, sizes = size_points(field)
    largest, sizes = _EDGE_SHARE * field.base_mm, _EDGE_SHARE * sizes
    return run_mesher(_meshers.netgen, limit, step=step, rate=RATE, largest=largest, points=points, sizes=sizes)
