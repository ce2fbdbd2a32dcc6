"""Calibrations of pressed bodies: the curve is that of presses, every tolerance a difference of two of them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.accuracy.companions import companion
from finger3d.analyses.calibrate import presses as pressing
from finger3d.analyses.calibrate import run as runs
from finger3d.analyses.calibrate import tolerances as slopes
from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.analyses.calibrate.variations import with_modulus
from finger3d.analyses.reduced import ReducedModel
from finger3d.contact import acceleration
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.mechanics.build import build
from finger3d.mechanics.model import Leg
from finger3d.mechanics.solve import march
from finger3d.progress import Progress
from finger3d.sensor import Calibration, estimate
from tests.sensor_cases import FEW, NONE, SCENE, scene

# --- calibration of a scene ------------------------------------------------------------------------------------------


def test_the_curve_is_what_presses_of_the_scene_give() -> None:
    found = calibrate(scene(), "g36", mus=FEW, tolerances=NONE)
    model = scene().model()
    *_, frame = march(build(replace(model, friction=Coulomb(0.4))))
    assert found.reading[2] == pytest.approx(frame.gauges["g36"], abs=1e-13)
    assert tuple(found.mu) == FEW
    assert found.tolerances == ()


def test_every_tolerance_is_the_difference_of_two_scenes() -> None:
    """Each slope against two presses of changed scenes, made from scratch."""
    found = calibrate(scene(), "g36", mus=FEW)
    slopes = {t.name: t.slope for t in found.tolerances}
    assert set(slopes) == set(TOLERANCES)

    def strain(mu: float, **changes: Any) -> float:
        *_, frame = march(build(replace(scene(**changes).model(), friction=Coulomb(mu))))
        return float(frame.gauges["g36"])

    def off(key: str, by: float) -> dict[str, Any]:
        return {"gauge": [{**SCENE["gauge"][0], key: SCENE["gauge"][0][key] + by}]}

    number, mu = 2, FEW[2]
    central = {
        "nu": [(s, {"material": {"E_MPa": 1.0, "nu": 0.45 + s}}) for s in (0.0, -0.003)],
        "E_percent": [(s, {"material": {"E_MPa": 1.0 + 0.01 * s, "nu": 0.45}}) for s in (5.0, 0.0)],
        "tilt_deg": [(s, {"object": {"shape": "plane", "tilt_deg": s}}) for s in (0.5, -0.5)],
        "gauge_x_mm": [(s, off("x_mm", s)) for s in (0.3, -0.3)],
        "gauge_y_mm": [(s, off("y_mm", s)) for s in (0.3, -0.3)],
        "gauge_angle_deg": [(s, off("angle_deg", s)) for s in (2.0, -2.0)],
    }
    for name, ((a, first), (b, second)) in central.items():
        wanted = (strain(mu, **first) - strain(mu, **second)) / (a - b)
        assert slopes[name][number] == pytest.approx(wanted, rel=1e-6, abs=1e-9), name
    assert not slopes["E_percent"].any()
    problem = build(scene().model())  # another depth by the same mesh: the zone that is meshed fine follows the depth
    deep = [ReducedModel.of(problem).press(mu, [Leg(10.0 + s, steps=4)]).steps[-1].gauges["g36"] for s in (0.1, -0.1)]
    assert slopes["depth_mm"][number] == pytest.approx((deep[0] - deep[1]) / 0.2, rel=1e-6)


@pytest.mark.parametrize(
    ("domain", "mesh"), [("plane-strain", (1.0, 6.0)), ("solid", (6.0, 14.0))], ids=["section", "solid"]
)
def test_presses_started_from_their_neighbours_end_where_cold_ones_do(
    monkeypatch: pytest.MonkeyPatch, domain: str, mesh: tuple[float, float]
) -> None:
    sizes = {"size_mm": mesh[0], "base_size_mm": mesh[1], "mesher": "swept"}
    problem = build(scene(model={"domain": domain}, mesh=sizes).model())
    sought: list[Any] = []
    active_set = acceleration._normal_contact
    monkeypatch.setattr(acceleration, "_normal_contact", lambda *args: (sought.append(args), active_set(*args))[1])
    cold = {mu: pressing.press(problem, mu) for mu in runs.MUS}
    alone = len(sought)
    assert alone == 4 * len(runs.MUS)  # each of four increments
    chain = list(pressing.presses(problem, runs.MUS))
    assert len(sought) - alone < 0.5 * alone  # forces of a neighbour touch where they should
    again = list(pressing.presses(problem, runs.MUS[::6], cold))  # each from the same press
    for found in (*chain, *again):
        assert found.frame.outcome.ok
        assert found.frame.gauges["g36"] == pytest.approx(cold[found.mu].frame.gauges["g36"], rel=1e-9)
    assert [p.frame.iterations for p in again] == [1] * len(again)
    far = list(pressing.presses(problem, (0.06, 0.5, 1.0)))  # forces at half the friction would be no help
    assert [p.frame.iterations for p in far] == [pressing.press(problem, p.mu).frame.iterations for p in far]


def test_slopes_between_the_few_mu_that_are_tried(monkeypatch: Any) -> None:
    """Within a fifth of the largest, about what a tolerance is known to; where all of the contact begins to stick,
    the effect of nu turns between two of them.
    """
    fine, mus = scene(mesh={"size_mm": 0.6, "base_size_mm": 4.0}), runs.MUS[::2]
    told = {**NONE, "depth_mm": 0.1, "nu": 0.003, "tilt_deg": 0.5}
    few = calibrate(fine, "g36", mus=mus, tolerances=told)
    monkeypatch.setattr(runs, "_SLOPES", {True: len(mus)})
    for a, b in zip(few.tolerances, calibrate(fine, "g36", mus=mus, tolerances=told).tolerances, strict=True):
        assert a.name == b.name
        assert a.slope[::2] == pytest.approx(b.slope[::2], rel=1e-6)
        assert 0.0 < np.abs(a.slope - b.slope).max() <= 0.2 * np.abs(b.slope).max(), a.name
        assert np.abs(a.spread - b.spread).max() <= 0.2 * b.spread.max(), a.name


def test_a_fine_body_leaves_its_differences_to_the_coarser_one_beside_it(monkeypatch: Any) -> None:
    """Which is what a calibration of that coarser body finds itself, and within a fifth of the largest slope."""
    told = {**NONE, "depth_mm": 0.1, "nu": 0.003}
    fine = scene(mesh={"size_mm": 0.3, "base_size_mm": 4.0}, press={"depth_mm": 10.0, "steps": 10})
    found = calibrate(fine, "g36", mus=FEW, tolerances=told)
    beside, _ = calibrated(companion(build(fine.model())).model, "g36", mus=FEW, tolerances=told)
    monkeypatch.setattr(slopes, "_LEAST_POINTS", {2: math.inf})
    own = calibrate(fine, "g36", mus=FEW, tolerances=told)
    assert found.reading == pytest.approx(own.reading, abs=0.0)
    for a, b, c in zip(found.tolerances, own.tolerances, beside.tolerances, strict=True):
        assert a.slope == pytest.approx(c.slope, rel=1e-6, abs=1e-9), a.name
        assert 0.0 < np.abs(a.slope - b.slope).max() < 0.2 * np.abs(b.slope).max(), a.name


def test_modulus_from_the_same_condensation_is_that_of_another_scene() -> None:
    changes: dict[str, Any] = {
        "effects": {
            "elastic_object": {"E_MPa": 2.0, "nu": 0.4},
            "embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0},
        },
        "gauge": [SCENE["gauge"][1]],
        "friction": {"mu": 0.3},
    }
    *_, scaled = march(with_modulus(build(scene(**changes).model()), 1.1))
    *_, built = march(build(scene(**changes, material={"E_MPa": 1.1, "nu": 0.45}).model()))
    for name in ("long", "long_free"):
        assert scaled.gauges[name] == pytest.approx(built.gauges[name], rel=1e-9)


def test_effects_the_scene_names_are_in_the_curve() -> None:
    effects = {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0},
               "kinetic_friction": {"ratio": 0.7}}  # fmt: skip
    stiff = scene(effects=effects, gauge=[SCENE["gauge"][1]])
    found = calibrate(stiff, "long", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3})
    *_, frame = march(build(replace(stiff, tables=stiff.tables).model()))
    free = calibrate(scene(gauge=[SCENE["gauge"][1]]), "long", mus=FEW, tolerances=NONE)
    assert np.abs(found.reading).max() < 0.5 * np.abs(free.reading).max()  # a foil reads a part of the free strain
    assert found.tolerances[0].slope.any()


@pytest.mark.parametrize("bulk", [True, False])
def test_a_fast_viscous_press_reads_the_instantaneous_body_and_a_slow_one_the_relaxed(bulk: bool) -> None:
    def viscous(duration_s: float) -> Calibration:
        effects = {"viscosity": {"prony": [[0.5, 1.0]], "bulk": bulk}}
        timed = scene(effects=effects, press={"depth_mm": 10.0, "steps": 4, "duration_s": duration_s})
        return calibrate(timed, "g36", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3, "tilt_deg": 0.5})

    def elastic(nu: float) -> Calibration:
        still = scene(material={"E_MPa": 1.0, "nu": nu})
        return calibrate(still, "g36", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3, "tilt_deg": 0.5})

    k, g = 1.0 / (3.0 * (1.0 - 2.0 * 0.45)), 0.5 / (2.0 * (1.0 + 0.45))
    relaxed = 0.45 if bulk else (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g))
    # a share 1e-6 of the time constant moves the moduli by as much; contact edges may turn that into a little more
    for one, other in ((viscous(1e-6), elastic(0.45)), (viscous(1e6), elastic(relaxed))):
        assert one.reading == pytest.approx(other.reading, rel=1e-4)
        for a, b in zip(one.tolerances, other.tolerances, strict=True):
            assert a.slope == pytest.approx(b.slope, rel=1e-3, abs=1e-6), a.name


def test_a_viscous_curve_is_read_after_the_hold_and_tells_mu() -> None:
    legs = [{"depth_mm": 10.0, "steps": 4, "duration_s": 0.2}, {"depth_mm": 10.0, "steps": 2, "duration_s": 3.0}]
    changes = {"press": {"leg": legs}, "effects": {"viscosity": {"prony": [[0.4, 0.5]], "bulk": False}}}
    found = calibrate(scene(**changes), "g36", mus=FEW)
    assert {t.name for t in found.tolerances} == set(TOLERANCES)
    *_, before, frame = march(build(scene(**changes, friction={"mu": 0.4}).model()))
    assert found.reading[2] == pytest.approx(frame.gauges["g36"], rel=1e-9)
    assert abs(found.reading[2] - before.gauges["g36"]) > 1e-5  # it creeps
    (answer,) = estimate(found, frame.gauges["g36"], tolerances=False)
    assert answer.mu == pytest.approx(0.4, abs=1e-6)


def test_large_deformation_goes_the_long_way_and_says_so(tmp_path: Path) -> None:
    class Told(Progress):
        lines: list[str] = []

        def say(self, text: str) -> None:
            self.lines.append(text)

    coarse = {"size_mm": 5.0, "base_size_mm": 15.0, "mesher": "swept"}
    large = scene(effects={"large_deformation": {}}, mesh=coarse, press={"depth_mm": 3.0, "steps": 2})
    found = calibrate(large, "g36", tmp_path, FEW[:4], tolerances=NONE, report=Told())
    assert found.about["factorizations"] > 2  # one of the build, and those of the increments, which all mu share
    assert len(found.mu) == 4
    assert any("full press" in line for line in Told.lines)
    assert not (tmp_path / "reduced.npz").exists()
    with pytest.raises(Finger3dError, match="--map: not with effects.large_deformation"):
        calibrate(large, "g36", maps=True)


@pytest.mark.slow
def test_steps_that_are_chosen_automatically() -> None:
    auto = scene(press={"depth_mm": 10.0, "steps": "auto"})
    found = calibrate(auto, "g36", mus=FEW[:4], tolerances=NONE)
    fine = calibrate(scene(press={"depth_mm": 10.0, "steps": 80}), "g36", mus=FEW[:4], tolerances=NONE)
    assert found.reading == pytest.approx(fine.reading, rel=0.03)
