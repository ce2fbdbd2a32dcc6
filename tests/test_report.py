"""report.html and steps.npz: what they say, what they never hold, what they cost."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Gauge
from finger3d.plotting.layout import sheet
from finger3d.report.build import CITE, PAPER, Code, Figure, HeadlineRow, PageSection, Table, write_page
from finger3d.report.compare import compare_page
from finger3d.report.press import press_page
from finger3d.report.view3d import view_of
from finger3d.results.states import chosen, load_states
from tests.scenes import SECTION, pressed, words


def copied(source: Path, target: Path, **changes: object) -> Path:
    """The folder's summary with some entries changed, alone in another folder."""
    summary = json.loads((source / "summary.json").read_text(encoding="utf-8"))
    (target / "summary.json").write_text(json.dumps(summary | changes), encoding="utf-8")
    return target


def test_a_press_tells_its_numbers_proof_cost_versions_and_how_to_cite(section: Path) -> None:
    summary = json.loads((section / "summary.json").read_text(encoding="utf-8"))
    last, text = summary["steps"][-1], words(section / "report.html")
    assert f"normal force {last['normal_force_N']:.5g} N" in text
    assert f"contact length at z = 0 {2 * last['contact_half_length_mm']:.5g} mm" in text
    assert f"strain of gauge <g> {last['gauges']['<g>']:.5g}" in text
    assert f"converged steps: {max(s['residual'] for s in summary['steps']):.1e}" in text
    assert all(f"{step['residual']:.1e} yes" in text for step in summary["steps"])
    assert "finger geometry = half_cylinder, radius_mm = 5, width_mm = 2" in text
    assert "No effect beyond the baseline" in text
    assert f"condensation {summary['cost']['seconds']['condensation']:.2f} s" in text
    assert f"scipy {summary['versions']['scipy']}" in text
    assert CITE in text
    assert all(advice in text for advice in summary["advice"])
    assert (section / "report.html").read_text(encoding="utf-8").count('src="data:image/png;base64,') == 3
    assert "Deformed finger to scale: contact pressure, and stick and slip zones" in text


