"""The site, its sketches, and the notebook."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from PIL import Image

import finger3d
from finger3d._notebook import card
from finger3d.cli import main
from tests.scenes import HALF_CYLINDER, SECTION

TUTORIALS = ("section", "objects", "gel_pad", "friction", "pinch", "labels", "mold", "accuracy")


def rows(page: str, heading: str) -> set[str]:
    """Names in the first column of the first table under a heading."""
    part = page.split(f"## {heading}\n", 1)[1].split("\n#", 1)[0]
    cells = re.findall(r"^\| (`[^|]*) \|", part, flags=re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


def test_the_page_of_outputs_names_every_number_column_and_field(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "reference" / "outputs.md").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(SECTION, encoding="utf-8")
    result = finger3d.press(tmp_path / "scene.toml", tmp_path / "out", figures=False)
    assert rows(page, "summary.json") == set(result.summary())
    assert rows(page, "contact.csv") == set(result.to_dataframe("contact").columns)
    assert rows(page, "fields.vtu") == {*result.to_pyvista().array_names, "part"}
    files = {path.name for path in (tmp_path / "out").iterdir() if not path.name.startswith(".")}
    assert files <= rows(page.replace("# Outputs of a press", "## Outputs of a press"), "Outputs of a press")


def test_no_line_of_a_page_starts_with_a_per_cent_sign(root: Path) -> None:
    # MyST drops such a line as a comment
    for page in [root / "README.md", root / "CONTRIBUTING.md", *(root / "docs").rglob("*.md")]:
        lines = page.read_text(encoding="utf-8").splitlines()
        assert not [line for line in lines if line.lstrip().startswith("%")], page


def columns_of(path: Path) -> set[str]:
    return set(path.read_text(encoding="utf-8").splitlines()[0].split(","))


@pytest.mark.slow
def test_the_page_of_the_other_commands_names_what_they_write(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    page = (root / "docs" / "reference" / "analyses.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    marker = '[[marker]]\nname = "m"\nx_mm = 1.0\ny_mm = 4.0\n'
    Path("scene.toml").write_text(HALF_CYLINDER + marker, encoding="utf-8")
    for command in (
        "calibrate scene.toml --gauge g --out one",
        "calibrate scene.toml --gauge g,m.x --out two",
        "sweep scene.toml --vary friction.mu=0.1,0.2 --out sweep",
        "press scene.toml --out press --no-figures",
    ):
        assert main(command.split()) == 0
    capsys.readouterr()
    assert main(["estimate", "one/calibration.json", "--strain", "0.01", "--json"]) == 0
    one = json.loads(capsys.readouterr().out)
    assert main(["estimate", "two/calibration.json", "--strain", "g=0.01", "--strain", "m.x=0.01", "--json"]) == 0
    two = json.loads(capsys.readouterr().out)
    assert rows(page, "finger3d estimate --json") == {*one} == {*two}
    assert rows(page, "calibration.json") == {*json.loads(Path("one/calibration.json").read_text(encoding="utf-8"))}
    found = {re.sub(r"\bm\.x|(?<![^_])g(?![^_])", "NAME", name) for name in columns_of(Path("two/calibration.csv"))}
    assert {name.replace("m.x", "NAME") for name in found} == rows(page, "calibration.csv")
    of_a_step = columns_of(Path("press/history.csv"))
    assert columns_of(Path("sweep/results.csv")) - of_a_step == rows(page, "finger3d sweep") - of_a_step - {"KEY"} | {
        "friction.mu"
    }


def test_the_python_page_has_every_public_name(root: Path) -> None:
    page = (root / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^\.\. auto(?:function|class):: finger3d\.(\w+)$", page, flags=re.MULTILINE))
    assert shown == set(finger3d.__all__) - {"__version__"}


class _Links(HTMLParser):
    """Targets of the links, pictures, scripts and styles of a page, and the names that links may lead to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.names = {""}
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.names.update(found[key] or "" for key in ("id", "name") if key in found)
        target = found.get("src") or (found.get("href") if tag in ("a", "link") else None)
        if target:
            self.targets.append(target)


