"""Estimates of mu from readings, and their likelihood."""

from __future__ import annotations

import math
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from finger3d.errors import Finger3dError
from finger3d.sensor import Calibration, Tolerance, estimate, save
from finger3d.sensor.likelihood import ReadingEffects, chi_square_tail, mu_sd, prior
from tests.sensor_cases import curve, kinked, line, opposite, saturating, straight, together, tolerance, turning


@pytest.fixture
def joint() -> Calibration:
    return opposite()


def test_a_single_gauge_may_be_named() -> None:
    one = curve(straight)
    assert estimate(one, {"g": straight(0.3)}, {"g": 1e-3}) == estimate(one, straight(0.3), 1e-3)
    with pytest.raises(Finger3dError, match="h: .* g"):
        estimate(one, {"h": 0.1})


def test_readings_may_be_many(joint: Calibration) -> None:
    mu = np.array([0.2, 0.5, 0.8])
    found = estimate(joint, dict(zip("ab", joint.at(mu).T, strict=True)), {"a": [1e-4, 2e-4, 3e-4]})
    assert [f.mu for f in found] == pytest.approx(list(mu), abs=0.02)
    assert [f.stds["a"] for f in found] == [1e-4, 2e-4, 3e-4]
    assert [f.stds["b"] for f in found] == [1.5e-4] * 3


@pytest.mark.parametrize(
    ("readings", "std", "told"),
    [
        (0.05, None, "a, b"),
        ({}, None, "name"),
        ({"a": 0.05, "x": 0.1}, None, "x: .* a, b"),
        ({"a": float("nan"), "b": 0.05}, None, "a = nan: "),
        ({"a": [0.05, float("inf")], "b": [0.05, 0.05]}, None, r"a = inf \(reading 2 of 2\)"),
        ({"a": [0.05, 0.05], "b": 0.05}, None, "b: 1 .* 2 "),
        ({"a": 0.05, "b": 0.05}, {"a": -1e-4}, "a = -0.0001: "),
        ({"a": 0.05, "b": 0.05}, {"c": 1e-4}, "c: "),
        ({"a": [0.05, 0.05], "b": [0.05, 0.05]}, {"a": [1e-4] * 3}, "a: 3 .* 2 "),
    ],
)
def test_readings_that_are_refused(joint: Calibration, readings: Any, std: Any, told: str) -> None:
    with pytest.raises(Finger3dError, match=told) as found:
        estimate(joint, readings, std)
    assert "\n" not in str(found.value)


def test_one_deviation_for_readings_of_several_units_is_refused() -> None:
    mixed = together(curve(line(0.01)), curve(line(1.0), kind="marker", noise=0.02))
    with pytest.raises(Finger3dError, match="b in mm"):
        estimate(mixed, {"a": 0.05, "b": 0.5}, 1e-4)
    assert estimate(mixed, {"a": 0.055, "b": 0.55}, {"a": 1e-4, "b": 0.01})[0].mu == pytest.approx(0.5, abs=0.02)


NOISE = 1.5e-4


def read(joint: Calibration, values: Any, **options: Any) -> Any:
    return estimate(joint, dict(zip(joint.names, values, strict=True)), **options)[0]


def drawn(joint: Calibration, mu: float, random: np.random.Generator) -> Any:
    return random.multivariate_normal(joint.at([mu])[0], joint.covariance([mu])[0])


def joint_of_three() -> Calibration:
    depth = tolerance("depth_mm", 0.1, 0.02)
    return together(
        curve(line(0.01), tolerances=(depth,)),
        curve(line(-0.006), tolerances=(depth,)),
        curve(saturating, noise=4e-4, tolerances=(tolerance("depth_mm", 0.1, -0.01), tolerance("nu", 0.003, 0.05))),
    )


def test_the_set_of_a_normal_likelihood_is_its_90_percent_interval_at_any_width() -> None:
    joint = together(curve(line(0.02)))
    quantile = stats.norm.ppf(0.95)
    for noise in np.geomspace(3e-5, 3e-3, 16):  # with the values of the grid alone up to 6 % too narrow
        found = read(joint, joint.at([0.613])[0], std=noise)
        assert np.diff(found.intervals[0]) == pytest.approx(2.0 * quantile * noise / 0.02, rel=5e-3)


