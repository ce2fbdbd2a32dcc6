"""Pictures can be read on a page, and their parts do not overlap."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Outcome
from finger3d.mechanics.model import Gauge
from finger3d.mechanics.readings.columns import strain_columns
from finger3d.plotting.calibration import draw as draw_calibration
from finger3d.plotting.calibration import draw_map
from finger3d.plotting.comparison import draw as draw_comparison
from finger3d.plotting.figures import contact_figure, force_figure
from finger3d.plotting.gauges import marks_of
from finger3d.plotting.layout import DPI, sheet
from finger3d.plotting.optimise import draw as draw_search
from finger3d.report.sweep import sweep_charts
from finger3d.report.sweep_figure import draw as draw_sweep
from finger3d.results.comparison import Case
from finger3d.sensor.maps import StrainMap
from tests.pictures import CURVE, MU, MUS, STEPS, finger, finger_picture, pressed

SHOWN = 960  # CSS pixels of the narrowest picture in a page: 60 rem
LEGIBLE = 7  # CSS pixels of an em: below, lower-case letters have less than four pixels

GAUGE = Gauge("g36", 36.0, 40.0)


def contact(path: Path) -> None:
    contact_figure(path, pressed(finger((40, 4, 6)))["table"], MU, half_width_mm=10.0)


def section(path: Path) -> None:
    mesh = finger((20, 4))
    finger_picture(path, mesh, **pressed(mesh), title="9 N", marks=marks_of(mesh, [GAUGE]), thing=np.eye(3)[None])


def solid(path: Path) -> None:
    mesh = finger((20, 4, 3))
    marks = marks_of(mesh, [GAUGE], near=True)
    finger_picture(path, mesh, **pressed(mesh), title="9 N", marks=marks, thing=np.eye(3)[None])


def comparison(path: Path) -> None:
    names = ("force_N_per_mm", "contact_length_mm", "stick_length_mm", "friction_sum_N_per_mm",
             "friction_along_x_N_per_mm", "peak_pressure_MPa", "gauge_g36", "gauge_g40")  # fmt: skip
    x = np.linspace(-20.0, 20.0, 9)
    line = {"x_mm": x, "pressure_MPa": 0.1 - 2e-4 * x**2, "shear_x_MPa": 1e-4 * x}
    cases = [
        Case(
            model,
            20.0,
            2.0,
            "swept",
            Outcome.CONVERGED,
            dict.fromkeys(names, 30.0),
            lines={"z = 0": line},
            strains=[strain_columns(name)[0] for name in ("g36", "g40")],
        )  # fmt: skip
        for model in ("plane strain", "plane stress", "solid")
    ]
    draw_comparison(path, cases, 20.0, "Fig. 9 finger, 20 mm wide")


def calibration(path: Path) -> None:
    draw_calibration(path, CURVE)


def strain_map(path: Path) -> None:
    x, y = np.linspace(-50.0, 50.0, 21), np.linspace(0.0, 50.0, 11)
    strain = 1e-3 * np.random.default_rng(0).random((len(MUS), len(y), len(x), 3))
    draw_map(path, StrainMap(MUS, x, y, 0.0, strain), Gauge("g36", 36.0, 40.0, 0.0, 0.5), CURVE)


def sweep(path: Path) -> None:
    keys = ["friction.mu", "material.nu", "press.depth_mm"]
    rows = [
        {**dict(zip(keys, map(str, (a, b, c)), strict=True)), "outcome": "converged",
         "normal_force_N": str(1000.0 * a * b * c), "gauge_g36": str(1000.0 * a * b * c - 9e3)}
        for a, b, c in product([0.06, 0.25, 1.0], [0.3, 0.45, 0.49], [5.0, 10.0, 15.0])
    ]  # fmt: skip
    draw_sweep(path, sweep_charts(rows, keys, strain_columns("g36")[:1]))


def search(path: Path) -> None:
    places = np.random.default_rng(0).random((30, 3))
    values = [-1000.0 * a if b > 0.2 else np.nan for a, b, _ in places]
    draw_search(path, ["finger.radius_mm", "gauge.g36.x_mm", "gauge.g36.angle_deg"], places, values, places[0], "best")


@pytest.mark.parametrize(
    "draw",
    [
        contact,
        section,
        solid,
        comparison,
        calibration,
        strain_map,
        sweep,
        search,
        lambda path: force_figure(path, STEPS),
    ],
    ids=["contact", "section", "solid", "comparison", "calibration", "map", "sweep", "design", "force"],
)
def test_a_picture_is_legible_on_a_page_and_its_parts_do_not_overlap(
    tmp_path: Path, figures: list[Any], draw: Callable[[Path], object]
) -> None:
    from matplotlib.text import Text

    draw(tmp_path / "p.png")
    (figure,) = figures
    smallest = min(t.get_fontsize() for t in figure.findobj(Text) if t.get_text() and t.get_visible())
    assert smallest / 72.0 * SHOWN / figure.get_figwidth() >= LEGIBLE
    # a tick label may be half outside of its axes, and antialiasing spreads by a pixel
    boxes = [part.get_tightbbox(figure.canvas.get_renderer()).padded(-1.0) for part in (*figure.axes, *figure.legends)]
    for box in boxes:
        assert box.x0 >= -1.0
        assert box.y0 >= -1.0
        assert box.x1 <= figure.bbox.x1 + 1.0
        assert box.y1 <= figure.bbox.y1 + 1.0
    assert not [(a, b) for i, a in enumerate(boxes) for b in boxes[:i] if a.overlaps(b)]


def test_axes_stand_in_equal_cells_below_the_title(tmp_path: Path) -> None:
    made = sheet(6, 3, (2.0, 1.0), (0.2, 0.1, 0.3, 0.1))
    box = made.axes[4].get_position()
    assert (box.x0 * 6.0, box.y0 * 2.0) == pytest.approx((2.2, 0.3))
    assert (box.width * 6.0, box.height * 2.0) == pytest.approx((1.7, 0.6))
    titled = sheet(6, 3, (2.0, 1.0), (0.2, 0.1, 0.3, 0.1), "a title")
    assert titled.figure.get_figheight() > 2.0
    top = titled.axes[0].get_position()
    assert top.y1 * titled.figure.get_figheight() == pytest.approx(1.9)


def test_a_picture_is_written_at_its_size(tmp_path: Path) -> None:
    from PIL import Image

    sheet(2, 2, (3.0, 2.0), (0.5, 0.1, 0.5, 0.1)).save(tmp_path / "ü.png")
    with Image.open(tmp_path / "ü.png") as image:
        assert image.size == (6 * DPI, 2 * DPI)