@pytest.fixture(scope="module")
def site(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does, with the outputs of tutorials that it has kept."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "--quiet", "docs", str(out)]
    environment = os.environ | {"PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.browser
@pytest.mark.timeout(1200)
def test_no_link_is_dead_and_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    pages = {page.resolve(): _Links(page) for page in site.rglob("*.html")}
    assert len(pages) > 25
    dead = []
    for page, links in pages.items():
        for target in links.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            leads_to = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            known = pages.get(leads_to)
            if not leads_to.exists() or (known and unquote(parts.fragment) not in known.names):
                dead.append((page.name, target))
    assert dead == []


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        yield launched
        launched.close()


@pytest.mark.browser
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("width", [1280, 400])
def test_pages_open_without_complaint_request_or_sideways_scrolling(site: Path, browser: Any, width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 900})
    complaints: list[str] = []
    requests: list[str] = []
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    names = ["index", "start", "scenes", "gallery", "verification", "reference/outputs", "reference/python"]
    for name in [*names, "theory/errors", *(f"tutorials/{tutorial}" for tutorial in TUTORIALS)]:
        page.goto((site / f"{name}.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        broken = (
            "[...document.images].filter((i) => i.loading !== 'lazy' && !(i.complete && i.naturalWidth > 0)).length"
        )
        assert page.evaluate(broken) == 0, name
    assert complaints == []
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
    page.close()


@pytest.mark.browser
@pytest.mark.timeout(1200)
def test_tutorials_show_what_they_computed_and_can_be_downloaded(site: Path, browser: Any) -> None:
    page = browser.new_page()
    for tutorial in TUTORIALS:
        page.goto((site / "tutorials" / f"{tutorial}.html").as_uri())
        assert page.locator(".cell_output img").count() >= 1, tutorial
        download = page.locator(f"a.download[href$='/{tutorial}.py']").first.get_attribute("href")
        script = (site / "tutorials" / download).resolve().read_text(encoding="utf-8")
        compile(script, tutorial, "exec")
    page.goto((site / "theory" / "contact.html").as_uri())
    assert page.locator("math").count() > 10
    letters = page.locator("div.math math").first.bounding_box()
    assert letters["width"] > 3.0 * letters["height"] > 24.0  # w = W r + q is set in a line
    page.close()


@pytest.mark.browser  # needs docutils, as the site does
def test_generated_tables_keep_their_columns(root: Path) -> None:
    site = runpy.run_path(str(root / "docs" / "_site.py"))
    table = site["outputs"]().splitlines()
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in table} == {4}  # a bare one would cut a cell
    assert any(r"\|friction\|" in line for line in table)


@pytest.mark.browser  # needs the site
@pytest.mark.timeout(1200)
def test_a_figure_of_the_gallery_leads_to_its_full_size(site: Path) -> None:
    gallery = (site / "gallery.html").read_text(encoding="utf-8")
    assert re.search(r'<a [^>]*href="_images/gear\.png"><img [^>]*src="_images/gear\.png"', gallery)


def test_the_script_draws_the_sketches_that_open_the_pages(root: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("sketches", root / "docs" / "_sketches.py")
    assert spec
    assert spec.loader
    sketches = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sketches)
    sketches.draw(tmp_path)
    theory = root / "docs" / "theory"
    names = {path.stem for path in tmp_path.iterdir()}
    assert names == {path.stem for path in theory.glob("*.png")}
    assert names == {path.stem for path in theory.glob("*.md")} - {"index", "solutions"}
    for name in names:
        drawn, kept = (np.asarray(Image.open(folder / f"{name}.png"), dtype=float) for folder in (tmp_path, theory))
        assert drawn.shape == kept.shape
        assert np.abs(drawn - kept).mean() < 1.0
        opening = (theory / f"{name}.md").read_text(encoding="utf-8").split("$")[0]
        assert f"]({name}.png)\n\n" in opening
        assert len(opening.split()) > 40


def test_all_text_is_escaped() -> None:
    html = card("<t>", "<s>", [("<r>",)], ["<n>"], ["<f>"], ["<h>"])
    assert all(f"&lt;{letter}&gt;" in html for letter in "tsrnfh")
    assert not any(f"<{letter}>" in html for letter in "trnfh")
