"""Child process that calls netgen, which brings an OpenCASCADE of its own: python -m ... PARENT_PID.

The process reads an .npz from standard input and writes one to standard output. It leaves no files behind. On Linux it
ends with its parent.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from finger3d._machine import end_with


def main() -> None:
    """Read a STEP file, points with edge lengths, and settings; write points (n, 3) and positive tets (m, 4)."""
    # netgen prints to file descriptor 1.
    output = os.dup(1)
    os.dup2(2, 1)
    from netgen.meshing import MeshingParameters, SetMessageImportance
    from netgen.occ import Glue, OCCGeometry

    SetMessageImportance(0)
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as given:
        with tempfile.TemporaryDirectory(prefix="finger3d_") as folder:
            step = Path(folder) / "body.step"
            step.write_bytes(given["step"].tobytes())
            solids = list(OCCGeometry(str(step)).shape.solids)
        settings = MeshingParameters(
            maxh=float(given["largest"]),
            grading=float(given["rate"]),
            curvaturesafety=1.0,
            parallel_meshing=False,
        )
        for (x, y, z), size in zip(given["points"].tolist(), given["sizes"].tolist(), strict=True):
            settings.RestrictH(x, y, z, size)
        mesh = OCCGeometry(Glue(solids)).GenerateMesh(settings)
    points = np.array(mesh.Coordinates(), dtype=np.float64)
    cells = mesh.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
    result = io.BytesIO()
    np.savez(result, points=points, tets=cells[:, [0, 2, 1, 3]])  # netgen's tets are negative in VTK's order
    with os.fdopen(output, "wb") as stream:
        stream.write(result.getbuffer())


if __name__ == "__main__":
    end_with(int(sys.argv[1]))
    main()
