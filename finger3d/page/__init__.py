"""report.html: one file that tells a result, with nothing fetched from anywhere; and steps.npz behind its 3D view.

`write_page` builds a page from rows, sections and pictures; `press_page` and `compare_page` fill it from a results
folder, so that a page can be made again at any time::

    write_page(folder, "mu from strain", command="calibrate", headline=[Row("resolution of mu", 0.012, "", 0.002)],
               sections=[Section("Fit", ["second order", Table(head, rows)])], figures=[Figure("fit.png", "...")])
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from finger3d.lazy import from_home

if TYPE_CHECKING:
    from finger3d.page.build import Code, Figure, Row, Section, Table, write_page
    from finger3d.page.chart import Chart, Line
    from finger3d.page.design import design_page
    from finger3d.page.press import press_page
    from finger3d.page.results import compare_page
    from finger3d.page.sensor import calibrate_page, sweep_charts, sweep_page
    from finger3d.page.states import States, load_states, write_states
    from finger3d.page.view3d import View3D, view_of

_HOME = {
    "Code": "build",
    "Figure": "build",
    "Row": "build",
    "Section": "build",
    "Table": "build",
    "write_page": "build",
    "Chart": "chart",
    "Line": "chart",
    "design_page": "design",
    "press_page": "press",
    "compare_page": "results",
    "calibrate_page": "sensor",
    "sweep_charts": "sensor",
    "sweep_page": "sensor",
    "States": "states",
    "load_states": "states",
    "write_states": "states",
    "View3D": "view3d",
    "view_of": "view3d",
}

__all__ = [
    "Chart",
    "Code",
    "Figure",
    "Line",
    "Row",
    "Section",
    "States",
    "Table",
    "View3D",
    "calibrate_page",
    "compare_page",
    "design_page",
    "load_states",
    "press_page",
    "sweep_charts",
    "sweep_page",
    "view_of",
    "write_page",
    "write_states",
]

__getattr__ = from_home(__name__, _HOME)  # a page loads what it shows, and no more
