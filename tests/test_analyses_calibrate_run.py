"""The calibration curve is that of presses of the scene, whatever its effects."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.analyses.reduced import ReducedModel
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import Press, march
from finger3d.objects import Move
from finger3d.sensor import Calibration, estimate
from tests.logs import Log
from tests.sensor_cases import FEW, NONE, SCENE, scene


def test_the_curve_is_what_presses_of_the_scene_give() -> None:
    found = calibrate(scene(), "g36", mus=FEW, tolerances=NONE)
    model = scene().model()
    *_, frame = march(build(replace(model, friction=Coulomb(0.4))))
    assert found.readings[0].reading[2] == pytest.approx(frame.gauges["g36"], abs=1e-13)
    assert tuple(found.mu) == FEW
    assert found.readings[0].tolerances == ()


def test_effects_the_scene_names_are_in_the_curve() -> None:
    effects = {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0},
               "kinetic_friction": {"ratio": 0.7}}  # fmt: skip
    stiff = scene(effects=effects, gauge=[SCENE["gauge"][1]])
    found = calibrate(stiff, "long", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3})
    *_, frame = march(build(replace(stiff, tables=stiff.tables).model()))
    free = calibrate(scene(gauge=[SCENE["gauge"][1]]), "long", mus=FEW, tolerances=NONE)
    assert (
        np.abs(found.readings[0].reading).max() < 0.5 * np.abs(free.readings[0].reading).max()
    )  # a foil reads a part of the free strain
    assert found.readings[0].tolerances[0].slope.any()


@pytest.mark.parametrize("bulk", [True, False])
def test_a_fast_viscous_press_reads_the_instantaneous_body_and_a_slow_one_the_relaxed(
    bulk: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # elastic presses are not cut where contact begins, as viscous ones are not
    monkeypatch.setattr(Press, "moves_to", lambda press, pose: (Move(press.pose, pose),))

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
        assert one.readings[0].reading == pytest.approx(other.readings[0].reading, rel=1e-4)
        for a, b in zip(one.readings[0].tolerances, other.readings[0].tolerances, strict=True):
            assert a.slope == pytest.approx(b.slope, rel=1e-3, abs=1e-6), a.name


def test_a_viscous_curve_is_read_after_the_hold_and_tells_mu() -> None:
    legs = [{"depth_mm": 10.0, "steps": 4, "duration_s": 0.2}, {"depth_mm": 10.0, "steps": 2, "duration_s": 3.0}]
    changes = {"press": {"leg": legs}, "effects": {"viscosity": {"prony": [[0.4, 0.5]], "bulk": False}}}
    found = calibrate(scene(**changes), "g36", mus=FEW)
    assert {t.name for t in found.readings[0].tolerances} == set(TOLERANCES)
    *_, before, frame = march(build(scene(**changes, friction={"mu": 0.4}).model()))
    assert found.readings[0].reading[2] == pytest.approx(frame.gauges["g36"], rel=1e-9)
    assert abs(found.readings[0].reading[2] - before.gauges["g36"]) > 1e-5  # it creeps
    (answer,) = estimate(found, frame.gauges["g36"], tolerances=False)
    assert answer.mu == pytest.approx(0.4, abs=answer.std)


def test_large_deformation_goes_the_long_way_and_says_so(tmp_path: Path) -> None:
    coarse = {"size_mm": 5.0, "base_size_mm": 15.0, "mesher": "swept"}
    large = scene(effects={"large_deformation": {}}, mesh=coarse, press={"depth_mm": 3.0, "steps": 2})
    found = calibrate(large, "g36", tmp_path, FEW[:4], tolerances=NONE, report=(said := Log()))
    assert found.about["factorizations"] > 2  # one of the build, and those of the increments, which all mu share
    assert len(found.mu) == 4
    assert any("full" in line for line in said.lines)
    assert not (tmp_path / "reduced.npz").exists()
    with pytest.raises(Finger3dError, match="effects.large_deformation"):
        calibrate(large, "g36", maps=True)


@pytest.mark.slow
def test_steps_that_are_chosen_automatically() -> None:
    auto = scene(press={"depth_mm": 10.0, "steps": "auto"})
    found = calibrate(auto, "g36", mus=FEW[:4], tolerances=NONE)
    fine = calibrate(scene(press={"depth_mm": 10.0, "steps": 80}), "g36", mus=FEW[:4], tolerances=NONE)
    assert found.readings[0].reading == pytest.approx(fine.readings[0].reading, rel=0.03)


def test_coverage_with_a_depth_that_is_off_by_presses_of_the_real_body() -> None:
    """Depth errors are pressed, not linearised; noise is drawn; the interval comes from the calibration's slopes."""
    model = scene().model()
    found, curve = calibrated(model, "g36", np.linspace(0.1, 1.0, 13), tolerances={**NONE, "depth_mm": 0.1})
    body = ReducedModel.of(curve.problem)
    random = np.random.default_rng(7)
    count = 250
    hits = 0
    for mu in random.uniform(0.2, 0.9, count):
        legs = [replace(leg, depth_mm=leg.depth_mm + random.normal(0.0, 0.1)) for leg in model.legs]
        strain = body.press(float(mu), legs).steps[-1].gauges["g36"] + random.normal(0.0, found.noise[0])
        (answer,) = estimate(found, strain)
        hits += any(low <= mu <= high for low, high in answer.intervals)
    wanted = 0.9
    # three binomial standard deviations; the interpolation error, which is no random one here, can only widen the set
    three = 3.0 * math.sqrt(wanted * (1.0 - wanted) / count)
    assert wanted - three <= hits / count <= wanted + three + 0.1
