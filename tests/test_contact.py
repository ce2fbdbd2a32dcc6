"""Contact conditions, laws, stick rules and zones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial import Delaunay

from finger3d.contact.conditions import (
    ContactProblem,
    project_on_friction_cone,
    residual,
)
from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb, FrictionLaw, TwoCoefficients
from finger3d.contact.newton import ActiveSet, assemble
from finger3d.contact.solve import RULES, RuleName, maeno_active_set, solve_increment
from finger3d.contact.state import ContactState
from finger3d.contact.zones import FACET_SIDES, Zone, facet_borders, zone_area, zone_ends, zones
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Cylinder, Sphere
from tests.contact_cases import half_plane, problem_of, random_compliance, random_problem, violation


@pytest.mark.parametrize("dim", [2, 3])
def test_projected_forces_are_admissible_and_projected_on_themselves(dim: int) -> None:
    for seed in range(10):
        problem, force = random_problem(dim, seed)
        projected, status, _ = project_on_friction_cone(problem, force, problem.relative_displacement(force))
        normal, friction = projected[:, 0], np.linalg.norm(projected[:, 1:], axis=1)
        assert (normal >= 0.0).all()
        assert (friction <= problem.friction * normal * (1.0 + 1e-12)).all()
        assert (projected[status == OPEN] == 0.0).all()
        assert np.allclose(friction[status == SLIP], (problem.friction * normal)[status == SLIP])
        again, _, _ = project_on_friction_cone(problem, projected, np.zeros_like(projected))
        assert np.allclose(again, projected, rtol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_matrix_of_an_active_set_has_the_columns_that_unit_unknowns_give(dim: int) -> None:
    # A = D W P + diag(0, 0, 1 - a), column by column from the functions P and D
    for seed in range(5):
        problem, force = random_problem(dim, seed)
        status = np.resize(np.array([STICK, SLIP, OPEN], dtype=np.int8), len(force))
        active = ActiveSet.of(problem, status, np.abs(force))
        wanted = np.diag(np.concatenate([np.zeros(len(active.active_dofs)), 1.0 - active.turning]))
        wanted = wanted[: active.size, : active.size]
        for k, unit in enumerate(np.eye(active.size)):
            moved = (problem.delassus @ active.force(unit).ravel()).reshape(force.shape)
            wanted[:, k] += active.weighted(problem, moved)
        np.testing.assert_allclose(assemble(problem, active, np.float64), wanted, rtol=1e-12, atol=1e-12)


def test_the_projection_and_the_residual_know_the_same_solutions() -> None:
    compliance, gap = half_plane(21, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 21) ** 2
    free = np.column_stack([gap - 0.3, np.full(21, -0.01)])
    state = ContactState.at_rest(gap, 2)
    found = solve_increment(problem_of(compliance, free, 0.3, state=state)).state
    moved = np.column_stack([found.gap, found.tangential_displacement])
    mu = np.full(21, 0.3)
    assert set(found.status) == {OPEN, STICK, SLIP}
    assert residual(found.force, moved, found.status, mu, 1.0) < 1e-8
    # each condition is measured in its own unit
    i, j = np.flatnonzero(found.status == STICK)[0], np.flatnonzero(found.status == SLIP)[0]
    largest = np.linalg.norm(found.force, axis=1).max()
    deeper = moved - [[0.02, 0.0]] * (found.status != OPEN)[:, None]
    assert residual(found.force, deeper, found.status, mu, 2.0) == pytest.approx(0.01, rel=1e-6)
    slid = moved + 0.03 * np.outer(np.arange(21) == i, [0.0, 1.0])
    assert residual(found.force, slid, found.status, mu, 1.0) == pytest.approx(0.03, rel=1e-6)
    harder = found.force + 0.1 * largest * np.outer(np.arange(21) == j, [0.0, np.sign(found.force[j, 1])])
    assert residual(harder, moved, found.status, mu, 1.0) == pytest.approx(0.1, rel=0.1)
    assert residual(found.force * np.nan, moved, found.status, mu, 1.0) == np.inf


@dataclass(frozen=True)
class Saturating(FrictionLaw):
    """mu(p) = mu / (1 + p / p0): the shear strength of the interface limits friction at high pressure."""

    p0_MPa: float

    def coefficients(self, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        return self.mu / (1.0 + np.maximum(pressure, 0.0) / self.p0_MPa)

    def updated(self, mu: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        return self.coefficients(status, pressure)


def test_a_point_slips_at_the_coefficient_of_its_own_pressure() -> None:
    compliance = np.eye(2).reshape(1, 2, 1, 2)  # one point on two unit springs, 1 N on 0.5 mm2
    free = np.array([[-1.0, -0.6]])
    state = ContactState.at_rest(np.zeros(1), 2)
    found = solve_increment(ContactProblem.of(state, free, compliance, Saturating(0.9, 2.0), 1.0, area=np.array([0.5])))
    assert found.outcome.ok
    assert found.state.status[0] == SLIP
    assert found.state.force[0] == pytest.approx([1.0, 0.9 / (1.0 + 2.0 / 2.0)], abs=1e-12)


def test_pressure_dependent_coefficients_agree_with_the_pressures_found() -> None:
    compliance, gap, area = half_plane(41, 2, 0.2857, 0.05), np.linspace(-1.0, 1.0, 41) ** 2, np.full(41, 0.05)
    law, state = Saturating(0.8, 0.3), ContactState.at_rest(gap, 2)
    for depth, slide in ((0.2, 0.0), (0.4, 0.0), (0.4, 0.05), (0.4, 0.5)):
        free = np.column_stack([gap - depth, np.full(41, -slide)])
        found = solve_increment(ContactProblem.of(state, free, compliance, law, 1.0, area=area))
        assert found.outcome.ok
        mu = law.coefficients(found.state.status, found.state.force[:, 0] / area)
        assert np.ptp(mu[found.state.force[:, 0] > 0.0]) > 0.1
        assert violation(state, found.state, free, compliance, mu) <= 1e-8
        state = found.state
    assert (state.status == SLIP).any()


def test_coefficients_that_never_agree_are_reported() -> None:
    class Alternating(Coulomb):
        def updated(self, mu: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
            return 0.7 - mu

    state = ContactState.at_rest(np.zeros(1), 2)
    found = solve_increment(
        ContactProblem.of(state, np.array([[-1.0, -0.6]]), np.eye(2).reshape(1, 2, 1, 2), Alternating(0.3), 1.0)
    )
    assert found.outcome is Outcome.NO_CONVERGENCE
    assert found.state is state


def test_only_starting_all_stuck_depends_on_the_steps() -> None:
    assert TwoCoefficients(0.3, 0.5, "paper").depends_on_steps
    assert not TwoCoefficients(0.3, 0.5, "keep").depends_on_steps
    assert not Coulomb(0.3).depends_on_steps
    keep, paper = (TwoCoefficients(0.4, 0.5, b) for b in ("keep", "paper"))
    status, pressure = np.array([SLIP, STICK], dtype=np.int8), np.ones(2)
    assert keep.coefficients(status, pressure) == pytest.approx([0.2, 0.4])
    assert paper.coefficients(status, pressure) == pytest.approx([0.4, 0.4])


@pytest.mark.parametrize("name", RULES)
def test_every_rule_settles_a_normal_press(name: RuleName) -> None:
    gap = np.linspace(-1.0, 1.0, 21) ** 2
    free = np.column_stack([gap - 0.3, np.zeros(21)])
    found = RULES[name](problem_of(half_plane(21, 2, 0.0), free, 0.3, state=ContactState.at_rest(gap, 2)))
    assert found.outcome.ok


def test_where_it_settles_it_agrees_with_the_projection() -> None:
    compliance, gap = half_plane(21, 2, 0.2), np.linspace(-1, 1, 21) ** 2
    a = b = ContactState.at_rest(gap, 2)
    for depth in np.linspace(0.05, 0.5, 10):
        free = np.column_stack([gap - depth, np.zeros(21)])
        literal = maeno_active_set(problem_of(compliance, free, 0.25, depth, state=a))
        assert literal.outcome is Outcome.CONVERGED
        assert literal.method == "paper"
        a, b = (
            literal.state,
            solve_increment(problem_of(compliance, free, 0.25, depth, state=b)).state,
        )
        assert np.array_equal(a.status, b.status)
        assert np.abs(a.force - b.force).max() < 1e-12


def test_a_cycle_is_reported_and_never_called_converged() -> None:
    rng = np.random.default_rng(3)
    outcomes = set()
    for _ in range(200):
        compliance = random_compliance(rng, 6, 2)
        state = ContactState.at_rest(np.zeros(6), 2)
        for _ in range(3):
            free = rng.normal(size=(6, 2))
            found = maeno_active_set(problem_of(compliance, free, 0.8, state=state))
            outcomes.add(found.outcome)
            if not found.outcome.ok:
                assert found.residual > 1e-8
                break
            assert violation(state, found.state, free, compliance, 0.8) <= 1e-8
            state = found.state
    assert outcomes == {Outcome.CONVERGED, Outcome.CYCLED, Outcome.WRONG_WAY}


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


@pytest.mark.parametrize("shift", np.linspace(0.0, 0.9, 3))
def test_ends_are_known_better_than_the_points(shift: float) -> None:
    x = np.arange(-12.0, 12.0) + shift
    contact, stick = half_extents(x, cattaneo(x, 8.3, 5.1))
    # samples are exact: what is added for means over hat functions, 0.15 of a spacing at most, stays
    assert -0.02 <= contact - 8.3 <= 0.17
    # exact but for the mean with the middle between the points, a quarter of their distance, and as much again
    assert stick == pytest.approx(5.1, abs=0.31)


@pytest.mark.parametrize("size", [0.11, 0.057])
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
