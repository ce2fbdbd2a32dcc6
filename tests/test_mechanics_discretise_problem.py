"""Discretised presses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import object_share, rigid_gap, scatter_to_points, under_pressure
from finger3d.mechanics.model import Gauge, MeshOptions
from finger3d.objects import ObjectPose, Plane
from tests.contact_cases import random_compliance
from tests.models import block, run

COARSE = MeshOptions(1.5, 1.5, "swept")


def test_forces_on_the_whole_finger_are_those_of_the_part_and_its_images() -> None:
    problem, frames = run(block(mesh=COARSE, gauges=(Gauge("g", 1.0, 1.5),)))
    state = frames[-1].meshed_state.contact
    assert problem.axes == ("x", "z")
    whole = problem.world_force(state)
    # friction of mirror images cancels, pressure adds up
    assert whole.sum(axis=0) == pytest.approx([0.0, 4.0 * state.scene_force[:, 1].sum(), 0.0], abs=1e-12)
    # a reading by its row, and by the field
    force = problem.upright_force(state)
    (row,) = (gauge.rows(problem.meshed_body) for gauge in problem.model.gauges)
    (reading,) = problem.read(force).values()
    assert reading == pytest.approx((row @ problem.unknowns(force)[: row.shape[1]]).item(), rel=1e-9)
    together = list(problem.unknowns_of([force, 2.0 * force, 0.0 * force]))
    assert together[1] == pytest.approx(2.0 * together[0], rel=1e-12, abs=1e-15)
    for one, other in zip(together, problem.unknowns_of([force, 2.0 * force, 0.0 * force], block=1), strict=True):
        assert other == pytest.approx(one, rel=1e-12, abs=1e-15)


def test_a_reduced_problem_has_no_mesh() -> None:
    problem = replace(build(block(mesh=COARSE)), condensed_body=None)
    with pytest.raises(Finger3dError, match="mesh"):
        _ = problem.mesh


def test_what_cannot_touch_has_no_gap() -> None:
    problem = build(block(mesh=COARSE, object=Plane()))
    gap = rigid_gap(problem.placed(ObjectPose(0.2)), problem.surface)
    on_face = problem.surface.points[:, 1] == 3.0
    assert gap[on_face] == pytest.approx(np.full(on_face.sum(), -0.2), abs=1e-9)
    assert np.isinf(gap[~on_face]).all()
    assert problem.gap(ObjectPose(0.2))[on_face] == pytest.approx(gap[on_face])


def test_directions_that_symmetry_holds_are_not_coupled() -> None:
    rows = random_compliance(np.random.default_rng(0), 3, 2).reshape(6, 6)[:5, :5]
    active = np.array([0, 2, 3])
    out = scatter_to_points(rows, active, 2, 2).reshape(4, 4)
    assert np.array_equal(out[np.ix_(active, active)], rows[:3, :3])
    assert np.array_equal(out[1], [0.0, rows[:3, :3].diagonal().max(), 0.0, 0.0])


def test_of_two_equal_bodies_each_has_half_of_the_displacement() -> None:
    problem = build(block(mesh=COARSE, object=Plane()))
    own = under_pressure(problem.surface, problem.delassus)
    assert object_share(own, own) == pytest.approx(np.full(len(own), 0.5))
    assert object_share(own, 0.0 * own) == pytest.approx(np.zeros(len(own)))
    assert object_share(own, 3.0 * own) == pytest.approx(np.full(len(own), 0.75))
