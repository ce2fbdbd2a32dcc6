"""Calibrations of pressed bodies: the curve is that of presses, every tolerance a difference of two of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate import run as runs
from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.analyses.calibrate.tolerances import _mesh_errors, displaced_gauges, tolerance_of, with_defaults
from finger3d.analyses.press import press
from finger3d.analyses.reduced import ReducedModel
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import companion
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.sensor import estimate
from tests.models import half_cylinder
from tests.sensor_cases import FEW, NONE, SCENE, scene


def test_the_error_of_the_mesh_follows_from_the_companion_and_is_nowhere_below_its_mean() -> None:
    problem = build(half_cylinder(0.4))
    beside = companion(problem)
    own = SimpleNamespace(problem=problem, readings=np.array([[0.03, 0.01]]))
    coarse = SimpleNamespace(problem=beside, readings=np.array([[0.02, 0.01]]))
    (found,) = _mesh_errors(own, coarse, [SimpleNamespace(kind="gauge")])
    # from the change, the ratio of edges and the order of strains, 1.5; the second reading agrees by chance
    ratio = (problem.mesh.points.size / beside.mesh.points.size) ** 0.5
    error = abs(0.01 / (ratio**1.5 - 1.0))
    assert found == pytest.approx([error, error / 2.0**0.5], rel=1e-12)


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
def test_slopes_between_the_few_mu_that_are_tried() -> None:
    """Within a fifth of the largest, about what a tolerance is known to; where all of the contact begins to stick,
    the effect of nu jumps between two of them, which leaves a quarter.
    """
    fine, mus = scene(mesh={"size_mm": 0.6, "base_size_mm": 4.0}), runs.MUS[::2]
    told = {**NONE, "depth_mm": 0.1, "nu": 0.003, "tilt_deg": 0.5}
    assert len(mus) == 13
    few = calibrate(fine, "g36", mus=mus, tolerances=told)
    # so few mu are all tried
    tried, between = (calibrate(fine, "g36", mus=mus[first::2], tolerances=told) for first in (0, 1))
    for a, b, c in zip(*(one.readings[0].tolerances for one in (few, tried, between)), strict=True):
        assert a.name == b.name == c.name
        share = 0.25 if a.name == "nu" else 0.2
        assert a.slope[::2] == pytest.approx(b.slope, rel=1e-6)
        assert 0.0 < np.abs(a.slope[1::2] - c.slope).max() <= share * np.abs(b.slope).max(), a.name
        assert np.abs(a.spread[1::2] - c.spread).max() <= share * b.spread.max(), a.name


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
