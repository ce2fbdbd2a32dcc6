"""Starting finger3d loads no CAD kernel and no 3D graphics."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize("words", [[], ["--help"]], ids=["import", "help"])
def test_neither_the_import_nor_the_help_loads_cad_or_3d_graphics(words: list[str]) -> None:
    code = "import sys, finger3d\n"
    code += "from finger3d.cli import main\nassert main(sys.argv[1:]) == 0\n" if words else ""
    code += "loaded = {name.partition('.')[0] for name in sys.modules}\n"
    code += "sys.exit(repr(loaded & {'OCP', 'build123d', 'vtk', 'vtkmodules', 'pyvista'}))"
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=60)
    assert done.stderr.strip() == "set()"
