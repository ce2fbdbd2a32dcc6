"""Pages of results."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.model import Gauge
from finger3d.mechanics.readings import strain_columns
from finger3d.report.analyses import (
    calibrate_page,
    compare_page,
    gauge_places_page,
    identify_page,
    optimise_page,
    picture,
    sweep_charts,
)
from finger3d.report.build import (
    CITE,
    PAPER,
    Chart,
    Code,
    Figure,
    HeadlineRow,
    Line,
    Page,
    PageSection,
    Table,
    View3D,
    embedded,
    how_modelled,
    view_of,
)
from finger3d.report.press import press_page
from finger3d.results.states import load_states
from finger3d.results.summary import title_of
from finger3d.sensor import save
from tests.commands import loaded, run
from tests.scenes import SECTION, pressed, words
from tests.sensor_cases import curve, line, scene, straight, together, tolerance

# --- report.html and steps.npz: what they say, what they never hold, what they cost ----------------------------------


def test_the_page_of_a_section_loads_neither_plotly_nor_vtk(section: Path) -> None:
    program = f"from finger3d.report.press import press_page; press_page({str(section)!r}).write({str(section)!r})"
    assert not loaded(program, "plotly", "vtk", "vtkmodules", "pyvista", "matplotlib", "jinja2")


# --- pages in one file -----------------------------------------------------------------------------------------------


def test_a_page_asks_no_machine_for_anything(section: Path, solid: Path) -> None:
    for folder in (section, solid):
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert "default-src 'none'" in page
        own = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
        assert not re.search(r"(?:src|href)=\"(?!data:|#)", own)
        assert not re.search("https?://", own)


def test_a_section_carries_no_plotting_library_and_a_solid_stays_below_4_mb(section: Path, solid: Path) -> None:
    assert (section / "report.html").stat().st_size < 1_000_000
    assert "Plotly" not in (section / "report.html").read_text(encoding="utf-8")
    assert 1_700_000 < (solid / "report.html").stat().st_size < 4_000_000  # with plotly.js


def test_the_builder_takes_what_calibrate_and_sweep_have(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("RGB", (30, 20)).save(tmp_path / "fit.png")
    page = Page(
        "mu <from> strain",
        [HeadlineRow("resolution & more", 0.0123, "1/N", 0.0011), HeadlineRow("fit", "second order")],
        [PageSection("Fit", ["a < b", Table(["mu", "s"], [(0.25, 1e-3), ("x", None)]), Code("x = <1>", "code")], True)],
        [Figure("fit.png", 'the "fit"'), Figure("absent.png", "never seen")],
        command="calibrate",
        notes=["take care"],
    ).write(tmp_path)
    assert page == tmp_path / "report.html"
    text = words(page)
    for said in ("finger3d calibrate", "mu <from> strain", "resolution & more 0.0123 ± 0.0011 1/N", "second order",
                 "a < b", "0.25 0.001", "x = <1>", "take care"):  # fmt: skip
        assert said in text
    assert "never seen" not in text
    assert 'alt="the &quot;fit&quot;"' in page.read_text(encoding="utf-8")


def test_the_citation_is_that_of_the_citation_file(root: Path) -> None:
    file = (root / "CITATION.cff").read_text(encoding="utf-8")
    said = re.findall(r'^ *- name: "(.+)"|^ *(?:title|journal): "(.+)"|^ *(?:volume|issue|year): (\d+)|'
                      r"^ *(?:- family|given)-names: (.+)", file, re.MULTILINE)  # fmt: skip
    pieces = [piece for found in said for piece in found if piece]
    assert len(pieces) == 13
    assert [piece for piece in pieces if piece not in f"{CITE} {PAPER}"] == []


# --- assets of the pages and data for their scripts ------------------------------------------------------------------


def test_no_text_ends_the_script_that_holds_it() -> None:
    data = {"name": "</script><!-- <b>", "values": [1.5, None]}
    text = embedded(data)
    assert "<" not in text
    assert json.loads(text) == data


# --- charts of a page: what of a sweep becomes a line, and what stands in the page for plotly ------------------------


def data_of(page: Path) -> list[dict[str, Any]]:
    text = page.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="chart-data">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_plotly_comes_once_and_only_with_charts(tmp_path: Path) -> None:
    chart = Chart("c", "x", "y", [Line("l", (0.0, 1.0), (float("nan"), 2.0))], more=3)
    page = Page("t", charts=[chart, chart]).write(tmp_path)
    text = page.read_text(encoding="utf-8")
    assert text.count('class="chart"') == 2
    assert text.count("* plotly.js (gl3d") == 1
    assert 1_500_000 < page.stat().st_size < 3_000_000
    assert [line["y"] for found in data_of(page) for line in found["lines"]] == [[None, 2.0]] * 2
    assert "3 more" in text
    assert Page("t").write(tmp_path).stat().st_size < 20_000


@pytest.mark.parametrize("text", ["</script><b>ü", '"&<i>'])
def test_names_are_data_and_never_markup(text: str, tmp_path: Path) -> None:
    page = Page("t", charts=[Chart(text, text, text, [Line(text, (1.0,), (2.0,))], text)]).write(tmp_path)
    (chart,) = data_of(page)
    assert [chart["caption"], chart["x"], chart["y"], chart["legend"], chart["lines"][0]["label"]] == [text] * 5
    own = re.sub(r"<script\b.*?</script>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert "<b>" not in own
    assert "<i>" not in own


# --- the view of a solid in a page -----------------------------------------------------------------------------------


def unpacked(view: View3D, name: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(view.data[name]), kind)


def test_the_view_keeps_to_its_budget(solid: Path, section: Path) -> None:
    states = load_states(solid / "steps.npz")
    whole = view_of(states)
    assert whole is not None
    labels, vertices = whole.data["labels"], len(unpacked(whole, "rest", "<f4")) // 3
    assert len(labels) == 4
    # every corner of every facet, once on the faces that may touch and once on the others
    on = states.on_contact
    body, contact = (len(unpacked(whole, name, "<u4")) // 3 for name in ("body", "contact"))
    assert vertices == len(np.unique(states.corners[on])) + len(np.unique(states.corners[~on]))
    assert vertices == whole.data["vertices"]
    assert body + contact == len(states.facets)
    each = (vertices * 17 + 3 * contact) * 4 // 3
    fixed = (states.corners.size + states.object_points.size + states.object_faces.size) * 16 // 3
    less = view_of(states, budget=fixed + 2 * each)
    one = view_of(states, budget=fixed + each)
    assert less is not None
    assert one is not None
    assert (less.data["labels"][-1], one.data["labels"]) == (labels[-1], labels[-1:])
    assert len(less.data["labels"]) == 2
    assert view_of(states, budget=1000) is None
    assert view_of(load_states(section / "steps.npz")) is None
    slid = view_of(replace(states, target=states.target + [0.0, 1.5, 0.0, 0.0, 2.5, 0.0]))
    assert slid is not None
    assert re.findall(r"[\d.]+", slid.data["labels"][-1]) == ["4", "0.5", "1.5", "2.5"]


def test_the_view_carries_the_gauges_of_every_step_on_the_face_in_front(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    view = view_of(states, [Gauge("g", 1.0, 4.0), Gauge("elsewhere", 1.0, 9.0)])
    assert view is not None
    assert view.data["gaugeLabels"] == ["g, 0°, z = 0"]
    gauges = np.array(view.data["gauges"])
    assert gauges.shape == (4, 1, 3, 3)
    # SOLID is 2 mm wide and pressed by 0.5 mm: at rest the gauge would be at (1, 4, 1)
    at = gauges[:, 0, 1]
    assert np.all(np.diff(at[:, 1]) < 0.0)
    assert np.all((at[:, 1] < 4.0) & (at[:, 1] > 3.5))
    assert np.all((at[:, 2] > 1.0) & (at[:, 2] < 1.3))
    none = view_of(states)
    assert none is not None
    assert none.data["gauges"] == [[], [], [], []]


# --- the scene in a page ---------------------------------------------------------------------------------------------


def test_every_table_of_the_scene_with_its_defaults(tmp_path: Path) -> None:
    data = scene(effects={"kinetic_friction": {"ratio": 0.7}}).as_dict()
    (table,) = how_modelled({"scene": data}, tmp_path)
    assert isinstance(table, Table)
    rows = dict(table.rows)
    assert rows["finger"].startswith("geometry = clipped_cylinder, radius_mm = 100")
    assert {"material", "press", "model", "mesh", "gauge g36", "gauge long"} <= set(rows)
    assert "x_mm = 36" in rows["gauge g36"]
    assert "ratio = 0.7" in rows["effect kinetic_friction"]
    assert "branch = keep" in rows["effect kinetic_friction"]


def test_where_a_modulus_comes_from(tmp_path: Path) -> None:
    data = scene(material={"silicone": "Dragon Skin 20"}).as_dict()
    rows = dict(how_modelled({"scene": data}, tmp_path)[0].rows)
    assert rows["Young's modulus"].startswith("0.423 MPa \u00b1 25 %: Dragon Skin 20, ")
    assert "E_spread" not in rows["material"]
    assert "Young's modulus" not in dict(how_modelled({"scene": scene().as_dict()}, tmp_path)[0].rows)


def test_where_the_modulus_of_a_part_comes_from(tmp_path: Path) -> None:
    data = scene().as_dict() | {"parts": {"skin": {"shore_A": 20.0, "E_MPa": 0.7, "E_spread": 0.6, "E_origin": "Gent"}}}
    rows = dict(how_modelled({"scene": data}, tmp_path)[0].rows)
    assert rows["part skin"] == "shore_A = 20, E_MPa = 0.7"
    assert rows["Young's modulus of skin"] == "0.7 MPa \u00b1 60 %: Gent"


# --- the page of a press ---------------------------------------------------------------------------------------------


def copied(source: Path, target: Path, **changes: object) -> Path:
    """The folder's summary with some entries changed, alone in another folder."""
    summary = json.loads((source / "summary.json").read_text(encoding="utf-8"))
    (target / "summary.json").write_text(json.dumps(summary | changes), encoding="utf-8")
    return target


