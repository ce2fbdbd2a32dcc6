"""The condensed finger behind the local page: it answers what a press of the scene answers."""

from __future__ import annotations

import math

import numpy as np
import pytest

import finger3d
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.app.live_body import MU_STEP, STEPS, LiveBody
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.scene.scene import parse
from tests.models import marched

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


@pytest.mark.parametrize("mu", [0.0, 0.005])
def test_a_reading_at_small_friction_needs_no_negative_one(mu: float, body: LiveBody) -> None:
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


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (2.0, 0.0), (5.0, 0.0), (-5.0, 2.0), (5.0, 4.0), (3.0, 4.0)])
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
