"""report.html in headless Chromium: no error, no request, a body that is drawn and turns, no sideways scrolling."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.compare import compare
from tests.test_page import SECTION, SOLID

pytestmark = pytest.mark.browser

_FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_PATIENCE_MS = 120_000  # WebGL in software on few cores


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=_FLAGS)
        yield launched
        launched.close()


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages with spaces, ü")
    found = {}
    for name, text in {"section": SECTION, "solid": SOLID}.items():
        scene = folder / f"{name}.toml"
        scene.write_text(text, encoding="utf-8")
        found[name] = folder / name
        assert main(["press", str(scene), "--out", str(folder / name)]) == 0
    found["compare"] = compare(folder / "solid.toml", folder / "compare", []).out
    return found


class Visit:
    """A page opened at a width, and what it complained of or asked for."""

    def __init__(self, browser: Any, folder: Path, width: int, scheme: str = "light") -> None:
        self.page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.url = (folder / "report.html").as_uri()
        self.page.goto(self.url)
        if self.page.locator("#view-stage").count():
            self.page.wait_for_selector("#view-stage[data-drawn=yes]", timeout=_PATIENCE_MS)

    def stage(self) -> np.ndarray[Any, Any]:
        """Pixels of the 3D view's middle (h, w, 3), without its scale."""
        from PIL import Image

        self.page.wait_for_timeout(1000)
        image = Image.open(io.BytesIO(self.page.locator("#view-stage").screenshot(timeout=_PATIENCE_MS)))
        wide, high = image.size
        return np.asarray(image.convert("RGB").crop((wide // 4, high // 5, 3 * wide // 4, 3 * high // 4)), dtype=float)


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("name", ["section", "solid", "compare"])
def test_a_page_opens_without_complaint_request_or_sideways_scrolling(
    browser: Any, results: dict[str, Path], name: str, width: int
) -> None:
    visit = Visit(browser, results[name], width)
    assert visit.page.locator("#view-stage").count() == (name == "solid")
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    # folded parts must not widen it either
    visit.page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    assert all(visit.page.evaluate("[...document.images].map((i) => i.complete && i.naturalWidth > 100)"))
    if name == "solid":
        # a blank canvas has no variance; the drawn one shows body, pressure and page
        assert visit.stage().std(axis=(0, 1)).max() > 15.0
    assert visit.complaints == []
    assert visit.requests == [visit.url]
    visit.page.close()


def test_the_view_turns_and_answers_its_controls(browser: Any, results: dict[str, Path]) -> None:
    visit = Visit(browser, results["solid"], 1280, "dark")
    pressure = visit.stage()
    visit.page.select_option("#view-field", "status")
    status = visit.stage()
    # slip's orange is there: more red than blue by far, which neither the body nor viridis on the finger's flank is
    orange = (status[..., 0] - status[..., 2] > 120).mean()
    assert orange > 0.01
    assert np.abs(status - pressure).mean() > 1.0
    assert visit.page.locator("#view-key").is_visible()
    visit.page.locator("#view-step").fill("0")
    assert visit.page.locator("#view-label").inner_text() == "step 1: 0.125 mm deep"
    assert np.abs(visit.stage() - status).mean() > 0.5
    before = visit.stage()
    box = visit.page.locator("#view-stage").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    visit.page.mouse.move(*middle)
    visit.page.mouse.down()
    visit.page.mouse.move(middle[0] + 150, middle[1] + 40, steps=5)
    visit.page.mouse.up()
    assert np.abs(visit.stage() - before).mean() > 1.0
    assert visit.complaints == []
    visit.page.close()
