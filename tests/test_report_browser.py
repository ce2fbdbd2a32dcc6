"""report.html in headless Chromium: no error, no request, a body that is drawn and turns, no sideways scrolling."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.compare import compare
from finger3d.cli import main
from finger3d.plotting.layout import DPI
from finger3d.report.build import Chart, Line, Page
from finger3d.results.states import load_states
from tests.scenes import HALF_CYLINDER, SECTION, SOLID, changed, pressed, solid

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
    found["sweep"], found["calibrate"] = folder / "sweep", folder / "calibrate"
    scene = str(folder / "section.toml")
    few = ["--vary", "friction.mu=0.1,0.3", "--vary", "press.depth_mm=0.3,0.5", "--workers", "1"]
    assert main(["sweep", scene, *few, "--out", str(found["sweep"])]) == 0
    assert main(["calibrate", scene, "--gauge", "<g>", "--mu", "0.1:0.7:4", "--out", str(found["calibrate"])]) == 0
    return found


_PICTURES = """[...document.querySelectorAll("figure.picture img")].map((image) => {
    const box = image.getBoundingClientRect();
    return [box.width, image.naturalWidth];
})"""
"""Of every picture: its width in CSS pixels, and in pixels of the file."""


def pixels(png: bytes) -> np.ndarray[Any, Any]:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float)


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
        for drawing in ("#view-stage", ".chart > div"):
            if self.page.locator(drawing).count():
                self.page.wait_for_selector(f"{drawing}[data-drawn=yes]", timeout=_PATIENCE_MS)

    def stage(self) -> np.ndarray[Any, Any]:
        """Pixels of the 3D view's middle (h, w, 3), without its scale."""
        from PIL import Image

        self.page.wait_for_timeout(1000)
        image = Image.open(io.BytesIO(self.page.locator("#view-stage").screenshot(timeout=_PATIENCE_MS)))
        wide, high = image.size
        return np.asarray(image.convert("RGB").crop((wide // 4, high // 5, 3 * wide // 4, 3 * high // 4)), dtype=float)


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("name", ["section", "solid", "compare", "calibrate"])
def test_a_page_opens_without_complaint_request_or_sideways_scrolling(
    browser: Any, results: dict[str, Path], name: str, width: int
) -> None:
    visit = Visit(browser, results[name], width)
    assert visit.page.locator("#view-stage").count() == (name == "solid")
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    # folded parts must not widen it either
    visit.page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    pictures = visit.page.evaluate(_PICTURES)
    assert len(pictures) >= 1
    # letters of 9 pt at least: at 0.58 of their size (96 pixels an inch) these are 7 pixels high
    assert min(shown / (pixels_wide * 96.0 / DPI) for shown, pixels_wide in pictures) >= 0.58
    for figure in visit.page.locator("figure.picture").all():
        assert pixels(figure.locator("img").screenshot()).std() > 10.0
    if name == "solid":
        # a blank canvas has no variance; the drawn one shows body, pressure and page
        assert visit.stage().std(axis=(0, 1)).max() > 15.0
    assert visit.complaints == []
    # an image in an SVG counts as a request, though it is in the page
    assert [url for url in visit.requests if not url.startswith("data:")] == [visit.url]
    visit.page.close()


_CHARTS = """[...document.querySelectorAll(".chart > div")].map((box) => {
    const place = (e) => { const b = e.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; };
    const words = ".xtick text, .ytick text, .xtitle, .ytitle, .legendtext, .legendtitletext";
    const texts = [...box.querySelectorAll(words)];
    return { box: place(box), points: box.querySelectorAll(".point").length, texts: texts.map(place),
        said: texts.map((e) => e.textContent) };
})"""


@pytest.mark.parametrize("width", [1280, 400])
def test_the_charts_of_a_sweep_are_drawn_with_their_points_and_no_text_covers_another(
    browser: Any, results: dict[str, Path], width: int
) -> None:
    visit = Visit(browser, results["sweep"], width)
    assert visit.page.evaluate("document.documentElement.scrollWidth") <= width
    charts = visit.page.evaluate(_CHARTS)
    assert len(charts) == 4  # force and strain, against mu and depth
    assert len({chart["box"][0] for chart in charts}) == (2 if width == 1280 else 1)
    for chart in charts:
        assert chart["points"] == 4
        left, top, right, bottom = chart["box"]
        for i, (a, b, c, d) in enumerate(chart["texts"]):
            assert left <= a < c <= right
            assert top <= b < d <= bottom
            # glyphs are lower than their boxes: lines of text may come within a pixel or two
            over = [
                p for p in chart["texts"][:i] if min(c, p[2]) - max(a, p[0]) > 2 and min(d, p[3]) - max(b, p[1]) > 3
            ]
            assert not over, chart["said"]
    said = [set(chart["said"]) for chart in charts]
    assert {"friction.mu", "normal force (N)", "press.depth_mm", "0.3", "0.5"} <= said[0]
    assert {"press.depth_mm", "strain, <g>", "friction.mu", "0.1", "0.3"} <= said[3]
    assert visit.complaints == []
    assert visit.requests == [visit.url]
    visit.page.close()


_PLACES = """[...document.querySelectorAll(".chart > div")].map((box) => {
    const place = (e) => { const b = e.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; };
    return { box: place(box), bar: place(box.querySelector(".modebar")),
        tools: [...box.querySelectorAll(".modebar-btn")].map((e) => e.dataset.title),
        axes: place(box.querySelector(".nsewdrag")), points: [...box.querySelectorAll(".point")].map(place) };
})"""


@pytest.mark.parametrize("width", [1280, 400])
def test_the_tool_bar_of_a_chart_covers_neither_its_axes_nor_a_point(browser: Any, tmp_path: Path, width: int) -> None:
    rising = [Line(f"{i}", (0.0, 1.0, 2.0), (0.0, 1.0, 2.0 - 0.1 * i)) for i in range(2)]  # points at the top right
    Page("tools", charts=[Chart("a chart", "x", "y", rising, "a key")] * 2).write(tmp_path)
    visit = Visit(browser, tmp_path, width)
    for chart in visit.page.evaluate(_PLACES):
        assert len(chart["tools"]) >= 4
        assert not [name for name in chart["tools"] if "Share" in name]  # which uploads the chart
        left, top, right, bottom = chart["bar"]
        assert chart["box"][0] <= left < right <= chart["box"][2]
        assert chart["box"][1] <= top
        assert bottom <= chart["axes"][1]
        assert all(bottom <= high for _, high, _, _ in chart["points"])
    visit.page.close()


def test_charts_of_long_names_and_of_any_text_are_drawn_within_their_boxes(browser: Any, tmp_path: Path) -> None:
    text = "<!--<script>"  # leaves a script open, unless it is escaped
    legend = ", ".join(["material.E_MPa", "finger.edge_height_mm", "object.radius_mm", text])
    lines = [Line(f"{i}, {i}, {text}", (0.0, 1.0), (0.0, float(i))) for i in range(6)]
    Page("long names", charts=[Chart(text, text, text, lines, legend)] * 2).write(tmp_path)
    for width in (1280, 400):
        visit = Visit(browser, tmp_path, width)
        for chart in visit.page.evaluate(_CHARTS):
            assert chart["points"] == 12
            assert {text, f"0, 0, {text}"} <= set(chart["said"])
            left, top, right, bottom = chart["box"]
            assert all(left <= a < c <= right and top <= b < d <= bottom for a, b, c, d in chart["texts"])
        visit.page.emulate_media(media="print", color_scheme="dark")
        ink = "[...document.querySelectorAll('.chart text')].map((e) => getComputedStyle(e).fill)"
        assert set(visit.page.evaluate(ink)) == {"rgb(0, 0, 0)"}
        assert visit.complaints == []
        visit.page.close()


_DRAWN = """(() => document.getElementById("view-stage").data.map((t) => ({
    kind: t.type, colour: t.color, scale: t.showscale === true, triangles: t.i ? t.i.length : 0, text: t.text})))()"""


def test_the_open_part_of_the_surface_is_grey_and_gauges_can_be_shown(browser: Any, results: dict[str, Path]) -> None:
    visit = Visit(browser, results["solid"], 1280)
    states = load_states(results["solid"] / "steps.npz")
    for step, field in ((4, "pressure"), (1, "pressure"), (4, "status")):
        visit.page.select_option("#view-field", field)
        visit.page.locator("#view-step").fill(str(step - 1))
        drawn = {
            kind: [t for t in visit.page.evaluate(_DRAWN) if t["kind"] == kind] for kind in ("mesh3d", "scatter3d")
        }
        names = [label for t in drawn["scatter3d"] if t["text"] for label in t["text"]]
        assert names == ["<g>, 0°, z = 0"]
        shown = {t["colour"]: t["triangles"] for t in drawn["mesh3d"] if not t["scale"]}
        # each facet of the contact surface in six: one for each corner, and three with the status of most corners
        status = np.zeros(len(states.points), dtype=int)
        status[states.nodes] = states.status[step - 1]
        corners = np.sort(status[states.corners[states.on_contact]], axis=1)
        all_differ = (corners == [0, 1, 2]).all(axis=1)
        most = np.where(all_differ[:, None], corners, corners[:, [1]])
        parts = np.hstack([corners, most])
        if field == "status":
            assert "#c4c4c4" not in shown
            continue
        assert shown["#c4c4c4"] == np.count_nonzero(parts == 0) > 0
        (coloured,) = (t for t in drawn["mesh3d"] if t["scale"])
        assert coloured["triangles"] == np.count_nonzero(parts) > 0
    assert visit.page.locator(".key .open").is_visible()
    visit.page.locator("#view-gauges").uncheck()
    assert not any(t["kind"] == "scatter3d" for t in visit.page.evaluate(_DRAWN))
    assert visit.complaints == []
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
    assert visit.page.locator(".key .zone").first.is_visible()
    visit.page.locator("#view-step").fill("0")
    assert visit.page.locator("#view-label").inner_text().startswith("increment 1: 0.125 mm")
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


_LAID_OUT = """(() => {
    const stage = document.getElementById("view-stage"), scene = stage._fullLayout.scene._scene;
    const model = scene.glplot.cameraParams.model;
    return { perMm: [0, 1, 2].map((a) => model[5 * a] * scene.dataScale[a]),
        ranges: ["x", "y", "z"].map((a) => scene.fullSceneLayout[a + "axis"].range),
        names: stage.data.filter((t) => t.mode === "text").map((t) => [t.x[0], t.y[0]]) };
})()"""
"""Length in the drawn scene of a millimetre along each axis, the ranges of the axes, and places of gauges' names."""


def test_the_view_is_to_scale_and_shows_a_ball_whole(browser: Any, tmp_path: Path) -> None:
    text = changed(HALF_CYLINDER, width_mm=4.0, steps=2) + '[object]\nshape = "sphere"\nradius_mm = 3.0\n'
    text += "".join(f'[[gauge]]\nname = "close {i}"\nx_mm = {0.1 * i}\ny_mm = 3.0\n' for i in range(3))
    visit = Visit(browser, pressed(tmp_path, solid(text, 0.8)), 1280)
    visit.page.wait_for_timeout(1000)
    laid_out = visit.page.evaluate(_LAID_OUT)
    np.testing.assert_allclose(laid_out["perMm"], laid_out["perMm"][0], rtol=1e-6)
    low, high = np.array(laid_out["ranges"]).T
    # the ball's lowest point is at 4.75 mm, then at 4.5 mm; it is wider than the finger, which is 10 mm long
    np.testing.assert_allclose(high, [5.0, 10.75, 3.0], rtol=0.25)
    assert (high[1:] >= [10.74, 2.98]).all()  # of a drawn ball, whose corners are on it
    assert low[2] <= -2.98
    names = np.array(laid_out["names"])
    assert len(names) == 4
    assert np.diff(np.sort(names[1:, 1])).min() > 0.4  # a line of text, where the finger has some 500 pixels
    visit.page.close()
