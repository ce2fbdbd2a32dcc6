"""Assets of the pages and data for their scripts."""

from __future__ import annotations

import json

import pytest

from finger3d.report.html import asset, embedded


def test_no_text_ends_the_script_that_holds_it() -> None:
    data = {"name": "</script><!-- <b>", "values": [1.5, None]}
    text = embedded(data)
    assert "<" not in text
    assert json.loads(text) == data


def test_a_missing_asset_is_an_error_of_the_package() -> None:
    assert "plotly" in asset("chart.js").lower()
    with pytest.raises(FileNotFoundError):
        asset("nothing.css")
