"""Discretisation errors from the spread over several meshes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from finger3d.accuracy.richardson import spread_error
from finger3d.mechanics.readings.quantities import ORDER


def test_the_order_is_that_of_the_corners_of_the_base() -> None:
    # Williams 1952: where a held face meets a free one at a right angle, in plane strain and along an edge of a solid,
    # displacements go as r^lambda, sin^2(lambda pi/2) = (4 (1 - nu)^2 - lambda^2)/(3 - 4 nu), forces converge in
    # 2 lambda; at nu = 0.49 that is 1.20
    nu = 0.49
    root = brentq(lambda p: np.sin(p * np.pi / 2) ** 2 - (4 * (1 - nu) ** 2 - p**2) / (3 - 4 * nu), 0.5, 0.8)
    assert pytest.approx(2.0 * root, abs=0.01) == ORDER


NUMBERS = {"normal_force_N": 2.0, "contact_half_length_mm": 1.0, "stick_area_mm2": 0.5, "force_x_N": 0.0}


def test_an_error_of_the_assumed_order_is_found_exactly_from_coarser_and_finer_meshes() -> None:
    exact, scale = 7.0, 0.3
    by_edge = {h: NUMBERS | {"normal_force_N": exact + scale * h**ORDER} for h in (0.5, 1.0, 2.0**0.5, 2.0, 4.0)}
    companions = [(h, numbers) for h, numbers in by_edge.items() if h != 1.0]
    found = spread_error(by_edge[1.0], companions)
    assert found["normal_force_N"] == pytest.approx(0.9 * scale, rel=1e-12)


def test_one_companion_that_agrees_by_chance_does_not_make_the_error_vanish() -> None:
    other = NUMBERS | {"normal_force_N": 2.3}
    one, both = spread_error(NUMBERS, [(2.0, other)]), spread_error(NUMBERS, [(2.0, other), (4.0, NUMBERS)])
    assert both["normal_force_N"] == pytest.approx(one["normal_force_N"] / 2.0**0.5, rel=1e-12)


def test_no_error_is_below_what_the_distance_of_the_points_leaves_open() -> None:
    found = spread_error(NUMBERS, [(2.0, NUMBERS)], spacing=0.1)
    # 0.002 h/a of the number itself, for a net force of the normal force; 0.04 of a length or an area
    assert found == pytest.approx(dict(zip(NUMBERS, (4e-4, 4e-3, 2e-3, 4e-4), strict=True)), rel=1e-12)
