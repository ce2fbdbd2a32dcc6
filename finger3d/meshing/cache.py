"""Cache of unstructured meshes, keyed by everything that determines them; meshes of fTetWild are not reproducible."""

from __future__ import annotations

import hashlib
import inspect
import json
import math
import os
from importlib import metadata
from pathlib import Path

import numpy as np

from finger3d._machine import source_hash
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import Design
from finger3d.io import read_arrays, write_arrays
from finger3d.meshing.sizing import MeshOptions, Zone

_PACKAGES = {"ftetwild": ("pytetwild", "build123d"), "netgen": ("netgen-mesher", "build123d")}


def folder() -> Path:
    """Return the folder of cached meshes: in FINGER3D_CACHE, or in the user's cache folder."""
    from platformdirs import user_cache_dir

    return Path(os.environ.get("FINGER3D_CACHE") or user_cache_dir("finger3d")) / "meshes"


def key(design: Design, options: MeshOptions, zone: Zone, symmetry: tuple[str, ...]) -> str:
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


def load(path: Path) -> tuple[Mesh, float] | None:
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


def save(path: Path, mesh: Mesh, cad_volume_mm3: float) -> bool:
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
