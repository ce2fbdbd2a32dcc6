"""The page of a press."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from finger3d.errors import Finger3dError, Outcome
from finger3d.report.build import CITE
from finger3d.report.press import press_page
from finger3d.results.states import load_states
from tests.scenes import SECTION, pressed, words


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
    text = words(press_page(copied(section, tmp_path, error_estimate=estimate)))
    assert f" {last['normal_force_N']:.3f} ± 0.030 N " in text
    assert f" {2 * last['contact_half_length_mm']:.2f} ± 0.20 mm " in text
    assert f"<g> {last['gauges']['<g>']:.4f} ± 0.0030 " in text
    assert "normal_force_N 0.02 0.01" in text
    assert "±" not in words(press_page(copied(section, tmp_path, error_estimate=None)))


def test_a_failed_or_empty_press_says_so(section: Path, tmp_path: Path) -> None:
    steps = json.loads((section / "summary.json").read_text(encoding="utf-8"))["steps"]
    failed = str(Outcome.NO_CONVERGENCE)
    steps[-1] |= {"outcome": failed, "residual": None}
    page = press_page(copied(section, tmp_path, outcome=failed, steps=steps))
    assert f'class="bad">{failed}' in page.read_text(encoding="utf-8")
    assert 'class="headline"' in page.read_text(encoding="utf-8")
    text = words(page)
    assert f" {steps[-2]['normal_force_N']:.5g} N " in text  # the last good step
    assert "none NO" in text
    empty = press_page(copied(section, tmp_path, outcome="incomplete", steps=[]))
    assert 'class="headline"' not in empty.read_text(encoding="utf-8")
    with pytest.raises(Finger3dError, match="summary.json"):
        press_page(tmp_path / "nothing")


def test_without_figures_there_is_no_page_and_an_old_one_goes(tmp_path: Path) -> None:
    out = pressed(tmp_path, SECTION)
    assert (out / "report.html").exists()
    assert pressed(tmp_path, SECTION, "--no-figures", "--set", "press.steps=2") == out
    assert not (out / "report.html").exists()
    assert len(load_states(out / "steps.npz").step) == 2