def test_straight_curves_give_the_mean_and_deviation_of_least_squares() -> None:
    joint = together(curve(line(0.02)), curve(line(0.01), noise=3e-4))
    readings = joint.at([0.5])[0] + [1e-4, -2e-4]
    weight = np.array([0.02 / NOISE, 0.01 / 3e-4])
    shift = weight @ (np.array([1e-4, -2e-4]) / [NOISE, 3e-4]) / (weight @ weight)
    found = read(joint, readings)
    assert found.mu == pytest.approx(0.5 + shift, abs=1e-5)
    sd = 1.0 / np.linalg.norm(weight)
    assert found.std == pytest.approx(sd, rel=1e-2)
    # the 90 % interval of a normal distribution: 1.645 standard deviations, to a node of the quadrature
    assert (found.high - found.low) / 2.0 == pytest.approx(1.645 * sd, rel=0.05)
    assert found.status == "ok"


def test_deviations_and_intervals_are_kept() -> None:
    joint, random = joint_of_three(), np.random.default_rng(1)
    z, inside, told = [], [], 0
    for mu in random.uniform(0.1, 1.1, 600):
        found = read(joint, drawn(joint, mu, random))
        if found.status in ("ok", "coarse"):
            told += 1
            z.append((found.mu - mu) / found.std)
            inside.append(found.low <= mu <= found.high)
    assert told > 500
    assert 0.9 < math.sqrt(np.mean(np.square(z))) < 1.1
    assert 0.87 < np.mean(inside) < 0.93  # 0.9, give or take two standard deviations of a share of 550


def test_the_p_value_of_readings_that_agree_is_uniform() -> None:
    joint, random = joint_of_three(), np.random.default_rng(2)
    found = [read(joint, drawn(joint, mu, random)) for mu in random.uniform(0.2, 1.0, 500)]
    p = np.array([f.p_value for f in found])
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    assert sum(f.status == "contradiction" for f in found) <= 4  # 1 in 1000 is expected


def test_readings_of_two_presses_contradict_each_other() -> None:
    joint = together(curve(line(0.01)), curve(line(-0.006)), curve(line(0.02)))
    readings = joint.at([0.4])[0]
    readings[1] = joint.at([0.8])[0][1]
    found = read(joint, readings)
    assert found.status == "contradiction"
    assert math.isnan(found.mu)
    assert found.p_value < 1e-3
    assert "without b: mu = 0.4 " in found.verdict
    assert "without a" not in found.verdict


def test_a_second_reading_settles_which_side_of_a_turn_it_is() -> None:
    two_sided, slow = curve(turning), curve(line(0.002))
    joint = together(two_sided, slow)
    reading = joint.at([0.9])[0]
    alone = read(joint.of(["a"]), reading[:1])
    assert alone.status == "ambiguous"
    assert len(alone.intervals) == 2
    assert alone.intervals[0][0] < 0.3 < alone.intervals[0][1]
    both = read(joint, reading)
    assert both.status == "ok"
    assert both.mu == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(
    ("mu", "slope", "status"), [(1.19, 0.001, "above"), (0.03, 0.001, "below"), (0.6, 1e-5, "blind")]
)
def test_readings_beyond_the_ends(mu: float, slope: float, status: str) -> None:
    joint = together(curve(line(slope)), curve(line(2.0 * slope)))
    found = read(joint, joint.at([mu])[0])
    assert found.status == status
    assert math.isnan(found.mu)


def test_readings_that_no_mu_has_are_out_of_range() -> None:
    joint = together(curve(line(0.01)), curve(line(0.02)))
    found = read(joint, joint.at([1.2])[0] + [0.01, 0.02])
    assert found.status == "outside"


def test_an_exact_reading_finds_mu_by_the_curve_alone() -> None:
    joint = together(curve(straight), curve(line(0.01)))
    found = read(joint, joint.at([0.437])[0], std=0.0)
    assert found.mu == pytest.approx(0.437, abs=1e-4)


def test_broken_sensors_are_left_out() -> None:
    joint = joint_of_three()
    readings = dict(zip(joint.names, joint.at([0.5])[0], strict=True))
    readings.pop("b")
    found = estimate(joint, readings)[0]
    assert set(found.readings) == {"a", "c"}
    assert found.mu == pytest.approx(0.5, abs=found.std)


@pytest.mark.parametrize("freedom", [1, 2, 7])
def test_the_tail_of_chi_square(freedom: int) -> None:
    for value in (0.0, 0.1, 2.0, 9.0, 40.0):
        assert chi_square_tail(value, freedom) == pytest.approx(stats.chi2.sf(value, freedom), rel=1e-9)


