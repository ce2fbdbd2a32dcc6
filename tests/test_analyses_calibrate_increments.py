"""Increments of a calibration: how their error is told, how many are chosen, and where what is left ends up."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate.increments import choose_increments, error_of_increments
from finger3d.analyses.calibrate.reference import read
from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise.run import find_best
from finger3d.analyses.optimise.task import OptimisationProblem as Search
from finger3d.mechanics.discretise.build import build
from finger3d.sensor import estimate, load
from tests.sensor_cases import NONE, scene

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


@pytest.mark.slow
def test_chosen_increments_press_the_curve() -> None:
    """Where the strain hardly depends on them, 20 do, and the error left is told from presses of ten."""
    mus = (0.02, 0.03, 0.04, 0.05)
    found, curve = calibrated(
        steps("auto").model(), "g36", mus, tolerances={**NONE, "depth_mm": 0.1, "increments": 1.0}
    )
    assert curve.increments.chosen
    assert curve.problem.model.legs[0].steps == 20
    same = calibrate(steps(20), "g36", mus=mus, tolerances={**NONE, "depth_mm": 0.1})
    assert found.readings[0].reading == pytest.approx(same.readings[0].reading, rel=1e-9)
    assert found.readings[0].tolerances[0].slope == pytest.approx(same.readings[0].tolerances[0].slope, rel=1e-6)
    assert found.readings[0].tolerances[1].name == "increments"
    ten = calibrate(steps(10), "g36", mus=mus, tolerances=NONE).readings[0].reading
    told = found.readings[0].tolerances[1].spread
    assert told == pytest.approx(np.abs(found.readings[0].reading - ten), rel=1e-6, abs=1e-12)
    assert told.max() <= 0.1 * found.noise[0]


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
