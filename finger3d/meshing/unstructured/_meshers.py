"""Calls of the unstructured meshers, which are made in a child process by :mod:`finger3d._child`.

pytetwild crashes or hangs on bad input; netgen brings an OpenCASCADE of its own.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from finger3d._types import Array, Float, Int


def pytetwild(points: Float, triangles: Int, **options: Array) -> Mapping[str, Array]:
    """Return points (n, 3) and positive tets (m, 4) inside a surface, with options of ``pytetwild.tetrahedralize``."""
    import pytetwild

    given = {name: value.item() if value.ndim == 0 else value for name, value in options.items()}
    nodes, tets = pytetwild.tetrahedralize(points, triangles, num_threads=1, quiet=True, vtk_ordering=True, **given)
    return {"points": np.asarray(nodes, dtype=np.float64), "tets": np.asarray(tets, dtype=np.int64)}


def netgen(step: Array, rate: Array, largest: Array, points: Float, sizes: Float) -> Mapping[str, Array]:
    """Return points (n, 3) and positive tets (m, 4) of the solids in a STEP file, with sizes (k,) at points (k, 3)."""
    from netgen.meshing import MeshingParameters, SetMessageImportance
    from netgen.occ import Glue, OCCGeometry

    SetMessageImportance(0)
    with tempfile.TemporaryDirectory(prefix="finger3d_") as folder:
        path = Path(folder) / "body.step"
        path.write_bytes(step.tobytes())
        solids = list(OCCGeometry(str(path)).shape.solids)
    settings = MeshingParameters(maxh=float(largest), grading=float(rate), curvaturesafety=1.0, parallel_meshing=False)
    for (x, y, z), size in zip(points.tolist(), sizes.tolist(), strict=True):
        settings.RestrictH(x, y, z, size)
    mesh = OCCGeometry(Glue(solids)).GenerateMesh(settings)
    cells = mesh.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
    # netgen's tets are negative in VTK's order
    return {"points": np.array(mesh.Coordinates(), dtype=np.float64), "tets": cells[:, [0, 2, 1, 3]]}
