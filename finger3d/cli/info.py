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

    from finger3d._machine import cores, memory_bytes, versions
    from finger3d.fem.solvers import condense
    from finger3d.meshing.generate import cache_folder

    memory = memory_bytes()
    machine: dict[str, object] = {
        "platform": platform.platform(),
        "cores": cores(),
        "memory_bytes": memory[0] if memory else None,
        "mesh_cache": cache_folder(),
        "environment": sys.prefix,
        "factorisation": condense.default_solver(),
    }
    if json_:
        print_json({"versions": versions(), "machine": machine})
        return
    machine["memory_bytes"] = f"{memory[0] / 1e9:.1f} GB" if memory else "unknown"
    machine["factorisation"] = _SOLVERS[condense.default_solver()]
    print_rows("versions", versions().items())
    print_rows("machine", [(name.removesuffix("_bytes").replace("_", " "), value) for name, value in machine.items()])
