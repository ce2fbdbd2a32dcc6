"""Zones of contact and stick: where they end between the points, and their areas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import Delaunay

from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.state import ContactState
from finger3d.contact.zones import FACET_SIDES, Zone, facet_borders, zone_area, zone_ends, zones
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, Sphere

MODULUS = 2.0


def cattaneo(x: np.ndarray, half_length: float, stick: float, mu: float = 0.3) -> ContactState:
    """Hertz' pressure and gap under the friction of Cattaneo's cylinder (Johnson 1985, Eqs. 3.39 and 7.28), sampled.

    The largest pressure is 1 MPa, and ``E*`` is `MODULUS`.
    """
    pressure = np.sqrt(np.maximum(1.0 - (x / half_length) ** 2, 0.0))
    relief = stick / half_length * np.sqrt(np.maximum(1.0 - (x / stick) ** 2, 0.0))
    far = np.maximum(np.abs(x) / half_length, 1.0)
    # the slope of the gap is (2 p0 / E*) sqrt(x^2 / a^2 - 1)
    gap = half_length / MODULUS * (far * np.sqrt(far**2 - 1.0) - np.arccosh(far))
    status = np.where(pressure <= 0.0, OPEN, np.where(relief > 0.0, STICK, SLIP)).astype(np.int8)
    zero = np.zeros((len(x), 1))
    return ContactState(status, np.stack([pressure, mu * (pressure - relief)], axis=1), gap, zero, zero)


def on_line(x: np.ndarray, state: ContactState) -> tuple[Zone, Zone]:
    """Zones of points of a line, each joined with the next."""
    order = np.argsort(x)
    places, edges = np.stack([x, 0.0 * x, 0.0 * x], axis=1), np.stack([order[:-1], order[1:]], axis=1)
    return zones(state, places, np.ones(len(x)), np.full(len(x), 1.0 / MODULUS), edges)


def half_extents(x: np.ndarray, state: ContactState) -> tuple[float, float]:
    ends = [zone_ends(x, np.arange(len(x)), zone) for zone in on_line(x, state)]
    return 0.5 * (ends[0][1] - ends[0][0]), 0.5 * (ends[1][1] - ends[1][0])


@pytest.mark.parametrize("shift", np.linspace(0.0, 0.9, 7))
def test_ends_are_known_better_than_the_points(shift: float) -> None:
    x = np.arange(-12.0, 12.0) + shift
    contact, stick = half_extents(x, cattaneo(x, 8.3, 5.1))
    # samples are exact: what is added for means over hat functions, 0.15 of a spacing at most, stays
    assert -0.02 <= contact - 8.3 <= 0.17
    # exact but for the mean with the middle between the points, a quarter of their distance, and as much again
    assert stick == pytest.approx(5.1, abs=0.31)


@pytest.mark.parametrize("size", [0.11, 0.08, 0.057])
def test_the_half_length_under_a_cylinder_is_that_of_hertz_within_an_eighth_of_a_spacing(size: float) -> None:
    block = designs()["block"](half_length_mm=40.0, height_mm=40.0, width_mm=1.0)
    model = Model(
        block, Isotropic(1.0, 0.4), MeshOptions(size, 6.0, "swept"), (Leg(0.2, steps=1),),
        object=Cylinder(radius_mm=10.0, axis="z"), friction=Coulomb(0.0), domain="plane-strain",
    )  # fmt: skip
    problem = build(model)
    numbers = measure(problem.points, list(march(problem))[-1])
    exact = math.sqrt(4.0 * numbers["normal_force_N"] * 10.0 * (1.0 - 0.4**2) / math.pi)
    assert numbers["contact_half_length_mm"] == pytest.approx(exact, abs=0.125 * size)
    # a section is a strip
    assert numbers["contact_area_mm2"] == pytest.approx(2.0 * numbers["contact_half_length_mm"], rel=1e-3)


def test_the_area_under_a_ball_is_that_of_hertz_within_a_tenth_of_a_spacing_all_round() -> None:
    # the radius is 3.6 spacings; the points in contact stand for 14 % less
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    model = Model(
        block, Isotropic(1.0, 0.3), MeshOptions(0.35, 4.0, "swept"), (Leg(0.15, steps=1),),
        object=Sphere(radius_mm=10.0), friction=Coulomb(0.0),
    )  # fmt: skip
    problem = build(model)
    numbers = measure(problem.points, list(march(problem))[-1])
    exact = math.pi * (0.75 * numbers["normal_force_N"] * 10.0 * (1.0 - 0.3**2)) ** (2.0 / 3.0)
    assert numbers["contact_area_mm2"] == pytest.approx(exact, rel=2.0 * 0.1 * 0.35 / 1.256)


def test_the_order_of_the_points_does_not_matter() -> None:
    x = np.arange(-12.0, 12.0)
    mixed = np.random.default_rng(0).permutation(x)
    assert half_extents(mixed, cattaneo(mixed, 8.3, 5.1)) == pytest.approx(half_extents(x, cattaneo(x, 8.3, 5.1)))


def test_a_zone_that_reaches_the_last_point_ends_there() -> None:
    x = np.arange(5.0)
    for zone in on_line(x, cattaneo(x - 2.0, 100.0, 50.0)):
        assert zone_ends(x, np.arange(5), zone) == (0.0, 4.0)


def test_one_point_that_sticks_reaches_halfway_to_its_neighbours_and_none_nowhere() -> None:
    x = np.arange(-3.0, 4.0)
    stick = half_extents(x, cattaneo(x, 2.5, 0.4))[1]
    assert stick == pytest.approx(0.5, abs=0.06)
    assert half_extents(x, cattaneo(x + 100.0, 1.0, 0.5)) == (0.0, 0.0)


def test_the_area_of_a_zone_is_linear_in_where_its_border_cuts_the_facets() -> None:
    # the unit square in two triangles, of which the border cuts off all beyond x = 0.3
    facets, area = np.array([[0, 1, 2], [0, 2, 3]]), np.array([0.5, 0.5])
    x = np.array([0.0, 1.0, 1.0, 0.0])
    zone = Zone(x == 0.0, lambda last, beyond: np.full(len(last), 0.3))
    assert zone_area(facets, area, zone) == pytest.approx(0.3, abs=1e-12)
    assert zone_area(np.array([[0, 1]]), np.array([2.0]), zone) == pytest.approx(0.6, abs=1e-12)


def test_a_drawn_border_keeps_a_line_and_loses_the_teeth_of_an_unstructured_mesh() -> None:
    random = np.random.default_rng(1)
    at = random.uniform(-2.0, 2.0, (900, 2))
    places, facets = np.pad(at, ((0, 0), (0, 1))), Delaunay(at).simplices

    def border_of(level: np.ndarray, noise: float) -> np.ndarray:
        """Places of the border of the zone in which `level` is negative."""
        status = np.where(level < 0.0, STICK, OPEN)

        def share(last: np.ndarray, beyond: np.ndarray) -> np.ndarray:
            right = level[last] / (level[last] - level[beyond])
            return np.clip(right + noise * np.sin(17.0 * last + 5.0 * beyond), 0.02, 0.98)

        both = (Zone(status != OPEN, share), Zone(status == STICK, share))
        shares = facet_borders(facets, status, both, places)
        start, end = (places[facets[:, FACET_SIDES[:, k]]] for k in range(2))
        cut = status[facets[:, FACET_SIDES[:, 0]]] != status[facets[:, FACET_SIDES[:, 1]]]
        # a side has one border, whichever facet it is seen from
        sides = np.sort(facets[:, FACET_SIDES][cut], axis=1)
        border = (start + shares[..., None] * (end - start))[cut]
        _, first, of = np.unique(sides, axis=0, return_index=True, return_inverse=True)
        assert border == pytest.approx(border[first][of], abs=1e-12)
        return border

    line = border_of(at[:, 0] - 0.3, 0.0)
    near = (line[:, 1] > -1.0) & (line[:, 1] < 1.0)
    # shares are bounded by 0.02 and 0.98 of edges of some 0.15 mm
    assert line[near, 0] == pytest.approx(0.3, abs=0.01)
    radius = np.linalg.norm(border_of(np.linalg.norm(at, axis=1) - 1.0, 0.3), axis=1)
    assert radius.mean() == pytest.approx(1.0, abs=0.01)
    # independent errors of neighbours fall to sqrt(3/8) of their size in a round
    assert radius.std() < 0.6 * 0.3 / math.sqrt(2.0) * 0.15
