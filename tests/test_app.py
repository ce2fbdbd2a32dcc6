"""The local page with sliders, and the body behind it."""

from __future__ import annotations

import math
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from dash import Dash, html

import finger3d
from finger3d.analyses.calibrate import TOLERANCES
from finger3d.app import (
    HOST,
    MU_STEP,
    STEPS,
    LiveBody,
    LivePress,
    LiveReading,
    local_server,
    numbers_of,
    page,
    section_figure,
    text_of,
    traction_figure,
)
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.readings import Gauge
from finger3d.scene.scene import parse
from tests.models import marched

# --- the condensed finger behind the local page: it answers what a press of the scene answers ------------------------


SCENE = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "friction": {"mu": 0.3},
    "press": {"depth_mm": 0.6, "steps": STEPS},
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 0.25, "base_size_mm": 1.0, "mesher": "swept"},
}
GAUGE = {"name": "g", "x_mm": 1.0, "y_mm": 4.0, "angle_deg": 20.0}


@pytest.fixture(scope="module")
def body() -> LiveBody:
    return LiveBody.of(parse(SCENE))


def pressed(mu: float, **gauge: float) -> tuple[float, float]:
    """Force and strain of a press of the scene."""
    scene = parse(SCENE | {"friction": {"mu": mu}, "gauge": ({**GAUGE, **gauge},)})
    step = marched(build(scene.model()))[-1]
    return float(step.state.force[:, 0].sum()), step.gauges["g"]


def test_force_and_strain_are_those_of_the_scene(body: LiveBody) -> None:
    gauge = Gauge("g", 1.0, 4.0, angle=math.radians(20.0))
    for mu in (0.1, 0.3):
        force, strain = pressed(mu)
        assert body.press(mu, 0.6).numbers["normal_force_N"] == pytest.approx(force, rel=1e-3)  # flat: normals are -y
        assert body.read(gauge, mu, 0.6, 1e-3).strain == pytest.approx(strain, rel=1e-9)


def test_the_standard_deviation_of_mu_is_that_of_a_calibration(body: LiveBody) -> None:
    found = body.read(Gauge("g", 1.0, 4.0, angle=math.radians(20.0)), 0.15, 0.6, 1e-3)
    low, high = (pressed(0.15 + step)[1] for step in (-MU_STEP, MU_STEP))
    assert found.slope == pytest.approx((high - low) / (2.0 * MU_STEP), rel=0.01)  # almost straight
    moved = [
        [
            pressed(0.15, **{key: GAUGE[key] + sign * TOLERANCES[f"gauge_{key}"][0]})[1] - found.strain
            for sign in (1.0, -1.0)
        ]
        for key in ("x_mm", "y_mm", "angle_deg")
    ]
    spread = [math.hypot(0.5 * (up - down), (up + down) / math.sqrt(2.0)) for up, down in moved]  # to second order
    assert found.strain_sd == pytest.approx(math.hypot(1e-3, *spread), rel=1e-3)  # with the error of the curve
    assert found.mu_sd == pytest.approx(found.strain_sd / abs(found.slope))


def test_a_reading_at_small_friction_needs_no_negative_one(body: LiveBody) -> None:
    mu = 0.005
    found = body.read(Gauge("g", 1.0, 4.0, angle=math.radians(20.0)), mu, 0.6, 1e-3)
    assert found.strain == pytest.approx(pressed(mu)[1], rel=1e-9)
    assert 0.0 < found.mu_sd < math.inf


def test_traction_obeys_coulomb_along_the_middle_line(body: LiveBody) -> None:
    press = body.press(0.05, 0.4)
    assert (np.diff(press.x_mm) > 0.0).all()
    slips, sticks = press.status == "slip", press.status == "stick"
    assert sticks.any()
    assert slips.any()
    # symmetric: pushed outwards on both sides, so that the friction on the finger points to the middle
    outward = np.sign(press.x_mm[slips])
    np.testing.assert_allclose(press.shear_x_MPa[slips], -outward * 0.05 * press.pressure_MPa[slips], rtol=1e-8)
    assert (np.abs(press.shear_x_MPa[sticks]) <= 0.05 * press.pressure_MPa[sticks] * (1.0 + 1e-8)).all()


@pytest.mark.parametrize("steps", [7, "auto"])
def test_the_page_opens_with_the_numbers_of_the_press(steps: int | str) -> None:
    scene = parse(SCENE | {"press": {"depth_mm": 0.6, "steps": steps}, "gauge": (GAUGE,)})
    own = finger3d.press(scene.with_effects(()), error=False)  # the page is in small strain
    body = LiveBody.of(scene)
    assert body.steps == len(own.steps)
    assert body.largest_depth_mm == own.last.depth_mm
    assert body.press(0.3, body.largest_depth_mm).numbers["normal_force_N"] == own.last.normal_force_N
    (gauge,) = body.problem.model.gauges
    assert body.read(gauge, 0.3, 0.6, 1e-3).strain == pytest.approx(own.last.gauges["g"], rel=1e-9)