def test_a_press_tells_its_numbers_proof_cost_versions_and_how_to_cite(section: Path) -> None:
    summary = json.loads((section / "summary.json").read_text(encoding="utf-8"))
    last, text = summary["steps"][-1], words(section / "report.html")
    assert f" {last['normal_force_N']:.5g} N " in text
    assert f" {2 * last['contact_half_length_mm']:.5g} mm " in text
    assert f"<g> {last['gauges']['<g>']:.5g} " in text
    assert f"{max(s['residual'] for s in summary['steps']):.1e}" in text
    assert all(f"{step['residual']:.1e} yes" in text for step in summary["steps"])
    assert "geometry = half_cylinder, radius_mm = 5, width_mm = 2" in text
    assert f"condensation {summary['cost']['seconds']['condensation']:.2f} s" in text
    assert f"scipy {summary['versions']['scipy']}" in text
    assert CITE in text
    assert all(advice in text for advice in summary["advice"])
    assert (section / "report.html").read_text(encoding="utf-8").count('src="data:image/png;base64,') == 3


def test_a_users_text_is_never_markup(section: Path) -> None:
    page = (section / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "<g>" not in page
    assert "a <script>alert(1)</script> & ü" in words(section / "report.html")


def test_errors_are_shown_with_their_numbers(section: Path, tmp_path: Path) -> None:
    last = json.loads((section / "summary.json").read_text(encoding="utf-8"))["steps"][-1]
    estimate = {
        "discretisation": {"normal_force_N": 0.02, "contact_half_length_mm": 0.1, "gauge_<g>": 0.003},
        "steps": {"normal_force_N": 0.01, "contact_half_length_mm": 0.0},
        "method": "companion", "seconds": 0.1,
    }  # fmt: skip
    text = words(press_page(copied(section, tmp_path, error_estimate=estimate)).write(tmp_path))
    assert f" {last['normal_force_N']:.3f} ± 0.030 N " in text
    assert f" {2 * last['contact_half_length_mm']:.2f} ± 0.20 mm " in text
    assert f"<g> {last['gauges']['<g>']:.4f} ± 0.0030 " in text
    assert "normal_force_N 0.02 0.01" in text
    assert "±" not in words(press_page(copied(section, tmp_path, error_estimate=None)).write(tmp_path))


def test_a_failed_or_empty_press_says_so(section: Path, tmp_path: Path) -> None:
    steps = json.loads((section / "summary.json").read_text(encoding="utf-8"))["steps"]
    failed = str(Outcome.NO_CONVERGENCE)
    steps[-1] |= {"outcome": failed, "residual": None}
    page = press_page(copied(section, tmp_path, outcome=failed, steps=steps)).write(tmp_path)
    assert f'class="bad">{failed}' in page.read_text(encoding="utf-8")
    assert 'class="headline"' in page.read_text(encoding="utf-8")
    text = words(page)
    assert f" {steps[-2]['normal_force_N']:.5g} N " in text  # the last good step
    assert "none NO" in text
    empty = press_page(copied(section, tmp_path, outcome="incomplete", steps=[])).write(tmp_path)
    assert 'class="headline"' not in empty.read_text(encoding="utf-8")
    with pytest.raises(Finger3dError, match="summary.json"):
        press_page(tmp_path / "nothing")


def test_without_figures_there_is_no_page_and_an_old_one_goes(tmp_path: Path) -> None:
    out = pressed(tmp_path, SECTION)
    assert (out / "report.html").exists()
    assert pressed(tmp_path, SECTION, "--no-figures", "--set", "press.steps=2") == out
    assert not (out / "report.html").exists()
    assert len(load_states(out / "steps.npz").step) == 2


# --- pages of calibrations -------------------------------------------------------------------------------------------


SCENE: dict[str, Any] = {"scene": scene().as_dict() | {"title": "<b>a finger</b>"}}


def test_a_gauges_page_tells_range_curve_causes_and_a_command_that_succeeds(tmp_path: Path, capsys: Any) -> None:
    made = curve(line(0.05), tolerances=(tolerance("depth_mm", 0.1, 1e-3),), failed=((0.9, "no convergence"),), **SCENE)
    save(made, tmp_path / "calibration.json")
    text = words(calibrate_page(tmp_path).write(tmp_path))
    assert "<b>a finger</b>: g against friction" in text
    assert made.verdict() in text
    low, high = made.trusted[0]
    assert f"{low:.3g} to {high:.3g}" in text
    assert "mu = 0.9: no convergence" in text
    assert "depth_mm" in text
    command = re.search(r"finger3d (estimate \S+ --strain g=\S+)", text)
    assert command
    assert run(*command[1].split()) == 0
    found = re.match(r"mu = (\S+) \+- (\S+) \(", capsys.readouterr().out)
    assert found
    assert float(found[1]) == pytest.approx(made.mu[made.best], abs=0.01)
    assert f"mu = {made.mu[made.best]:.3g}, all tolerances {found[2]} " in text


def test_the_page_of_a_gauge_that_knows_mu_nowhere_gives_no_range(tmp_path: Path) -> None:
    save(curve(lambda mu: 0.0 * mu, **SCENE), tmp_path / "calibration.json")
    page = calibrate_page(tmp_path).write(tmp_path).read_text(encoding="utf-8")
    assert page.count("<dd>none</dd>") == 2  # with all tolerances, and by the noise alone
    assert "<dd>unknown</dd>" in page


def test_a_page_of_several_readings_tells_each_and_what_would_reduce_the_variance(tmp_path: Path) -> None:
    depth = tolerance("depth_mm", 0.1, 0.02)
    joint = replace(together(curve(line(0.01), tolerances=(depth,)), curve(straight, tolerances=(depth,))), **SCENE)
    save(joint, tmp_path / "calibration.json")
    text = words(calibrate_page(tmp_path).write(tmp_path))
    best = joint.best
    assert re.search(rf"mu = {joint.mu[best]:.3g}\b[^=]* {joint.judged_at_mu[best].std:.2g}\b", text)
    fall = joint.reductions(joint.mu)["depth_mm"][best]
    assert f"depth_mm {100.0 * fall:.1f} %" in text
    assert "--strain a=" in text
    assert "--strain b=" in text


# --- the page of a comparison ----------------------------------------------------------------------------------------


def test_a_comparison_tells_its_verdict_and_every_case(tmp_path: Path) -> None:
    force = "force_N_per_mm"
    case = {"size_mm": 2.0, "mesher": "swept", "outcome": "converged", "seconds": 1.0, "lines": {}}
    data = {
        "scene": {"title": "<t>", "finger": {"geometry": "block", "width_mm": 20.0}, "effects": {}},
        "outcome": "converged", "versions": {"finger3d": "1"},
        "verdict": ["Plane strain overstates the force by 74 %."],
        "table": [["", "solid", "plane strain"], ["peak pressure (MPa)", "0.21", "0.34"]],
        "cases": [
            {**case, "model": "solid", "width_mm": 20.0, "numbers": {force: 15.2}, "errors": {force: 0.1}},
            {**case, "model": "plane strain", "width_mm": 20.0, "numbers": {force: 26.4}, "errors": {}},
            {**case, "model": "solid", "width_mm": 99.0, "numbers": {}, "errors": {}, "outcome": "it failed"},
        ],
    }  # fmt: skip
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(compare_page(tmp_path).write(tmp_path))
    assert "<t>: " in text
    del data["scene"]["title"]
    (tmp_path / "compare.json").write_text(json.dumps(data), encoding="utf-8")
    assert title_of(data["scene"]) in words(compare_page(tmp_path).write(tmp_path))
    assert "solid 15.20 ± 0.10 N/mm" in text
    assert "plane strain 26.4 N/mm" in text
    assert data["verdict"][0] in text
    assert "peak pressure (MPa) 0.21 0.34" in text
    assert "99 2 1 it failed" in text


# --- the page of placed gauges ---------------------------------------------------------------------------------------


def test_every_gauge_with_its_place_and_the_command_that_calibrates_them(tmp_path: Path) -> None:
    gauge = {"z_mm": 0.0, "mean_mu_sd_alone": 0.05, "mean_mu_sd_with_those_before": 0.05}
    data = {
        "scene": scene().as_dict(), "mu": [0.1, 0.5], "mu_sd": [0.02, 0.04], "mean_mu_sd": 0.03,
        "gauges": [
            {"name": "g1", "x_mm": 30.25, "y_mm": 41.0, "angle_deg": 12.5, **gauge},
            {"name": "g2", "x_mm": -7.0, "y_mm": 20.0, "angle_deg": 90.0, **gauge},
        ],
    }  # fmt: skip
    (tmp_path / "gauges.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(gauge_places_page(tmp_path).write(tmp_path))
    assert "2 gauges" in text
    assert "mu = 0.1 to 0.5 0.03 readings tell mu up to 0.5" in text
    assert "g1 x 30.2, y 41.0, z 0.0 mm, 12.5°" in text
    assert f"finger3d calibrate {tmp_path / 'best.toml'} --gauge g1,g2" in text
    data |= {"gauges": data["gauges"][:1], "mu_sd": [0.02, 0.06]}  # 0.4 / sqrt(12) is 0.115
    (tmp_path / "gauges.json").write_text(json.dumps(data), encoding="utf-8")
    text = words(gauge_places_page(tmp_path).write(tmp_path))
    assert "1 gauge " in text
    assert "readings tell mu up to 0.1" in text


# --- the page of an identification -----------------------------------------------------------------------------------


def test_values_with_bounds_intervals_correlation_and_residuals(tmp_path: Path) -> None:
    value = {"value": 0.371, "std": 0.012, "low": 0.36, "high": 0.384}
    data = {
        "scene": scene().as_dict(), "measured": "bench/a.csv", "presses": 11, "notes": ["the depth is off"],
        "deviations": "of the noise",
        "values": {"material.E_MPa": value, "friction.mu": {**value, "value": 0.6}},
        "correlation": {
            "material.E_MPa": {"material.E_MPa": 1.0, "friction.mu": -0.25},
            "friction.mu": {"material.E_MPa": -0.25, "friction.mu": 1.0},
        },
        "residual_rms": {"normal_force_N": 0.4},
        "std_of_columns": {"normal_force_N": {"rms": 0.5, "from": "given"}},
    }  # fmt: skip
    task = {"free": [["material.E_MPa", 0.05, 5.0], ["friction.mu", 0.1, 1.0]]}
    for name, content in {"identify.json": data, "task.json": task}.items():
        (tmp_path / name).write_text(json.dumps(content), encoding="utf-8")
    page = identify_page(tmp_path).write(tmp_path)
    text, tables = words(page), page.read_text(encoding="utf-8").count("<table>")
    assert "a.csv" in text
    assert "material.E_MPa 0.371 ± 0.012" in text
    assert "material.E_MPa 0.05 5 0.371 0.012 0.36 to 0.384" in text
    assert "friction.mu -0.250 1.000" in text
    assert "normal_force_N 0.4 0.5 given" in text
    assert data["notes"][0] in text
    del data["values"]["friction.mu"]
    (tmp_path / "identify.json").write_text(json.dumps(data), encoding="utf-8")
    # one value is correlated with no other
    assert identify_page(tmp_path).write(tmp_path).read_text(encoding="utf-8").count("<table>") == tables - 1


# --- the page of a design search -------------------------------------------------------------------------------------


def written(folder: Path, best: float) -> Path:
    """Files of a search with three designs, one of which failed."""
    found = {
        "objective": "sensitivity", "best": 42.5, "start": 30.0, "bodies": 1, "values": {"gauge.g36.x_mm": best},
        "start_values": {"gauge.g36.x_mm": 20.0}, "increments": {"steps": [8], "strain_error": 1.2e-6},
    }  # fmt: skip
    search = {"free": [["gauge.g36.x_mm", 10.0, 40.0]], "scene": scene().as_dict()}
    (folder / "design.json").write_text(json.dumps(found), encoding="utf-8")
    (folder / "search.json").write_text(json.dumps(search), encoding="utf-8")
    rows = f"gauge.g36.x_mm,objective,outcome\n20.0,30.0,converged\n35.0,nan,too deep\n{best},42.5,converged\n"
    (folder / "evaluations.csv").write_text(rows, encoding="utf-8")
    (folder / "best.toml").write_text("x_mm = 1\n", encoding="utf-8")
    return folder


def test_the_best_designs_come_first_and_failures_are_counted(tmp_path: Path) -> None:
    text = words(optimise_page(written(tmp_path, 25.0)).write(tmp_path))
    assert "(sensitivity) 42.5" in text
    assert {"1 of 3", "2 of 3"} <= set(re.findall(r"\d of \d", text))
    assert "gauge.g36.x_mm 10 40 20 25" in text
    assert text.index("25 42.5") < text.index("20 30 ")
    assert "8 increments 1.2e-06" in text


@pytest.mark.parametrize(("best", "said"), [(25.0, False), (39.9, True), (10.1, True)])
def test_a_value_at_its_bound_is_pointed_out(best: float, said: bool, tmp_path: Path) -> None:
    page = optimise_page(written(tmp_path, best)).write(tmp_path).read_text(encoding="utf-8")
    remark = re.search(r"<tr><td[^>]*>gauge\.g36\.x_mm</td>.*?<td[^>]*>([^<]*)</td></tr>", page)  # the last cell
    assert remark is not None
    assert ("bound" in remark[1]) == said


# --- charts of a sweep -----------------------------------------------------------------------------------------------


def row(mu: str, depth: str, force: str, outcome: str = "converged", **more: str) -> dict[str, str]:
    return {"friction.mu": mu, "press.depth_mm": depth, "normal_force_N": force, "outcome": outcome} | more


def test_a_line_for_each_setting_of_the_other_keys_in_the_order_of_its_own() -> None:
    rows = [row("0.5", "10.0", "3.0"), row("0.5", "5.0", "1.0"), row("0.1", "10.0", "2.0"), row("0.1", "5.0", "0.5")]
    mu, depth = sweep_charts(rows, ["friction.mu", "press.depth_mm"])
    assert mu.lines == [Line("10", (0.1, 0.5), (2.0, 3.0)), Line("5", (0.1, 0.5), (0.5, 1.0))]
    assert (mu.x, mu.y, mu.legend) == ("friction.mu", "normal force (N)", "press.depth_mm")
    assert "friction.mu" in mu.caption
    assert depth.lines == [Line("0.5", (5.0, 10.0), (1.0, 3.0)), Line("0.1", (5.0, 10.0), (0.5, 2.0))]


def test_what_has_no_numbers_is_in_no_line() -> None:
    rows = [row("0.1", "5", "2.0"), row("0.2", "5", "nan", "contact did not settle"), row("0.3", "5", "4.0")]
    (chart,) = sweep_charts(rows, ["friction.mu", "press.depth_mm"])
    assert chart.lines == [Line("5", (0.1, 0.3), (2.0, 4.0))]
    assert sweep_charts(rows[:2], ["friction.mu"]) == []
    assert sweep_charts([], ["friction.mu"]) == []


def test_of_many_keys_gauges_and_settings_the_first_are_drawn_and_the_rest_is_counted() -> None:
    strains = [strain_columns(f"g{i}")[0] for i in range(5)]
    gauges = {column.key: "0.01" for column in strains}
    rows = [row(str(0.1 * i), str(j), "1.0", a=str(i), b=str(j), **gauges) for i in range(2) for j in range(12)]
    charts = sweep_charts(rows, ["friction.mu", "press.depth_mm", "a", "b"], strains)
    assert [chart.x for chart in charts] == ["friction.mu", "press.depth_mm", "a"] * 3
    assert {chart.y for chart in charts} == {"normal force (N)", "strain, g0", "strain, g1"}
    assert [(len(chart.lines), chart.more) for chart in charts] == [(8, 24 - 8)] * 9


# --- the picture of a sweep ------------------------------------------------------------------------------------------


ROWS = (
    "friction.mu,press.depth_mm,normal_force_N,outcome\n0.1,5,1.0,converged\n0.3,5,2.0,converged\n0.1,8,3.0,converged\n"
)


def folder_with(path: Path, rows: str, keys: list[str]) -> Path:
    (path / "sweep.json").write_text(json.dumps({"scene": {}, "vary": {key: [] for key in keys}}), encoding="utf-8")
    (path / "results.csv").write_text(rows, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("rows", "told"),
    [("friction.mu,outcome\n0.1,converged\n", "draw"),
     (ROWS.replace("0.3", "0.1"), "draw"), ("a;b\n1;2\n", "sweep")],
)  # fmt: skip
def test_what_cannot_be_drawn_is_one_line(rows: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(Finger3dError, match=told):
        picture(folder_with(tmp_path, rows, ["friction.mu"]), tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()
