"""Mesh of a design, by the mesher that the options name; a finger that is a mesh already is not meshed.

Unstructured meshes are kept in a cache, keyed by everything that determines them: those of fTetWild are not
reproducible.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import json
import math
import os
import time
from importlib import metadata
from pathlib import Path

import numpy as np

from finger3d._cost import MAX_TETS
from finger3d._machine import source_hash
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import Design
from finger3d.io import read_arrays, write_arrays
from finger3d.meshing.given import GivenMesh, mesh_given
from finger3d.meshing.limits import MeshReport, check_sizes, is_possible, mesh_report
from finger3d.meshing.sizing import MeshOptions, Zone, count_cells, rounded_zone, sizing
from finger3d.meshing.swept import cell_count, mesh_swept
from finger3d.meshing.unstructured.solids import box
from finger3d.progress import QUIET, Progress

_PACKAGES = {"ftetwild": ("pytetwild", "build123d"), "netgen": ("netgen-mesher", "build123d")}


def mesh_solid(
    design: Design,
    options: MeshOptions,
    zone: Zone,
    symmetry: tuple[str, ...] = (),
    report: Progress = QUIET,
) -> tuple[Mesh, MeshReport]:
    """Mesh a design with quadratic tetrahedra.

    Parameters
    ----------
    design : from geometries/
    options : edge lengths and mesher
    zone : (x_min, x_max, z_min, z_max) mm where contact is predicted
    symmetry : "x", "z": mesh only x >= 0, z >= 0
    report : receives the messages

    Returns
    -------
    mesh : quadratic, facets labelled contact, base, ends, walls, symmetry_x, symmetry_z
    report : size and quality
    """
    if isinstance(design, GivenMesh):
        return mesh_given(design, options, zone)
    if options.mesher == "swept":
        report.say("meshing (swept)")
        return mesh_swept(design, options, zone, symmetry)
    return _mesh_unstructured(design, options, zone, symmetry, report)


def is_meshable(
    design: Design, options: MeshOptions, zone: Zone, dim: int, symmetry: tuple[str, ...] = (), rows: float = 0.0
) -> bool:
    """Return whether a mesh of these edge lengths with `rows` of contact is estimated to fit, without making it.

    Parameters
    ----------
    design, options, zone, symmetry : see `mesh_solid`
    dim : 2 for a section
    """
    lengths = np.ptp(np.reshape(zone, (2, 2)), axis=1)[: dim - 1] / options.size_mm
    facets = (dim - 1) * float(lengths.prod()) / 2 ** len(symmetry)
    # each facet of the contact zone has at least one cell; to count all cells takes time
    if not is_possible(facets, dim, rows=rows):
        return False
    if isinstance(design, GivenMesh):
        return True
    if dim == 2 or options.mesher == "swept":
        return is_possible(cell_count(design, options, zone, dim, symmetry), dim, rows=rows)
    zone = rounded_zone(design, options, zone)
    return is_possible(count_cells(design, sizing(design, options, zone, *box(design, symmetry))), 3, MAX_TETS, rows)


def _mesh_unstructured(
    design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...], report: Progress
) -> tuple[Mesh, MeshReport]:
    """Mesh a design by fTetWild or netgen, or read the mesh from the cache."""
    check_sizes(design, options, 3)
    zone = rounded_zone(design, options, zone)
    path = cache_folder() / f"{cache_key(design, options, zone, symmetry)}.npz"
    multiple = 2.0 ** len(symmetry)
    start = time.perf_counter()
    if (found := load_cached(path)) is not None:
        mesh, volume = found
        report.say(f"mesh from the cache, {path}")
        seconds = {"cad": 0.0, "mesh": time.perf_counter() - start}
        return mesh, mesh_report(mesh, multiple, volume, seconds, from_cache=True, cache_path=str(path))
    name = "netgen" if options.mesher == "netgen" else "tetwild"
    mesher = importlib.import_module(f"finger3d.meshing.unstructured.{name}")
    mesh, volume, cad_seconds = mesher.new_mesh(design, options, zone, symmetry, report)
    stored = save_cached(path, mesh, volume)
    if not stored:
        report.say(f"the mesh could not be kept in {path.parent}; the next run will mesh again")
    seconds = {"cad": cad_seconds, "mesh": time.perf_counter() - start - cad_seconds}
    return mesh, mesh_report(mesh, multiple, volume, seconds, cache_path=str(path) if stored else None)


def cache_folder() -> Path:
    """Return the folder of cached meshes: in FINGER3D_CACHE, or in the user's cache folder."""
    from platformdirs import user_cache_dir

    return Path(os.environ.get("FINGER3D_CACHE") or user_cache_dir("finger3d")) / "meshes"


def cache_key(design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...]) -> str:
    """Return the SHA-256 of the design, all source that draws and meshes it, sizes, zone, symmetry, and versions."""
    try:
        code = hashlib.sha256(Path(inspect.getfile(type(design))).read_bytes()).hexdigest()
    except (OSError, TypeError):  # a design typed at a prompt has no file: its meshes serve this process only
        code = f"{id(type(design))} of {os.getpid()}"
    text = json.dumps(
        {
            **design.cache_fields,
            "code": [code, source_hash("geometry"), source_hash("meshing")],
            "sizes": [repr(float(options.size_mm)), repr(float(options.base_size_mm))],
            "zone": [repr(float(z)) for z in zone],
            "symmetry": sorted(symmetry),
            "versions": {name: _version(name) for name in _PACKAGES[options.mesher]},
        },
        sort_keys=True,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "absent"


def load_cached(path: Path) -> tuple[Mesh, float] | None:
    """Return a mesh and the CAD volume (mm3) of the whole body; None if there is no file, or a damaged one."""
    try:
        arrays = read_arrays(path)
        facets = {name[7:]: array for name, array in arrays.items() if name.startswith("facets_")}
        labels = tuple(str(label) for label in arrays["part_labels"]) if "part" in arrays else ()
        mesh = Mesh(arrays["points"], arrays["cells"], facets, arrays.get("part"), labels)
        volume = float(arrays["cad_volume_mm3"])
        return (mesh, volume) if 0.0 < volume < math.inf else None
    except (OSError, ValueError):
        return None


def save_cached(path: Path, mesh: Mesh, cad_volume_mm3: float) -> bool:
    """Write a mesh whole or not at all; return False if it cannot be written."""
    arrays = {
        "points": mesh.points,
        "cells": mesh.cells,
        "cad_volume_mm3": np.array(cad_volume_mm3),
        **{f"facets_{label}": facets for label, facets in mesh.facets.items()},
    }
    if mesh.part is not None:
        arrays |= {"part": mesh.part, "part_labels": np.array(mesh.part_labels)}
    try:
        write_arrays(path, arrays)
    except Finger3dError:
        return False
    return True
