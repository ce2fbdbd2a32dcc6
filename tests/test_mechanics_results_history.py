"""Lengths and areas of zones, read from the contact points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.contact.state import ContactState
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.objects import ObjectPose, Sphere
from tests.models import ended, small_section


def grid(nx: int, nz: int, shift: float = 0.0) -> ContactPoints:
    """A plane of points 1 mm apart, joined along x, along z and along one diagonal; z runs from `shift`."""
    x, z = np.meshgrid(np.arange(nx, dtype=float), np.arange(nz, dtype=float) + shift)
    number = np.arange(nx * nz).reshape(nz, nx)
    a, b, c, e = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    facets = np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, e], axis=1)])
    at = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    return ContactPoints(
        np.arange(x.size), np.zeros(x.size, dtype=np.int8), at, np.ones(x.size), np.eye(3)[[1, 0, 2]], 10.0, 0.75,
        facets, np.ones(x.size),
    )  # fmt: skip


def test_where_no_vertex_lies_on_the_line_its_edges_are_cut() -> None:
    # rows at z = -0.25 and 0.75: edges along z meet z = 0 at x = 0..3, the diagonals a quarter of the way further
    x, nearest = grid(4, 2, shift=-0.25).middle_line()
    np.testing.assert_allclose(np.sort(x), [0.0, 0.25, 1.0, 1.25, 2.0, 2.25, 3.0], atol=1e-12)
    assert set(nearest) <= {0, 1, 2, 3}  # the row at z = -0.25 is the nearer one


def test_points_beside_the_line_do_not_count_to_it() -> None:
    points = grid(4, 3, shift=-1.0)
    x, nearest = points.middle_line()
    np.testing.assert_array_equal(np.sort(x), np.arange(4.0))
    assert (points.points[nearest, 2] == 0.0).all()


@pytest.mark.parametrize(("rows", "resolved"), [(1, 0), (2, 0), (3, 27), (5, 45)])
def test_a_zone_is_resolved_where_it_is_three_points_wide(rows: int, resolved: int) -> None:
    points = grid(9, 9, shift=-4.0)
    middle = 0.5 if rows == 2 else 0.0
    zone = np.abs(points.points[:, 2] - middle) <= 0.5 * (rows - 1)
    assert points.resolved(zone).sum() == resolved
    # along x the zone ends where the points end, which is no rim
    assert points.rim(zone).sum() == 9 * min(rows, 2)


def test_a_length_does_not_depend_on_the_half_that_is_meshed() -> None:
    block = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=8.0)
    model = Model(
        block, Isotropic(1.0, 0.4), MeshOptions(0.8, 2.0, "swept"), (Leg(0.3, steps=2),),
        object=Sphere(radius_mm=6.0), friction=Coulomb(0.25),
    )  # fmt: skip
    lengths = []
    for symmetry in (None, ()):
        problem = build(replace(model, symmetry=symmetry))
        frame = list(march(problem))[-1]
        numbers, at = measure(problem.points, frame), problem.points.points
        line = np.unique(at[at[:, 2] == 0.0, 0])
        last = at[(frame.state.status != OPEN) & (at[:, 2] == 0.0), 0].max()
        assert last < numbers["contact_half_length_mm"] < line[line > last].min()
        lengths.append([numbers["contact_half_length_mm"], numbers["stick_half_length_mm"]])
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)


def test_without_contact_the_force_is_0_and_not_minus_0() -> None:
    points = grid(3, 3)
    n = len(points.points)
    state = ContactState(np.full(n, OPEN), np.zeros((n, 3)), np.zeros(n), np.zeros((n, 2)), np.zeros((n, 2)))
    step = StepResult(
        ObjectPose(0.1), state, state, (0.0, 0.0), np.zeros(3), {}, 0.0, 0.0, Outcome.CONVERGED, 0.0, 1, "newton", 0.0
    )
    assert str(measure(points, step)["normal_force_N"]) == "0.0"


def test_a_point_at_the_lowest_place_of_the_object_is_on_neither_side_of_it() -> None:
    problem, step = ended(small_section(legs=(Leg(0.2, steps=2, slide_x_mm=0.1),)))
    friction = problem.points.friction(step.state.force)[:, 0]
    at, most = problem.points.points[:, 0], int(np.argmax(np.abs(friction)))
    expected = float(friction @ np.sign(at - at[most]))
    for off in (-1e-6, 0.0, 1e-6):  # by as much as a difference of a dimension moves a point
        numbers = measure(problem.points, replace(step, lowest=(at[most] + off, 0.0)))
        assert numbers["outward_friction_x_N"] == pytest.approx(expected, rel=1e-12)