@pytest.mark.parametrize("mu", [0.37, 0.45])
def test_a_reading_of_the_curve_is_that_of_its_mu(mu: float) -> None:
    """The likelihood of a curve that flattens is wide, and its mean far from the mu that has the reading."""
    made = curve(saturating, tolerances=(tolerance("mesh", 1.0, 5e-4),), limit=1.0)
    (found,) = estimate(made, made["g"].at(mu))
    assert found.mu == pytest.approx(mu, abs=1e-4)
    assert found.low < mu < found.high
    assert mu - found.low < 0.7 * (found.high - mu)


@pytest.mark.parametrize("function", [straight, saturating, kinked, turning])
def test_sets_and_deviations_of_one_reading_are_kept(function: Any) -> None:
    """For mu drawn evenly the 90 % sets hold it in 90 % of the draws, and the mean square of z is 1, on any curve."""
    grown = Tolerance("mesh", "error bar", 1.0, 3e-4 * np.linspace(0.0, 1.0, 25), np.zeros(25))
    made, random = curve(function, tolerances=(grown,)), np.random.default_rng(20261122)
    mu, g = random.uniform(0.02, 1.2, 1500), made["g"]
    answers = estimate(made, g.at(mu) + random.normal(size=len(mu)) * g.reading_sd(mu))
    hit = [any(low <= m <= high for low, high in a.intervals) for m, a in zip(mu, answers, strict=True)]
    # three binomial deviations, and what the last node of the quadrature adds
    assert all(any(low <= a.mu <= high for low, high in a.intervals) for a in answers if a.is_determined)
    assert np.mean(hit) == pytest.approx(0.9, abs=3.0 * math.sqrt(0.09 / len(mu)) + 0.01)
    z = np.array([(a.mu - m) / a.std for m, a in zip(mu, answers, strict=True) if a.is_determined])
    if function is not turning:  # there all but a few are ambiguous
        assert len(z) > 500
        assert abs(math.sqrt(np.mean(z**2)) - 1.0) < 0.1
        assert np.mean(np.abs(z) > 3.0) < 0.02


def test_a_tolerance_that_hides_mu_is_named() -> None:
    made = curve(straight, tolerances=(Tolerance("tilt_deg", "degree", 0.5, np.full(25, 0.02), np.zeros(25)),))
    (blind,) = estimate(made, straight(0.5))
    assert blind.status == "blind"
    assert re.search(r"100 % .*tilt_deg$", blind.verdict)
    (clear,) = estimate(made, straight(0.5), tolerances=False)
    assert clear.std == pytest.approx(0.1, rel=1e-3)  # the noise over the slope


def test_a_blind_reading_without_tolerances_blames_the_noise() -> None:
    made = curve(line(1e-6), tolerances=(tolerance("tilt_deg", 0.5, 1.0),))
    assert estimate(made, 0.05)[0].verdict.endswith(" tilt_deg")
    assert estimate(made, 0.05, tolerances=False)[0].verdict.endswith(" noise")


DEPTH_SD = 0.1


def test_the_information_is_that_of_a_joint_calibration() -> None:
    slopes, depths = (0.01, -0.006, 0.002), (0.02, 0.02, -0.03)
    joint = together(
        *(curve(line(s), tolerances=(tolerance("depth_mm", DEPTH_SD, d),)) for s, d in zip(slopes, depths, strict=True))
    )
    effects = ReadingEffects(
        np.array([[[s, DEPTH_SD * d]] for s, d in zip(slopes, depths, strict=True)]), np.full((3, 1), NOISE**2)
    )
    nothing = prior(1, 1e6)  # of mu
    every = mu_sd(nothing + effects.fisher.sum(axis=0))
    assert every[0] == pytest.approx(joint.mu_sd([0.5])[0], rel=1e-6)
    for i, name in enumerate(joint.names):
        assert mu_sd(nothing + effects.fisher[i])[0] == pytest.approx(joint.of([name]).mu_sd([0.5])[0], rel=1e-6)