def test_a_gauge_outside_the_finger_is_refused(body: LiveBody) -> None:
    with pytest.raises(Finger3dError):
        body.read(Gauge("g", 4.9, 4.9), 0.3, 0.6, 1e-3)


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-5.0, 2.0), (5.0, 4.0)])
def test_a_gauge_on_the_border_is_read(x: float, y: float) -> None:
    block = {"geometry": "block", "half_length_mm": 5.0, "height_mm": 4.0, "width_mm": 2.0}
    body = LiveBody.of(parse(SCENE | {"finger": block, "mesh": {**SCENE["mesh"], "size_mm": 0.5}}))
    at, inside = (body.read(Gauge("g", x * s, y, angle=0.3), 0.3, 0.6, 1e-3) for s in (1.0, 1.0 - 1e-4))
    assert abs(at.strain - inside.strain) < at.strain_sd
    assert at.strain_sd == pytest.approx(inside.strain_sd, rel=0.5)  # 100 times that of the noise in some places


@pytest.mark.parametrize("effect", ["large_deformation", "viscosity"])
def test_effects_whose_compliance_changes_are_refused_by_name(effect: str) -> None:
    settings = {"prony": ((0.3, 0.5),)} if effect == "viscosity" else {}
    press = {"depth_mm": 0.6, "duration_s": 1.0}
    with pytest.raises(Finger3dError, match=effect):
        LiveBody.of(parse(SCENE | {"press": press, "effects": {effect: settings}}))


# --- the local page: its figures, in a browser its sliders, and its server, which answers at a secret address only ---


PRESS = LivePress(
    {"normal_force_N": 2.0, "friction_sum_N": 0.5, "contact_half_length_mm": 1.5, "stick_half_length_mm": 0.5},
    0.0, np.array([-1.0, 0.0, 1.0]), np.array([0.1, 0.3, 0.1]), np.array([0.03, 0.0, -0.03]), np.zeros(3),
    np.array(["slip", "stick", "slip"]), np.zeros((1, 2)),
)  # fmt: skip


def test_lines_give_lengths_in_full_and_say_when_mu_cannot_be_told() -> None:
    assert all(number in numbers_of(PRESS) for number in ("2 N", "0.5 N", "3 mm", "1 mm"))
    assert "0.05" in text_of(LiveReading(0.01, 0.1, 5e-3, 0.05))
    assert "inf" not in text_of(LiveReading(0.01, 0.0, 5e-3, np.inf))


def test_figures_have_units_and_the_data() -> None:
    traction = traction_figure(PRESS, 0.3)
    assert "mm" in traction.layout.xaxis.title.text
    assert "MPa" in traction.layout.yaxis.title.text
    by_name = {trace.name.split()[-1]: trace for trace in traction.data}
    np.testing.assert_array_equal(by_name["slip"].x, [-1.0, 1.0])
    np.testing.assert_array_equal(by_name["slip"].y, [0.03, -0.03])  # along x, not its magnitude
    assert not any("along z" in trace.name for trace in traction.data)
    section = section_figure(LiveBody.of(parse(SCENE)), Gauge("g", 1.0, 2.0))
    assert np.mean(section.data[1].x) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def opened() -> Dash:
    return page(LiveBody.of(parse(SCENE | {"gauge": ({**GAUGE, "angle_deg": 200.0},)})), 0.3)


def answers(opened: Dash, *values: object) -> dict[str, dict[str, object]]:
    """What the page answers to values of its sliders that a browser sends."""
    name = next(key for key in opened.callback_map if "numbers" in key)
    ids = ("mu", "depth", "x", "y", "angle")
    outputs = [{"id": part.split(".")[0], "property": part.split(".")[1]} for part in name.strip(".").split("...")]
    inputs = [{"id": key, "property": "value", "value": v} for key, v in zip(ids, values, strict=True)]
    body = {"output": name, "outputs": outputs, "inputs": inputs, "changedPropIds": ["mu.value"]}
    path = f"{opened.config.requests_pathname_prefix}_dash-update-component"
    answer = opened.server.test_client().post(path, json=body)
    assert answer.status_code == 200
    return answer.get_json()["response"]


def test_the_page_opens_at_the_gauge_of_the_scene(opened: Dash) -> None:
    sliders = {part.children[2].id: part.children[2] for part in opened.layout.children[1].children}
    found = {name: slider.value for name, slider in sliders.items()}
    assert found == {"mu": 0.3, "depth": 0.6, "x": 1.0, "y": 4.0, "angle": pytest.approx(20.0)}
    said = answers(opened, *found.values())
    assert "normal force" in said["numbers"]["children"]
    assert said["mistake"]["children"] == ""


