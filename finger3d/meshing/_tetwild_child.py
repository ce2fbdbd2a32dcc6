"""Child process that calls pytetwild, which crashes or hangs on bad input: python -m ... PARENT_PID.

The process reads an .npz from standard input and writes one to standard output. It leaves no files behind. On Linux it
ends with its parent.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
from contextlib import suppress

import numpy as np

from finger3d._machine import end_with


def main() -> None:
    """Read points, triangles, background mesh and settings; write points (n, 3) and positive tets (m, 4)."""
    # pytetwild prints to file descriptor 1.
    output = os.dup(1)
    os.dup2(2, 1)
    import pytetwild

    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as given:
        _leave_no_files()
        points, tets = pytetwild.tetrahedralize(
            given["points"],
            given["triangles"].astype(np.int32),
            edge_length_abs=float(given["edge_length"]),
            epsilon=float(given["epsilon"]),
            stop_energy=float(given["stop_energy"]),
            num_threads=1,
            quiet=True,
            vtk_ordering=True,
            disable_filtering=bool(given["keep_outside"]),
            bg_vertices=given["bg_points"],
            bg_tets=given["bg_tets"].astype(np.int32),
            bg_values=given["bg_values"],
        )
    result = io.BytesIO()
    np.savez(result, points=np.asarray(points, dtype=np.float64), tets=np.asarray(tets, dtype=np.int64))
    with os.fdopen(output, "wb") as stream:
        stream.write(result.getbuffer())


def _leave_no_files() -> None:
    """Enter a removed folder, so that pytetwild cannot write files into the working folder."""
    folder = tempfile.mkdtemp(prefix="finger3d_")
    os.chdir(folder)
    with suppress(PermissionError):  # Windows does not remove the working folder of a process
        os.rmdir(folder)


if __name__ == "__main__":
    end_with(int(sys.argv[1]))
    main()
