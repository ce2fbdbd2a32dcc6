"""report.html and steps.npz: what they say, what they never hold, what they cost."""

from __future__ import annotations

from pathlib import Path

from tests.commands import loaded


def test_the_page_of_a_section_loads_neither_plotly_nor_vtk(section: Path) -> None:
    program = f"from finger3d.report.press import press_page; press_page({str(section)!r})"
    assert not loaded(program, "plotly", "vtk", "vtkmodules", "pyvista", "matplotlib", "jinja2")
