"""Charts of a page: what of a sweep becomes a line, and what stands in the page for plotly."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from finger3d.report.build import write_page
from finger3d.report.chart import Chart, Line


def data_of(page: Path) -> list[dict[str, Any]]:
    text = page.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="chart-data">(.*?)</script>', text, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_plotly_comes_once_and_only_with_charts(tmp_path: Path) -> None:
    chart = Chart("c", "x", "y", [Line("l", (0.0, 1.0), (float("nan"), 2.0))], more=3)
    page = write_page(tmp_path, "t", charts=[chart, chart])
    text = page.read_text(encoding="utf-8")
    assert text.count('class="chart"') == 2
    assert text.count("* plotly.js (gl3d") == 1
    assert 1_500_000 < page.stat().st_size < 3_000_000
    assert [line["y"] for found in data_of(page) for line in found["lines"]] == [[None, 2.0]] * 2
    assert "3 more" in text
    assert write_page(tmp_path, "t").stat().st_size < 20_000


@pytest.mark.parametrize("text", ["</script><b>", '"&<i>', "ü"])
def test_names_are_data_and_never_markup(text: str, tmp_path: Path) -> None:
    page = write_page(tmp_path, "t", charts=[Chart(text, text, text, [Line(text, (1.0,), (2.0,))], text)])
    (chart,) = data_of(page)
    assert [chart["caption"], chart["x"], chart["y"], chart["legend"], chart["lines"][0]["label"]] == [text] * 5
    own = re.sub(r"<script\b.*?</script>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert "<b>" not in own
    assert "<i>" not in own
