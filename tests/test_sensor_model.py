"""Covariance of several readings, and the standard deviation of mu that it leaves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from tests.sensor_cases import curve, line, saturating, straight, together, tolerance


def test_readings_that_share_nothing_add_their_information() -> None:
    joint = together(curve(straight), curve(lambda mu: 0.002 * mu, noise=4e-4))
    expected = 1.0 / math.hypot(0.0015 / 1.5e-4, 0.002 / 4e-4)
    assert joint.mu_sd([0.3, 0.9]) == pytest.approx(expected, rel=1e-6)


def test_one_reading_is_as_if_alone() -> None:
    mu = np.linspace(0.1, 1.0, 7)
    for function in (straight, saturating):
        alone = curve(function, tolerances=(tolerance("depth_mm", 0.1, 0.02), tolerance("mesh", 1.0, 3e-4)))
        g = alone["g"]
        assert alone.mu_sd(mu) == pytest.approx(g.reading_sd(mu) / np.abs(g.slope(mu)), rel=1e-9)


def test_a_shared_tolerance_is_told_apart_from_mu() -> None:
    """Two readings and two unknowns: generalised least squares leaves what the noise leaves."""
    noise, depth = 1e-4, tolerance("depth_mm", 10.0, 0.02)  # far worse known than either reading could tell
    first = curve(line(0.01), noise=noise, tolerances=(depth,))
    second = curve(line(-0.01), noise=noise, tolerances=(depth,))
    assert first.mu_sd([0.5])[0] > 10.0
    # the difference of the two is free of the depth: its slope is 0.02, its noise sqrt(2) times that of one
    assert together(first, second).mu_sd([0.5])[0] == pytest.approx(math.sqrt(2.0) * noise / 0.02, rel=1e-3)
    # readings that the depth changes as mu does tell no more than one
    same = together(first, first)
    assert same.mu_sd([0.5])[0] == pytest.approx(first.mu_sd([0.5])[0], rel=1e-3)


def test_the_covariance_is_that_of_drawn_errors() -> None:
    random = np.random.default_rng(4)
    one = curve(straight, tolerances=(tolerance("depth_mm", 0.1, 0.03), tolerance("gauge_x_mm", 0.3, 0.01)))
    other = curve(saturating, noise=2e-3, tolerances=(tolerance("depth_mm", 0.1, -0.05), tolerance("nu", 0.01, 0.1)))
    joint, draws = together(one, other), 400_000
    depth, place, nu = (sd * random.normal(size=draws) for sd in (0.1, 0.3, 0.01))
    errors = [
        1.5e-4 * random.normal(size=draws) + 0.03 * depth + 0.01 * place,
        2e-3 * random.normal(size=draws) - 0.05 * depth + 0.1 * nu,
    ]
    drawn, found = np.cov(errors), joint.covariance([0.5])[0]
    found[1, 1] -= other["g"].curve_error(0.5) ** 2
    # entries of a covariance of n draws are good to about sqrt(2 / n) of the variances: 0.2 %
    scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
    assert (np.abs(found - drawn) / scale).max() < 0.01


def test_knowing_a_cause_reduces_the_variance_by_its_share() -> None:
    alone = curve(straight, tolerances=(tolerance("depth_mm", 0.1, 0.001), tolerance("nu", 0.01, 0.02)))
    shares = alone.reductions([0.5])
    squares = {"noise": 1.5e-4**2, "depth_mm": 1e-4**2, "nu": 2e-4**2}
    for name, square in squares.items():
        assert shares[name][0] == pytest.approx(square / sum(squares.values()), abs=1e-6)


def test_readings_are_chosen_by_name() -> None:
    joint = together(curve(straight), curve(saturating))
    assert joint.of(["b"]).names == ("b",)
    assert joint.of(["b", "a"]).at([0.5])[0] == pytest.approx(joint.at([0.5])[0][::-1])
    with pytest.raises(Finger3dError, match="c: .* a, b"):
        joint.of(["a", "c"])