@pytest.mark.parametrize("curvature", [-0.4, 0.4, 1.0])
def test_a_tolerance_of_second_order_is_marginalised(curvature: float) -> None:
    """Laplace's method against quadrature over the depth: deviations within a twentieth, and the least chi-square."""
    depth = tolerance("depth_mm", 0.1, 0.02, curvature)
    joint = together(curve(line(0.01), tolerances=(depth,)), curve(line(-0.006), tolerances=(depth,)))
    noise, z, mu = joint.noise, np.linspace(-6.0, 6.0, 6001), np.linspace(0.02, 1.2, 400)
    for true_z in (0.0, 1.0, 2.0):
        reading = joint.at([0.6])[0] + 0.02 * 0.1 * true_z + 0.5 * curvature * (0.1 * true_z) ** 2
        effect = 0.02 * 0.1 * z + 0.5 * curvature * (0.1 * z) ** 2
        left = (reading[:, None, None] - joint.at(mu).T[:, :, None] - effect) / noise[:, None, None]
        chi_square = np.sum(left**2, axis=0) + z**2
        best = mu[np.argmin(chi_square.min(axis=1))]
        density = np.exp(-0.5 * chi_square).sum(axis=1)
        std = math.sqrt(float(np.average((mu - best) ** 2, weights=density)))
        (found,) = estimate(joint, dict(zip(joint.names, reading, strict=True)))
        assert found.mu == pytest.approx(best, abs=0.5 * (mu[1] - mu[0]))
        assert found.std == pytest.approx(std, rel=0.05)


def test_a_plateau_belongs_to_the_set_where_a_deeper_press_reads_the_same() -> None:
    """Where the reading saturates, a press 2.7 deviations too shallow may have any mu beyond."""
    depth = tolerance("depth_mm", 0.1, 0.0037, -0.017)
    made = curve(lambda mu: 0.06 - 0.08 * np.maximum(0.5 - mu, 0.0) ** 2, tolerances=(depth,))
    (found,) = estimate(made, 0.06 - 0.27 * 0.0037 - 0.5 * 0.017 * 0.27**2)
    assert found.intervals[0][0] < 0.5 < 0.7 < found.high


NUMPY_ONLY = """
import importlib.abc, sys
class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        top = name.partition(".")[0]
        if top not in sys.stdlib_module_names and top not in ("numpy", "finger3d"):
            raise ImportError(f"{name} is not on the robot")
sys.meta_path.insert(0, Refuse())
import finger3d
print(finger3d.estimate(sys.argv[1], [float(sys.argv[2])])[0].mu)
"""


def test_an_estimate_needs_no_library_but_numpy(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    said = subprocess.run(
        [sys.executable, "-c", NUMPY_ONLY, str(kept), repr(straight(0.3))], capture_output=True, text=True, check=True
    )
    assert float(said.stdout) == pytest.approx(0.3, abs=2e-3)


def test_the_ros_node_publishes_what_estimate_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ROS is not installed here: a stand-in for it records what the node publishes and logs."""
    published, logged = [], []

    class Node:
        def __init__(self, name: str) -> None:
            self.name = name

        def declare_parameter(self, name: str, default: str) -> SimpleNamespace:
            return SimpleNamespace(value=str(tmp_path / default))

        def create_publisher(self, kind: type, topic: str, depth: int) -> SimpleNamespace:
            return SimpleNamespace(publish=lambda message: published.append(message.data))

        def create_subscription(self, kind: type, topic: str, call: object, depth: int) -> None:
            assert topic == "strain"

        def get_logger(self) -> SimpleNamespace:
            return SimpleNamespace(warning=logged.append)

    messages = ModuleType("std_msgs.msg")
    messages.Float64 = messages.Float64MultiArray = SimpleNamespace
    node = ModuleType("rclpy.node")
    node.Node = Node
    for name, module in {"rclpy": ModuleType("rclpy"), "rclpy.node": node, "std_msgs": ModuleType("std_msgs"),
                         "std_msgs.msg": messages}.items():  # fmt: skip
        monkeypatch.setitem(sys.modules, name, module)
    save(curve(straight), tmp_path / "calibration.json")
    own = runpy.run_path(str(Path(__file__).parents[1] / "docs" / "friction_node.py"))["FrictionNode"]()
    own.on_strain(SimpleNamespace(data=straight(0.3)))
    own.on_strain(SimpleNamespace(data=0.2))
    assert published[0][0] == pytest.approx(0.3, abs=2e-3)
    assert published[0][2] < 0.3 < published[0][3]
    assert len(published) == len(logged) == 1
    assert logged[0].startswith("out of range")
