"""Command ``info``: versions, machine and folders."""

from __future__ import annotations

from finger3d.cli.common import app
from finger3d.cli.options import Json
from finger3d.cli.printing import print_json, print_rows

_SOLVERS = {
    "pardiso": "PARDISO of MKL",
    "mumps": "MUMPS",
    "superlu": "SuperLU, dozens of times slower in solids; the extra mkl or mumps brings another",
}


@app.command
def info(*, json_: Json = False) -> None:
    """Print versions, machine and folders, as needed for a bug report.

    Example: finger3d info --json
    """
    import platform
    import sys
    from pathlib import Path

    from finger3d._machine import cores, environment_bytes, memory_bytes, versions
    from finger3d.fem.solvers import condense
    from finger3d.meshing.cache import folder

    memory, isolated = memory_bytes(), sys.prefix != sys.base_prefix
    size = environment_bytes(Path(sys.prefix)) if isolated else None
    if json_:
        machine = {
            "platform": platform.platform(),
            "cores": cores(),
            "memory_bytes": memory[0] if memory else None,
            "mesh_cache": folder(),
            "environment": sys.prefix,
            "environment_bytes": size,
            "factorisation": condense.default_solver(),
        }
        print_json({"versions": versions(), "machine": machine})
        return
    print_rows("versions", versions().items())
    print_rows(
        "machine",
        [
            ("platform", platform.platform()),
            ("cores", cores()),
            ("memory", f"{memory[0] / 1e9:.1f} GB" if memory else "unknown"),
            ("mesh cache", folder()),
            ("environment", f"{sys.prefix}, {size / 1e9:.2f} GB" if size is not None else f"{sys.prefix}, shared"),
            ("factorisation", _SOLVERS[condense.default_solver()]),
        ],
    )
