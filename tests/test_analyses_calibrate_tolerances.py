"""Tolerances and increments of a calibration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.curve_points import choose_increments, error_of_increments
from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.calibrate.tolerances import (
    displaced_gauges,
    poisson_steps,
    read,
    tolerance_of,
    with_defaults,
    with_modulus,
)
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise import OptimisationProblem as Search
from finger3d.analyses.optimise import find_best
from finger3d.analyses.press import press
from finger3d.analyses.reduced import ReducedModel
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import MIXED_FROM, Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import companion
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions
from finger3d.sensor import estimate, load
from tests.models import block
from tests.sensor_cases import FEW, NONE, SCENE, scene

# --- calibration of a scene ------------------------------------------------------------------------------------------


def test_every_tolerance_is_the_difference_of_two_scenes() -> None:
    """Each slope against two presses of changed scenes, made from scratch."""
    found = calibrate(scene(), "g36", mus=FEW)
    slopes, node = {t.name: t.slope for t in found.readings[0].tolerances}, 3.0**0.5
    assert set(slopes) == set(TOLERANCES)

    def strain(mu: float, **changes: Any) -> float:
        *_, frame = march(build(replace(scene(**changes).model(), friction=Coulomb(mu))))
        return float(frame.gauges["g36"])

    def off(key: str, by: float) -> dict[str, Any]:
        return {"gauge": [{**SCENE["gauge"][0], key: SCENE["gauge"][0][key] + by}]}

    number, mu = 2, FEW[2]
    central = {
        "nu": [(s, {"material": {"E_MPa": 1.0, "nu": 0.45 + s}}) for s in (0.003 * node, -0.003 * node)],
        "E_percent": [(s, {"material": {"E_MPa": 1.0 + 0.01 * s, "nu": 0.45}}) for s in (5.0, 0.0)],
        "tilt_deg": [(s, {"object": {"shape": "plane", "tilt_deg": s}}) for s in (0.5 * node, -0.5 * node)],
        "gauge_x_mm": [(s, off("x_mm", s)) for s in (0.3, -0.3)],
        "gauge_y_mm": [(s, off("y_mm", s)) for s in (0.3, -0.3)],
        "gauge_angle_deg": [(s, off("angle_deg", s)) for s in (2.0, -2.0)],
    }
    for name, ((a, first), (b, second)) in central.items():
        wanted = (strain(mu, **first) - strain(mu, **second)) / (a - b)
        assert slopes[name][number] == pytest.approx(wanted, rel=1e-6, abs=1e-9), name
    assert not slopes["E_percent"].any()
    problem = build(scene().model())  # another depth by the same mesh: the zone that is meshed fine follows the depth
    reach = 0.1 * node
    deep = [
        ReducedModel.of(problem).press(mu, [Leg(10.0 + s, steps=4)]).steps[-1].gauges["g36"] for s in (reach, -reach)
    ]
    assert slopes["depth_mm"][number] == pytest.approx((deep[0] - deep[1]) / (2.0 * reach), rel=1e-6)


def test_readings_that_are_quadratic_in_the_tilt_do_not_contradict_each_other() -> None:
    """Gauges near both edges of the contact: their strains change by opposite slopes and the same curvature."""
    told: dict[str, Any] = {"mesh": {"size_mm": 1.0, "base_size_mm": 6.0, "mesher": "swept"}}
    told["gauge"] = [
        {**SCENE["gauge"][0], "name": n, "x_mm": s * 36.0, "angle_deg": s * 30.0}
        for n, s in zip("ab", (1, -1), strict=True)
    ]
    made = calibrate(scene(**told), ["a", "b"], mus=np.linspace(0.05, 0.6, 8), tolerances=NONE | {"tilt_deg": 0.5})
    tilts = [r.tolerances[0] for r in made.readings]
    assert tilts[0].slope == pytest.approx(-tilts[1].slope, rel=1e-6)
    assert tilts[0].curvature == pytest.approx(tilts[1].curvature, rel=1e-6)
    pressed = press(scene(**told, object={"shape": "plane", "tilt_deg": 0.5}, friction={"mu": 0.4}), error=False)
    (found,) = estimate(made, pressed.steps[-1].gauges)
    assert found.status == "ok"
    assert found.mu == pytest.approx(0.4, abs=0.03)
    straight = [
        replace(r, tolerances=(replace(t, curvature=0.0 * t.curvature),))
        for r, t in zip(made.readings, tilts, strict=True)
    ]
    (without,) = estimate(replace(made, readings=tuple(straight)), pressed.steps[-1].gauges)
    assert without.status == "contradiction"


@pytest.mark.parametrize(("x", "y", "steps"), [(0.0, 0.0, (2, 1, 2)), (50.0, 0.0, (1, 1, 2)), (0.0, 20.0, (2, 2, 2))])
def test_a_gauge_on_the_border_is_displaced_along_it_and_inwards(x: float, y: float, steps: tuple[int, ...]) -> None:
    model = scene().model()
    gauge = replace(model.gauges[0], x_mm=x, y_mm=y)
    names = ("gauge_x_mm", "gauge_y_mm", "gauge_angle_deg")
    found = [d.tolerance for d in displaced_gauges(model, gauge, dict.fromkeys(names, 0.3))]
    assert tuple(found.count(name) for name in names) == steps


def test_the_spread_of_a_silicone_is_the_tolerance_of_its_modulus() -> None:
    """Unless another is given, and not where the scene gives E_MPa."""
    assert with_defaults(None)["E_percent"] == TOLERANCES["E_percent"][0]
    assert with_defaults(None, 0.3)["E_percent"] == pytest.approx(30.0)
    assert with_defaults({"E_percent": 2.0}, 0.3)["E_percent"] == 2.0
    assert "E_percent" not in with_defaults({"E_percent": 0.0}, 0.3)
    silicone = scene(material={"silicone": "Ecoflex 00-30", "nu": 0.45})
    few = NONE | {"depth_mm": 0.1}
    del few["E_percent"]
    found = calibrate(silicone, "g36", mus=FEW, tolerances=few)
    assert {t.name: t.sd for t in found.readings[0].tolerances} == {
        "depth_mm": 0.1,
        "E_percent": pytest.approx(100.0 * silicone.constants.spread),
    }


@pytest.mark.slow
def test_a_fine_body_leaves_its_differences_to_the_coarser_one_beside_it() -> None:
    """Which is what a calibration of that coarser body finds itself, and within a fifth of the largest slope."""
    told = {**NONE, "depth_mm": 0.1, "nu": 0.003}
    settings = {"mesh": {"size_mm": 0.3, "base_size_mm": 4.0}, "press": {"depth_mm": 10.0, "steps": 10}}
    fine = scene(**settings)
    found = calibrate(fine, "g36", mus=FEW, tolerances=told)
    body = build(fine.model())
    beside, _ = calibrated(companion(body).model, "g36", mus=FEW, tolerances=told)

    def strains(problem: Problem, depth_mm: float = 10.0) -> Any:
        reduced = ReducedModel.of(problem)
        return np.array([reduced.press(mu, [Leg(depth_mm, steps=10)]).steps[-1].gauges["g36"] for mu in FEW])

    at, softer = strains(body), build(scene(**settings, material={"E_MPa": 1.0, "nu": 0.447}).model())
    assert found.readings[0].reading == pytest.approx(at, rel=1e-9)
    own = {"depth_mm": (strains(body, 10.1) - strains(body, 9.9)) / 0.2, "nu": (at - strains(softer)) / 0.003}
    assert [a.name for a in found.readings[0].tolerances] == list(own)
    for a, b in zip(found.readings[0].tolerances, beside.readings[0].tolerances, strict=True):
        assert a.slope == pytest.approx(b.slope, rel=1e-6, abs=1e-9), a.name
        assert 0.0 < np.abs(a.slope - own[a.name]).max() < 0.2 * np.abs(own[a.name]).max(), a.name


def test_two_steps_of_any_length_give_the_parabola_through_them() -> None:
    slope, curvature = np.array([2.0, -1.0]), np.array([30.0, 0.0])
    effects = [(step, slope * step + 0.5 * curvature * step**2) for step in (0.17, -0.1)]
    found = tolerance_of("depth_mm", 0.1, effects)
    assert found.slope == pytest.approx(slope)
    assert found.curvature == pytest.approx(curvature, abs=1e-12)
    # the variance of s z + c z^2 / 2 for a normally distributed z is s^2 + c^2 / 2
    assert found.spread**2 == pytest.approx((0.1 * slope) ** 2 + 0.5 * (0.01 * curvature) ** 2)
    alone = tolerance_of("nu", 0.003, effects[:1])
    assert not alone.curvature.any()
    assert alone.slope == pytest.approx(effects[0][1] / 0.17)


COARSE = block(mesh=MeshOptions(1.5, 1.5, "swept"), gauges=(Gauge("g", 1.0, 1.5, length_mm=1.0),))


@pytest.mark.parametrize("large", [False, True], ids=["small strain", "finite strain"])
def test_the_moduli_of_all_parts_are_multiplied(large: bool) -> None:
    finger = designs()["block"](half_length_mm=3.0, height_mm=3.0, width_mm=2.0, skin_mm=1.0)
    model = replace(COARSE, design=finger, domain="plane-strain", gauges=(), parts=(("skin", Isotropic(3.0, 0.3)),))
    base = build(LargeDeformation().apply(model) if large else model)
    (*_, soft), (*_, stiff) = march(base), march(with_modulus(base, 1.25))
    assert stiff.state.force == pytest.approx(1.25 * soft.state.force, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("nu", "steps"),
    [
        (0.45, (-0.008, 0.008)), (0.49, (-0.008, 0.008)), (0.005, (0.008, 0.016)), (0.5, (-0.008, -0.016)),
        (MIXED_FROM, (0.008, 0.016)), (MIXED_FROM - 0.001, (-0.008, -0.016)), (0.487, (0.0065, 0.013)),
    ],
)  # fmt: skip
def test_poissons_ratio_keeps_its_range_and_its_element(nu: float, steps: tuple[float, float]) -> None:
    assert poisson_steps(nu, 0.008) == pytest.approx(steps, rel=1e-6)


NOISE = 1.5e-4


def steps(count: int | str) -> Any:
    """A section under a curved object, which is pressed in increments."""
    curved = {"shape": "cylinder", "radius_mm": 300.0}
    return scene(press={"depth_mm": 10.0, "steps": count}, object=curved)


@pytest.mark.parametrize(
    ("slope", "expected"),
    [
        (0.0, 20),  # one comparison is made whatever it says
        (1e-2, 80),  # 3e-2 / n^2, the difference to half as many, is 1.5e-5 at n = 45
        (10.0, 320),  # the limit of a section
    ],
)
def test_increments_are_doubled_until_the_error_is_a_tenth_of_the_noise(slope: float, expected: int) -> None:
    problem, tried = build(steps("auto").model()), list[int]()

    def read_once(p: Any) -> Any:
        tried.append(p.model.legs[0].steps)
        return np.array([[slope / tried[-1] ** 2 / NOISE]])

    found = choose_increments(problem, read_once)
    assert found.chosen
    assert [leg.steps for leg in found.legs] == [expected]
    assert found.error == pytest.approx(3.0 * slope / expected**2 / NOISE)
    assert tried == [10 * 2**k for k in range(len(tried))]


def test_increments_are_not_settled_by_a_press_that_fails() -> None:
    found = choose_increments(build(steps("auto").model()), lambda p: np.array([[0.0, np.nan]]))
    assert found.legs[0].steps == 320
    assert np.isnan(found.error)


def test_a_number_that_is_given_is_kept() -> None:
    model = steps(7).model()
    found = choose_increments(build(model), lambda p: pytest.fail("nothing is to be pressed"))
    assert not found.chosen
    assert found.legs == model.legs


@pytest.mark.slow
def test_the_error_of_given_increments_is_that_of_presses_of_many() -> None:
    """Within a factor 2 of the true one wherever that is above the noise; of 4 increments it is over 4 noises."""
    problem = build(steps(4).model())
    mu = np.linspace(0.3, 1.2, 4)

    def strain(other: Any) -> Any:
        return read(other, ("g36",), mu)[0]

    own = strain(problem)
    told = error_of_increments(problem, own, False, strain)
    true = np.abs(own - strain(build(steps(160).model())))
    assert true.max() > 4.0 * NOISE
    ratio = told[true > NOISE] / true[true > NOISE]
    assert 0.5 < ratio.min()
    assert ratio.max() < 2.0


def test_what_increments_leave_is_a_tolerance_and_widens_mu(tmp_path: Path) -> None:
    rough = steps(2)
    found = calibrate(rough, "g36", tmp_path, (0.1, 0.3, 0.4, 0.5, 0.6, 0.9), tolerances={**NONE, "increments": 1.0})
    data = json.loads((tmp_path / "calibration.json").read_text())
    assert data["about"]["increments"] == {"steps": [2], "chosen": False}
    increments = data["readings"]["g36"]["tolerances"]["increments"]
    assert (increments["unit"], increments["sd"]) == ("error bar", 1.0)
    assert found.reductions([0.5])["increments"][0] > 0.5
    # read by a press of many: off by far more than the noise, but not by more than what is told
    strain = float(read(build(steps(160).model()), ("g36",), np.array([0.5]))[0, 0])
    away = abs(strain - float(found.at(0.5)[0]))
    assert away > 2.0 * found.noise[0]
    assert away < 2.0 * float(found.readings[0].reading_sd([0.5])[0])
    (sure,), (honest,) = (estimate(load(tmp_path / "calibration.json"), strain, tolerances=t) for t in (False, True))
    assert abs(sure.mu - 0.5) > 2.0 * sure.std
    assert honest.low <= 0.5 <= honest.high  # which two increments do not tell any nearer


@pytest.mark.parametrize("count", [4, "auto"])
def test_a_search_tells_the_increments_of_its_best_design(count: int | str, tmp_path: Path) -> None:
    given = steps(count).as_dict() | {"mesh": {"size_mm": 6.0, "base_size_mm": 16.0}}
    free = (FreeKey("gauge.g36.angle_deg", 0.0, 90.0),)
    found = find_best(Search(given, free, mus=(0.1, 0.5), budget=2), tmp_path)
    told = json.loads((tmp_path / "design.json").read_text())["increments"]
    assert told["chosen"] is (count == "auto")
    assert told["steps"] == [4] if count == 4 else told["steps"][0] >= 20
    assert told["strain_error"] >= 0.0
    assert found.scene.as_dict()["press"]["steps"] == count
    # the same number again, where the start is remembered and the search goes on
    more = find_best(Search(given, free, mus=(0.1, 0.5), budget=3), tmp_path)
    assert json.loads((tmp_path / "design.json").read_text())["increments"]["steps"] == told["steps"]
    assert more.evaluations[: len(found.evaluations)] == found.evaluations
