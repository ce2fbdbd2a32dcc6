"""report.html and steps.npz: what they say, what they never hold, what they cost."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def test_the_page_of_a_section_loads_neither_plotly_nor_vtk(section: Path) -> None:
    code = (
        f"import sys; from finger3d.report.press import press_page; press_page({str(section)!r});"
        "print(sorted({'plotly', 'vtk', 'vtkmodules', 'pyvista', 'matplotlib', 'jinja2'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
