"""The child process that calls pytetwild, which crashes or hangs on bad input: python -m ... IN.npz OUT.npz"""

from __future__ import annotations

import sys

import numpy as np


def main(source: str, target: str) -> None:
    """Read points, triangles, background and settings; write points (n, 3) and positive tets (m, 4)."""
    import pytetwild

    with np.load(source, allow_pickle=False) as given:
        points, tets = pytetwild.tetrahedralize(
            given["points"],
            given["triangles"].astype(np.int32),
            edge_length_abs=float(given["edge_length"]),
            epsilon=float(given["epsilon"]),
            stop_energy=float(given["stop_energy"]),
            num_threads=1,
            quiet=True,
            vtk_ordering=True,
            bg_vertices=given["bg_points"],
            bg_tets=given["bg_tets"].astype(np.int32),
            bg_values=given["bg_values"],
        )
    np.savez(target, points=np.asarray(points, dtype=np.float64), tets=np.asarray(tets, dtype=np.int64))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
