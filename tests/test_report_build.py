"""Pages in one file."""

from __future__ import annotations

import re
from pathlib import Path

from finger3d.plotting.layout import sheet
from finger3d.report.build import CITE, PAPER, Code, Figure, HeadlineRow, PageSection, Table, write_page
from tests.scenes import words


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
    sheet(2, 2, (3.0, 2.0), (0.5, 0.1, 0.5, 0.1), "title").save(tmp_path / "two.png")
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
