"""Figures of curves: layout, presses, calibrations, comparisons, costs, fits, searches and sensitivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.errors import Outcome
from finger3d.fem.mesh import CONTACT, FREE_FACES, Mesh
from finger3d.mechanics.model import Gauge
from finger3d.mechanics.readings import strain_columns
from finger3d.plotting import solid as render
from finger3d.plotting.analyses import GaugeMap, Panel, draw_calibration, draw_comparison, draw_places
from finger3d.plotting.analyses import draw_identification as draw_fit
from finger3d.plotting.analyses import draw_optimisation as draw_search
from finger3d.plotting.figures import (
    contact_figure,
    force_figure,
    map_figure,
    marker_figure,
    zones,
)
from finger3d.plotting.gauges import marks_of
from finger3d.report.analyses import draw as draw_sweep
from finger3d.report.analyses import sweep_charts
from finger3d.results.summary import Case
from tests.commands import loaded
from tests.comparison_cases import case
from tests.designs import FIG9
from tests.pictures import CURVE, MU, STEPS, finger, finger_picture, pixels, pressed, share, solid_finger
from tests.sensor_cases import curve, line, together, tolerance

pytestmark = pytest.mark.usefixtures("fresh_renderer")

# --- pictures can be read on a page, and their parts do not overlap --------------------------------------------------


SHOWN = 960  # CSS pixels of the narrowest picture in a page: 60 rem
LEGIBLE = 7  # CSS pixels of an em: below, lower-case letters have less than four pixels

GAUGE = Gauge("g36", 36.0, 40.0)


def contact(path: Path) -> None:
    contact_figure(path, pressed(finger((40, 4, 6)))["table"], MU, half_width_mm=10.0)


def section(path: Path) -> None:
    mesh = finger((20, 4))
    finger_picture(path, mesh, **pressed(mesh), title="9 N", marks=marks_of(mesh, [GAUGE]), thing=np.eye(3)[None])


def solid_picture(path: Path) -> None:
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
    draw_search(path, ["finger.radius_mm", "gauge.g36.x_mm", "gauge.g36.angle_deg"], places, values, places[0])


@pytest.mark.parametrize(
    "draw",
    [
        contact,
        section,
        solid_picture,
        comparison,
        calibration,
        sweep,
        search,
        lambda path: force_figure(path, STEPS),
    ],
    ids=["contact", "section", "solid", "comparison", "calibration", "sweep", "design", "force"],
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


# --- pictures are drawn, show what they should, and survive a machine without OpenGL ---------------------------------


@pytest.fixture(scope="module")
def solid() -> tuple[Mesh, dict[str, Any]]:
    return solid_finger()


def test_a_section_is_drawn_without_vtk(tmp_path: Path) -> None:
    mesh = finger((50, 10))
    finger_picture(tmp_path / "f.png", mesh, **pressed(mesh), title="Fig. 9, plane strain")
    assert pixels(tmp_path / "f.png").std() > 0.1
    assert share(tmp_path / "f.png", render.COLOURS[STICK]) > 1e-3
    assert share(tmp_path / "f.png", render.COLOURS[SLIP]) > 1e-3


def test_what_draws_loads_neither_the_solver_nor_a_renderer() -> None:
    heavy = ("matplotlib", "vtkmodules", "scipy", "finger3d.mechanics.march")
    assert not loaded("import finger3d.plotting.figures, finger3d.plotting.deformed", *heavy)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_finger_that_does_not_touch_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dim: int) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh = finger((10, 4, 3)[:dim])
    result = pressed(mesh)
    count = len(result["contact_nodes"])
    none = {name: np.zeros(count) for name in ("pressure_MPa", "shear_x_MPa", "shear_z_MPa")}
    table = {**result["table"], **none, "status": ["open"] * count}
    result |= {"displacement": np.zeros_like(mesh.points), "table": table}
    finger_picture(tmp_path / "f.png", mesh, **result)
    assert pixels(tmp_path / "f.png").std() > 0.05
    assert share(tmp_path / "f.png", render.COLOURS[STICK]) < 5e-3  # the legend's patch only


def test_zones_meet_between_points_of_different_status() -> None:
    x = np.array([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
    status = np.array([OPEN, SLIP, STICK, STICK, SLIP, OPEN])
    assert zones(x, status) == [
        (-2.0, -1.5, OPEN),
        (-1.5, -0.5, SLIP),
        (-0.5, 1.5, STICK),
        (1.5, 2.5, SLIP),
        (2.5, 3.0, OPEN),
    ]
    assert zones(x[:1], status[:1]) == [(-2.0, -2.0, OPEN)]
    assert zones(x[:0], status[:0]) == []


@pytest.mark.parametrize("dim", [2, 3])
def test_contact_forces_are_drawn_with_their_zones(tmp_path: Path, dim: int) -> None:
    mesh = finger((40, 4, 6)[:dim])
    half_width = 10.0 if dim == 3 else None
    contact_figure(tmp_path / "c.png", pressed(mesh)["table"], MU, half_width_mm=half_width)
    assert share(tmp_path / "c.png", "#c9d9ee", within=0.02) > 0.05
    assert share(tmp_path / "c.png", "#fde3c4", within=0.02) > 0.05
    # The end line z = width/2 is a second panel below the middle one.
    ratio = pixels(tmp_path / "c.png").shape[0] / pixels(tmp_path / "c.png").shape[1]
    assert (ratio > 0.8) == (dim == 3)


def test_a_huge_mu_does_not_flatten_the_contact_forces(tmp_path: Path) -> None:
    mesh = finger((40, 4))
    pictures = []
    for mu in (2.0, 1e6):
        contact_figure(tmp_path / f"{mu}.png", pressed(mesh)["table"], mu)
        pictures.append(pixels(tmp_path / f"{mu}.png"))
    # The red curve of f_t is as tall in both.
    tall = [
        np.ptp(np.flatnonzero(np.any(np.abs(p - [0.753, 0.224, 0.169]).max(axis=2) < 0.05, axis=1))) for p in pictures
    ]
    assert tall[1] == pytest.approx(tall[0], rel=0.1)
    assert tall[0] > 50


def test_forces_are_drawn_against_the_slides_that_there_are(tmp_path: Path) -> None:
    slid = [{**step, "slide_x_mm": 0.1 * k, "slide_z_mm": 0.0, "tangential_force_z_N": 1e-12 * k}
            for k, step in enumerate(STEPS)]  # fmt: skip
    force_figure(tmp_path / "slid.png", slid)
    force_figure(tmp_path / "pressed.png", STEPS)
    high, low = (pixels(tmp_path / name).shape[0] for name in ("slid.png", "pressed.png"))
    assert high == 2 * low
    assert share(tmp_path / "slid.png", "#3c8d4f", within=0.05) == 0.0  # round-off along z


def table(moved: np.ndarray) -> dict[str, np.ndarray]:
    """Three markers on a line along x after two increments; `moved` (3, 3) at the end."""
    at = np.array([[-10.0, 5.0, 0.0], [0.0, 5.0, 0.0], [10.0, 5.0, 0.0]])
    columns = {"step": np.array([1, 1, 1, 2, 2, 2]), "depth_mm": np.array([1.0] * 3 + [2.0] * 3)}
    columns |= {f"{a}_mm": np.tile(at[:, k], 2) for k, a in enumerate("xyz")}
    both = np.vstack([0.5 * moved, moved])
    return columns | {f"displacement_{a}_mm": both[:, k] for k, a in enumerate("xyz")}


@pytest.mark.parametrize(("longest", "factor"), [(0.011, 200.0), (10.0, 0.2)])
def test_arrows_are_magnified_by_a_round_number_to_a_visible_length(
    longest: float, factor: float, tmp_path: Path, figures: list[Any]
) -> None:
    moved = np.array([[longest, -0.4, 0.0], [0.0, -0.6, 0.0], [-0.5 * longest, -0.4, 0.0]])
    moved[:, 1] *= longest
    marker_figure(tmp_path / "a.png", table(moved))
    axes = figures[0].axes[0]
    assert f"drawn {factor:g} times" in axes.get_title()
    assert "2 mm" in axes.get_title()
    arrows = axes.collections[0]
    assert arrows.U == pytest.approx(factor * moved[:, 0])
    assert np.asarray(arrows.get_array()) == pytest.approx(moved[:, 1])
    # at most 12 percent of the 20 mm that the markers extend over
    assert np.hypot(arrows.U, arrows.V).max() <= 2.4 * (1.0 + 1e-9)


def test_a_solid_is_seen_along_the_press_axis(tmp_path: Path, figures: list[Any]) -> None:
    marker_figure(tmp_path / "a.png", table(np.array([[0.1, -0.4, 0.2]] * 3)))
    assert figures[0].axes[0].get_ylabel() == "z (mm)"


# --- calibration.png and map.png of a calibration --------------------------------------------------------------------


def test_the_picture_shows_what_was_pressed_its_interpolation_and_all_causes(
    tmp_path: Path, figures: list[Any]
) -> None:
    draw_calibration(tmp_path / "a.png", replace(CURVE, failed=((0.7, "no convergence"),)))
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = [np.asarray(line.get_ydata()) for line in left.get_lines()]
    g36 = CURVE["g36"]
    assert pytest.approx(g36.reading, rel=1e-12) in drawn
    assert pytest.approx(g36.at(CURVE.grid)) in drawn
    assert [0.7, 0.7] in [[*line.get_xdata()] for line in left.get_lines()]  # where a press failed
    assert middle.get_yscale() == "log"
    assert {line.get_label() for line in middle.get_lines()} == {"with all tolerances", "noise alone", "limit 0.1"}
    names = [text.get_text().split(" ")[0] for text in right.get_legend().get_texts()]
    assert set(names) == {t.name for t in g36.tolerances}  # the noise makes less than a percent


def test_the_picture_shows_each_reading_alone_and_all_together(tmp_path: Path, figures: list[Any]) -> None:
    shared = (tolerance("depth_mm", 0.1, 1e-3),)
    joint = together(curve(line(1.0), tolerances=shared), curve(line(-2.0), tolerances=shared))
    draw_calibration(tmp_path / "a.png", joint)
    ((left, middle, right),) = (figure.axes for figure in figures)
    drawn = {one.get_label(): np.asarray(one.get_ydata()) for one in middle.get_lines()}
    together_sd = drawn["with all tolerances"]
    assert together_sd == pytest.approx([found.std for found in joint.judged], nan_ok=True)
    known = np.isfinite(drawn["a alone"]) & np.isfinite(drawn["b alone"])
    assert known.sum() > 50
    assert (together_sd <= np.minimum(drawn["a alone"], drawn["b alone"]) * 1.01)[known].all()
    # each begins at zero, in units of its own error
    first = [one.get_ydata()[0] for one in left.get_lines() if one.get_label() in ("a", "b")]
    assert first == pytest.approx([0.0, 0.0], abs=1e-9)
    names = [text.get_text() for text in right.get_legend().get_texts()]
    assert any(name.startswith("depth_mm ± 0.1") for name in names)


@pytest.mark.filterwarnings("error::UserWarning")
def test_a_reading_that_never_tells_mu_is_drawn_as_well(tmp_path: Path, figures: list[Any]) -> None:
    draw_calibration(tmp_path / "a.png", curve(lambda mu: 0.03 + 0.0 * mu))
    ((_, middle, right),) = (figure.axes for figure in figures)
    assert [one.get_label() for one in middle.get_lines() if np.isfinite(one.get_ydata()).any()] == ["limit 0.1"]
    assert right.get_legend() is None


# --- compare.png -----------------------------------------------------------------------------------------------------


LINE = {"x_mm": [-1.0, 1.0], "pressure_MPa": [0.1, 0.2], "shear_x_MPa": [0.01, -0.01]}


def test_forces_of_solids_are_shown_against_their_width_and_the_rest_relative_to_the_solid(
    tmp_path: Path, figures: list[Any]
) -> None:
    cases = [case("solid", width, force, 0.1) for width, force in ((10.0, 2.0), (20.0, 3.0), (40.0, 3.5))]
    cases += [case("plane strain", 20.0, 3.6, 0.05), case("plane stress", 20.0, 2.4, 0.05)]
    cases = [replace(one, lines={"z = 0": LINE}) for one in cases]
    draw_comparison(tmp_path / "a.png", cases, 20.0, "a title")
    (figure,) = figures
    forces, bars, pressure, shear = figure.axes
    (points,) = (one for one in forces.get_lines() if len(one.get_xdata()) == 3 and one.get_linestyle() == "-")
    assert [*points.get_xdata()] == [10.0, 20.0, 40.0]
    assert [*points.get_ydata()] == [2.0, 3.0, 3.5]
    assert forces.get_xscale() == "log"
    heights = np.array([bar.get_height() for bar in bars.patches]).reshape(3, -1)  # solid, plane strain, plane stress
    assert heights[:, 0] == pytest.approx([1.0, 1.2, 0.8])
    assert heights[:, 1:] == pytest.approx(np.ones_like(heights[:, 1:]))
    assert "a title" in figure.get_suptitle()
    for axes, key in ((pressure, "pressure_MPa"), (shear, "shear_x_MPa")):
        drawn = [one for one in axes.get_lines() if one.get_marker() == "."]
        assert [[*one.get_ydata()] for one in drawn] == [LINE[key]] * 3


# --- identify.png ----------------------------------------------------------------------------------------------------


def test_residuals_are_shown_in_standard_deviations(tmp_path: Path, figures: list[Any]) -> None:
    at, curve_at = np.array([0.2, 0.5, 0.9]), np.linspace(0.0, 1.0, 5)
    measured = 3.0 * at + [0.1, -0.2, 0.0]
    panels = [
        Panel("normal_force_N", measured, np.full(3, 0.1), 3.0 * at, 3.0 * curve_at, "depth_mm", at, curve_at),
        Panel("gauge_g", -at, np.full(3, 0.02), -at, -curve_at, "depth_mm", at, curve_at),
        Panel("stress_MPa", at, np.full(3, 0.1), at - 0.1, curve_at, "stretch", 1.0 + at, 1.0 + curve_at),
    ]
    draw_fit(tmp_path / "a.png", panels)
    (figure,) = figures
    force, gauge, _, last, of_tests = figure.axes[:5]
    assert (force.get_ylabel(), gauge.get_ylabel()) == ("normal_force_N", "gauge_g")
    assert (last.get_xlabel(), of_tests.get_xlabel()) == ("depth_mm", "stretch")
    assert of_tests.get_lines()[0].get_ydata() == pytest.approx(np.ones(3))
    simulated = next(one for one in force.get_lines() if one.get_label() == "simulated")
    assert simulated.get_ydata() == pytest.approx(3.0 * simulated.get_xdata())
    residuals = {one.get_label(): one.get_ydata() for one in last.get_lines()}
    assert residuals["normal_force_N"] == pytest.approx([1.0, -2.0, 0.0], abs=1e-9)
    assert residuals["gauge_g"] == pytest.approx(np.zeros(3), abs=1e-12)


# --- design.png, and map.png of several gauges -----------------------------------------------------------------------


def test_the_best_so_far_never_falls_and_failed_designs_are_left_out(tmp_path: Path, figures: list[Any]) -> None:
    places, values = [[1.0], [2.0], [3.0], [4.0]], [5.0, float("nan"), 7.0, 6.0]
    draw_search(tmp_path / "a.png", ["gauge.g.x_mm"], places, values, places[0])
    convergence, key = figures[0].axes[:2]
    designs, best = convergence.get_lines()
    assert [*designs.get_xdata()] == [1, 3, 4]
    assert [*best.get_ydata()] == [5.0, 7.0, 7.0]
    at = {one.get_label(): np.ravel(one.get_xydata()) for one in key.get_lines()}
    assert [*at["best"]] == [3.0, 7.0]
    assert [*at["start"]] == [1.0, 5.0]
    assert key.get_xlabel() == "gauge.g.x_mm"
    assert convergence.get_ylabel() == "sensitivity"


@pytest.mark.parametrize("count", [1, 3])
def test_a_map_for_each_gauge_and_the_standard_deviations(count: int, tmp_path: Path, figures: list[Any]) -> None:
    rng, mus = np.random.default_rng(0), (0.2, 0.5, 1.0)
    places = np.column_stack([rng.uniform(-50.0, 50.0, 30), rng.uniform(0.0, 40.0, 30), np.zeros(30)])
    maps = [
        GaugeMap(10.0 * i, 20.0, 0.5, np.array([0.1, 0.2, 0.3]) * (i + 1), places, rng.uniform(0.05, 0.5, 30))
        for i in range(count)
    ]
    together = np.array([0.08, 0.1, 0.12])
    draw_places(tmp_path / "map.png", mus, together, maps, FIG9)
    (figure,) = figures
    panels = [axes for axes in figure.axes if axes.get_xlabel() == "x (mm)"]
    assert len(panels) == count
    for one, axes in zip(maps, panels, strict=True):
        assert np.asarray(axes.collections[0].get_array()) == pytest.approx(one.mean_mu_sd)
        outline = axes.get_lines()[0].get_xydata()
        # the section ends 36.6 mm above its base and is highest in the middle
        assert outline[:, 1].max() == pytest.approx(FIG9.height_mm, abs=0.01)
        assert {text.get_text() for text in axes.texts} == {f"g{k + 1}" for k in range(count)}
    (last,) = (axes for axes in figure.axes if axes.get_yscale() == "log")
    drawn = {one.get_label(): one.get_ydata() for one in last.get_lines()}
    assert ("together" in drawn) == (count > 1)
    assert [*drawn["g1 alone"]] == [0.1, 0.2, 0.3]


def test_a_flat_map_shows_the_status_of_the_contact_face(tmp_path: Path) -> None:
    x, z = (v.ravel() for v in np.meshgrid(np.linspace(-3.0, 3.0, 13), np.linspace(-2.0, 2.0, 9)))
    near = np.hypot(x, z)
    top, wall = FREE_FACES[CONTACT], FREE_FACES[CONTACT + 1]
    shown = {}
    for name, largest in (("open", 0.0), ("touching", 0.2)):
        status = np.select([largest * (near < 0.8) > 0.0, largest * (near < 1.6) > 0.0], ["stick", "slip"], "open")
        pressure = largest * np.maximum(1.0 - (near / 1.6) ** 2, 0.0)
        table = {
            "face": [top] * len(x) + [wall], "x_mm": [*x, 9.0], "z_mm": [*z, 0.0], "pressure_MPa": [*pressure, 9.0],
            "shear_x_MPa": [*(0.3 * pressure), 0.0], "shear_z_MPa": [0.0] * (len(x) + 1), "status": [*status, "slip"],
        }  # fmt: skip
        map_figure(tmp_path / f"{name}.png", table)
        shown[name] = [share(tmp_path / f"{name}.png", render.COLOURS[s], within=0.05) for s in (STICK, SLIP)]
    legend, both = np.array(shown["open"]), np.array(shown["touching"])
    assert (both > 1.3 * legend).all()