def test_a_users_text_is_never_markup(section: Path) -> None:
    page = (section / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "<g>" not in page
    assert "a <script>alert(1)</script> & ü" in words(section / "report.html")


def test_a_page_asks_no_machine_for_anything(section: Path, solid: Path) -> None:
    for folder in (section, solid):
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert "default-src 'none'" in page
        own = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
        assert not re.search(r"(?:src|href)=\"(?!data:|#)", own)
        assert not re.search("https?://", own)


def test_a_section_carries_no_plotting_library_and_a_solid_stays_below_8_mb(section: Path, solid: Path) -> None:
    assert (section / "report.html").stat().st_size < 1_000_000
    assert "Plotly" not in (section / "report.html").read_text(encoding="utf-8")
    assert 4_000_000 < (solid / "report.html").stat().st_size < 8_000_000


def test_errors_are_shown_with_their_numbers(section: Path, tmp_path: Path) -> None:
    last = json.loads((section / "summary.json").read_text(encoding="utf-8"))["steps"][-1]
    estimate = {
        "discretisation": {"normal_force_N": 0.02, "contact_half_length_mm": 0.1, "gauge_<g>": 0.003},
        "steps": {"normal_force_N": 0.01, "contact_half_length_mm": 0.0},
        "method": "companion", "seconds": 0.1,
    }  # fmt: skip
    text = words(press_page(copied(section, tmp_path, error_estimate=estimate)))
    assert f"normal force {last['normal_force_N']:.3f} ± 0.030 N" in text
    assert f"contact length at z = 0 {2 * last['contact_half_length_mm']:.2f} ± 0.20 mm" in text
    assert f"strain of gauge <g> {last['gauges']['<g>']:.4f} ± 0.0030" in text
    assert "companion error, in the unit of the name of the mesh of the increments normal_force_N 0.02 0.01" in text
    assert "±" not in words(press_page(copied(section, tmp_path, error_estimate=None)))


def test_a_failed_or_empty_press_says_so(section: Path, tmp_path: Path) -> None:
    steps = json.loads((section / "summary.json").read_text(encoding="utf-8"))["steps"]
    steps[-1] |= {"outcome": "contact did not settle", "residual": None}
    page = press_page(copied(section, tmp_path, outcome="contact did not settle", steps=steps))
    assert 'class="bad">contact did not settle' in page.read_text(encoding="utf-8")
    text = words(page)
    assert f"normal force {steps[-2]['normal_force_N']:.5g} N" in text  # the last good step
    assert "none NO" in text
    assert "normal force" not in words(press_page(copied(section, tmp_path, outcome="incomplete", steps=[])))
    with pytest.raises(Finger3dError, match="holds no summary.json"):
        press_page(tmp_path / "nothing")


def test_the_builder_takes_what_calibrate_and_sweep_have(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("RGB", (30, 20)).save(tmp_path / "fit.png")
    page = write_page(
        tmp_path,
        "mu <from> strain",
        [HeadlineRow("resolution & more", 0.0123, "1/N", 0.0011), HeadlineRow("fit", "second order")],
        [PageSection("Fit", ["a < b", Table(["mu", "s"], [(0.25, 1e-3), ("x", None)]), Code("x = <1>", "code")], True)],
        [Figure("fit.png", 'the "fit"'), Figure("absent.png", "never seen")],
        command="calibrate",
        notes=["take care"],
    )
    assert page == tmp_path / "report.html"
    text = words(page)
    for said in ("finger3d calibrate", "mu <from> strain", "resolution & more 0.0123 ± 0.0011 1/N", "second order",
                 "a < b", "0.25 0.001", "x = <1>", "take care"):  # fmt: skip
        assert said in text
    assert "never seen" not in text
    assert 'alt="the &quot;fit&quot;"' in page.read_text(encoding="utf-8")


def test_a_picture_stands_in_the_page_with_its_caption(tmp_path: Path) -> None:
    sheet(1, 2, (3.0, 2.0), (0.5, 0.1, 0.5, 0.1), "title").save(tmp_path / "two.png")
    figures = [Figure("two.png", '<left> & "right"'), Figure("none.png", "not shown")]
    page = write_page(tmp_path, "t", figures=figures).read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 1
    assert 'alt="&lt;left&gt; &amp; &quot;right&quot;"' in page
    assert "not shown" not in page


def test_the_citation_is_that_of_the_citation_file(root: Path) -> None:
    file = (root / "CITATION.cff").read_text(encoding="utf-8")
    said = re.findall(r'^ *- name: "(.+)"|^ *(?:title|journal): "(.+)"|^ *(?:volume|issue|year): (\d+)|'
                      r"^ *(?:- family|given)-names: (.+)", file, re.MULTILINE)  # fmt: skip
    pieces = [piece for found in said for piece in found if piece]
    assert len(pieces) == 13
    assert [piece for piece in pieces if piece not in f"{CITE} {PAPER}"] == []


def test_steps_hold_the_last_state_of_the_other_files(solid: Path) -> None:
    import pyvista

    states, grid = load_states(solid / "steps.npz"), pyvista.read(solid / "fields.vtu")
    with (solid / "contact.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert states.step.tolist() == [1, 2, 3, 4]
    assert np.allclose(states.target[:, 0], [0.125, 0.25, 0.375, 0.5])
    # single precision: 6e-8 of the largest value
    assert np.allclose(states.points, grid.points, atol=1e-5)
    assert np.allclose(states.displacement[-1], grid["displacement"], atol=1e-6)
    assert np.allclose(states.pressure[-1], [float(row["pressure_MPa"]) for row in table], atol=1e-6)
    assert [("open", "stick", "slip")[s] for s in states.status[-1]] == [row["status"] for row in table]
    assert np.array_equal(states.on_points("status", -1), grid["status"])


def test_every_kept_step_is_the_finger_at_that_depth(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    for k, (depth, *_) in enumerate(states.target):
        at = states.points[states.nodes] + states.displacement[k][states.nodes]
        # vertices that touch lie on the plane up to the weighting of the gap over their facets, h^2 / 8 R, twice
        touching = states.status[k] != 0
        assert touching.any()
        assert np.abs(at[touching, 1] - (5.0 - depth)).max() < 2 * 0.5**2 / (8 * 5.0)
        assert np.abs(states.gap[k][touching]).max() < 1e-6


def test_few_of_many_steps_are_kept_the_last_among_them() -> None:
    assert chosen(0) == []
    assert chosen(1) == [0]
    kept = chosen(160, 10)
    assert len(kept) == 10
    assert kept[-1] == 159
    assert np.ptp(np.diff(kept)) <= 1


def test_the_view_keeps_to_its_budget(solid: Path, section: Path) -> None:
    states = load_states(solid / "steps.npz")
    whole = view_of(states)
    assert whole is not None
    assert len(whole.labels) == 4
    # every corner of every facet, once on the faces that may touch and once on the others
    on = states.on_contact
    assert len(whole.rest) == len(np.unique(states.corners[on])) + len(np.unique(states.corners[~on]))
    assert len(whole.body) + len(whole.contact) == len(states.facets)
    each = len(whole.rest) * 17 * 4 // 3
    fixed = (states.corners.size + states.object_points.size + states.object_faces.size) * 16 // 3
    less = view_of(states, budget=fixed + 2 * each)
    one = view_of(states, budget=fixed + each)
    assert less is not None
    assert one is not None
    assert (less.labels[-1], one.labels) == (whole.labels[-1], whole.labels[-1:])
    assert len(less.labels) == 2
    assert view_of(states, budget=1000) is None
    assert view_of(load_states(section / "steps.npz")) is None
    slid = view_of(replace(states, target=states.target + [0.0, 1.5, 0.0, 0.0, 2.5, 0.0]))
    assert slid is not None
    assert slid.labels[-1] == "step 4: 0.5 mm deep, slid 1.5 mm along x, turned 2.5 deg about y"


def test_the_view_carries_the_gauges_of_every_step_on_the_face_in_front(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    view = view_of(states, [Gauge("g", 1.0, 4.0), Gauge("elsewhere", 1.0, 9.0)])
    assert view is not None
    assert view.gauge_labels == ("g, 0°, z = 0",)
    assert view.gauges.shape == (4, 1, 3, 3)
    # SOLID is 2 mm wide and pressed by 0.5 mm: at rest the gauge would be at (1, 4, 1)
    at = view.gauges[:, 0, 1]
    assert np.all(np.diff(at[:, 1]) < 0.0)
    assert np.all((at[:, 1] < 4.0) & (at[:, 1] > 3.5))
    assert np.all((at[:, 2] > 1.0) & (at[:, 2] < 1.3))
    none = view_of(states)
    assert none is not None
    assert none.gauges.shape == (4, 0, 3, 3)


def test_steps_of_something_else_are_refused_in_one_line(tmp_path: Path) -> None:
    np.savez(tmp_path / "steps.npz", a=1)
    (tmp_path / "text.npz").write_text("no")
    for name in ("steps.npz", "text.npz", "absent.npz"):
        with pytest.raises(Finger3dError, match="press the scene again"):
            load_states(tmp_path / name)


def test_without_figures_there_is_no_page_and_an_old_one_goes(tmp_path: Path) -> None:
    out = pressed(tmp_path, SECTION)
    assert (out / "report.html").exists()
    assert pressed(tmp_path, SECTION, "--no-figures", "--set", "press.steps=2") == out
    assert not (out / "report.html").exists()
    assert len(load_states(out / "steps.npz").step) == 2


def test_the_page_of_a_section_loads_neither_plotly_nor_vtk(section: Path) -> None:
    code = (
        f"import sys; from finger3d.report.press import press_page; press_page({str(section)!r});"
        "print(sorted({'plotly', 'vtk', 'vtkmodules', 'pyvista', 'matplotlib', 'jinja2'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_comparison_tells_its_verdict_and_every_case(tmp_path: Path) -> None:
    force = "force_N_per_mm"
    case = {"size_mm": 2.0, "mesher": "swept", "outcome": "converged", "seconds": 1.0, "lines": {}}
    data = {
        "scene": {"title": "<t>", "finger": {"geometry": "block", "width_mm": 20.0}, "effects": {}},
        "outcome": "converged", "versions": {"finger3d": "1"},
        "verdict": ["Plane strain overstates the force by 74 %."],
        "cases": [
            {**case, "model": "solid", "width_mm": 20.0, "numbers": {force: 15.2}, "errors": {force: 0.1}},
            {**case, "model": "plane strain", "width_mm": 20.0, "numbers": {force: 26.4}, "errors": {}},
            {**case, "model": "solid", "width_mm": 99.0, "numbers": {}, "errors": {}, "outcome": "it failed"},
        ],
    }  # fmt: skip
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(compare_page(tmp_path))
    assert "<t>: 2D against 3D" in text
    del data["scene"]["title"]
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    assert "block on a plane: 2D against 3D" in words(compare_page(tmp_path))
    assert "force per width, solid 15.20 ± 0.10 N/mm" in text
    assert "force per width, plane strain 26.4 N/mm" in text
    assert data["verdict"][0] in text
    assert "99 2 1 it failed" in text