@pytest.mark.parametrize("value", ["abc", None, -1e300, 0.61, True])
def test_a_value_that_no_slider_has_is_refused_in_one_line(opened: Dash, value: object) -> None:
    said = answers(opened, 0.3, value, 1.0, 4.0, 20.0)
    assert said["mistake"]["children"] == "depth (mm): must be a number from 0.03 to 0.6"
    assert said["numbers"]["children"] == ""


def page_at(prefix: str) -> Dash:
    page = Dash(__name__, url_base_pathname=prefix)
    page.layout = html.Div("here")
    return page


@contextmanager
def served(page: Dash) -> Iterator[str]:
    url, server = local_server(page)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield url
    finally:
        server.shutdown()
        thread.join()


@pytest.mark.browser
def test_a_moved_slider_changes_numbers_and_figures_in_a_browser() -> None:
    from playwright.sync_api import expect, sync_playwright

    with served(page(LiveBody.of(parse(SCENE)), 0.3)) as running, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        tab = browser.new_page()
        complaints: list[str] = []
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        asked: list[str] = []
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto(running)
        expect(tab.locator("#numbers")).to_contain_text("N", timeout=60_000)
        before = tab.locator("#numbers").inner_text()
        handle = tab.locator("#mu").get_by_role("slider").or_(tab.locator("[role=slider]")).first
        handle.focus()
        for _ in range(5):
            tab.keyboard.press("ArrowLeft")
        expect(tab.locator("#numbers")).not_to_have_text(before, timeout=60_000)
        expect(tab.locator("#traction .main-svg").first).to_be_visible()
        browser.close()
    assert complaints == []
    assert all(url.startswith((running, "data:", "blob:")) for url in asked)


@pytest.mark.browser
def test_what_the_page_shows_belongs_together() -> None:
    from playwright.sync_api import expect, sync_playwright

    with served(page(LiveBody.of(parse(SCENE)), 0.3)) as running, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        tab = browser.new_page()
        tab.goto(running)
        numbers, reading = tab.locator("#numbers"), tab.locator("#reading")
        expect(numbers).to_contain_text("mu = 0.3, 0.6 mm deep", timeout=60_000)
        for name, typed, value, said in (
            ("depth", "20", "0.6", "0.6 mm deep"),
            ("depth", "0.333", "0.333", "0.333 mm deep"),
            ("mu", "5", "1.5", "mu = 1.5, 0.333 mm deep"),
            ("angle", "200", "180", "180 degrees"),
            ("y", "-3", "0", "y = 0 mm"),
        ):
            box = tab.locator(f"#{name}-typed")
            box.fill(typed)
            box.press("Tab")
            expect(box).to_have_value(value)
            expect(tab.locator(f"#{name} [role=slider]")).to_have_attribute("aria-valuenow", value)
            expect(reading if name in {"angle", "y"} else numbers).to_contain_text(said)
        tab.locator("#mu [role=slider]").press("ArrowLeft")
        expect(tab.locator("#mu-typed")).to_have_value("1.49")
        expect(numbers).to_contain_text("mu = 1.49, 0.333 mm deep")
        tab.locator("#mu-typed").fill("")
        tab.locator("#mu-typed").press("Enter")
        expect(tab.locator("#mistake")).to_contain_text("must be a number from 0 to 1.5")
        expect(numbers).to_be_empty()
        browser.close()


@pytest.fixture
def running() -> Iterator[str]:
    with served(page_at("/secret/")) as url:
        yield url


def status(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=10) as answer:
            assert "Set-Cookie" not in answer.headers
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_only_the_secret_address_is_answered(running: str) -> None:
    base = running.removesuffix("secret/")
    assert base.startswith(f"http://{HOST}:")
    assert status(running) == 200
    for path in ("", "guess/", "_dash-layout", "guess/_dash-layout", "%C3%BC/", "%ff/", "?token=%C3%BC"):
        assert status(base + path) == 404, path
    assert status(running + "_dash-layout", Cookie="token=\xfc") == 200


def test_a_name_that_another_site_had_resolved_to_this_machine_is_refused(running: str) -> None:
    assert status(running, Host="evil.example:8000") == 403


def test_a_port_that_is_taken_is_refused_by_number(running: str) -> None:
    port = int(running.split(":")[2].split("/")[0])
    with pytest.raises(Finger3dError, match=str(port)):
        local_server(page_at("/secret/"), port)


def test_a_port_that_cannot_be_one_is_refused() -> None:
    with pytest.raises(Finger3dError, match="port 65536: must be"):
        local_server(page_at("/secret/"), 65536)
