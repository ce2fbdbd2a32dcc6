"""HTML of a result in a notebook."""

from __future__ import annotations

from finger3d._notebook import card


def test_all_text_is_escaped() -> None:
    html = card("<t>", "<s>", [("<r>",)], ["<n>"], ["<f>"], ["<h>"])
    assert all(f"&lt;{letter}&gt;" in html for letter in "tsrnfh")
    assert not any(f"<{letter}>" in html for letter in "trnfh")


def test_a_table_and_remarks_are_shown_only_where_there_are_some() -> None:
    assert card("title", "status") == "<div><b>title</b>: status</div>"
    assert "1 remark<" in card("title", "status", folded=["one"])
    assert "2 remarks<" in card("title", "status", folded=["one", "two"])
