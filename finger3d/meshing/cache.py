"""Unstructured meshes on disk, by a hash of everything that shaped them; fTetWild gives another mesh every time."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import json
import os
import struct
import tempfile
import zipfile
import zlib
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from finger3d.fem.simplex import Mesh
from finger3d.geometry.design import Design
from finger3d.meshing.options import MeshSizes, Zone
from finger3d.meshing.report import content_hash

FORMAT = 1
"""Raise this when meshes made by an older finger3d must not be used any more."""

_PACKAGES = ("pytetwild", "build123d")

# What np.load and Mesh raise for a file that is cut short, no archive, a single array (.npy), or of other arrays.
_DAMAGED = (
    OSError, EOFError, AttributeError, IndexError, KeyError, NotImplementedError, RuntimeError, TypeError, ValueError,
    struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def folder() -> Path:
    """Where meshes are kept: FINGER3D_CACHE, or the user's cache folder."""
    from platformdirs import user_cache_dir

    return Path(os.environ.get("FINGER3D_CACHE") or user_cache_dir("finger3d")) / "meshes"


def key(design: Design, options: MeshSizes, zone: Zone, symmetry: tuple[str, ...]) -> str:
    """SHA-256 of the design (its dimensions and its file), the sizes, the zone, the symmetry, and the versions."""
    try:
        code = hashlib.sha256(Path(inspect.getfile(type(design))).read_bytes()).hexdigest()
    except (OSError, TypeError):  # a design typed at a prompt has no file
        code = ""
    text = json.dumps(
        {
            "format": FORMAT,
            **design.cache_fields,
            "code": code,
            "sizes": [repr(float(options.size_mm)), repr(float(options.base_size_mm))],
            "zone": [repr(float(z)) for z in zone],
            "symmetry": sorted(symmetry),
            "versions": {name: _version(name) for name in _PACKAGES},
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
    """A mesh and the CAD volume (mm3) of the whole body; None if there is none, or the file is damaged."""
    try:
        with np.load(path, allow_pickle=False) as data:
            facets = {name[7:]: data[name] for name in data.files if name.startswith("facets_")}
            mesh = Mesh(data["points"], data["cells"], facets)
            if str(data["hash"]) != _sealed(mesh):
                return None
            return mesh, float(data["cad_volume_mm3"])
    except _DAMAGED:
        return None


def save(path: Path, mesh: Mesh, cad_volume_mm3: float) -> bool:
    """Write a mesh under another name, then rename it, so that nobody reads half a file; False if the disk refuses."""
    arrays: dict[str, Any] = {f"facets_{label}": f for label, f in mesh.facets.items()}
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(suffix=".npz", prefix=".", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            np.savez(
                file,
                points=mesh.points,
                cells=mesh.cells,
                hash=np.array(_sealed(mesh)),
                cad_volume_mm3=np.array(cad_volume_mm3),
                **arrays,
            )
        os.replace(temporary, path)
    except OSError:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        return False
    return True


def _sealed(mesh: Mesh) -> str:
    """A hash over facets too."""
    digest = hashlib.sha256(content_hash(mesh).encode())
    for label in sorted(mesh.facets):
        digest.update(label.encode())
        digest.update(np.ascontiguousarray(mesh.facets[label], dtype=np.int64).tobytes())
    return digest.hexdigest()
