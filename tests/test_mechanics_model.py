"""Models, their paths and formulations."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.foils import EmbeddedBars
from finger3d.mechanics.formulation import Loads, length_scale
from finger3d.mechanics.model import Gauge, Leg, MeshOptions
from finger3d.mechanics.path import ending_at, targets
from finger3d.mechanics.readings import Marker, Taxel
from finger3d.objects import Move, ObjectPose
from tests.models import block


def test_a_path_has_poses_at_the_quarters_of_every_leg() -> None:
    path = block(legs=(Leg(0.4), Leg(0.4, 1.0, duration_s=2.0))).contact_path
    assert [pose.depth_mm for pose in path.poses] == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.4, 0.4, 0.4, 0.4])
    assert [pose.slide_x_mm for pose in path.poses] == pytest.approx([0.0] * 4 + [0.25, 0.5, 0.75, 1.0])
    assert (path.half_length_mm, path.half_width_mm) == (4.0, 2.0)
    assert block(domain="plane-strain").contact_path.half_width_mm == 0.0


def test_forces_scale_with_the_modulus_unless_another_stiffness_or_a_force_is_given() -> None:
    assert block().forces_scale_with_modulus
    assert not block(legs=(Leg(0.3, force_N=1.0),)).forces_scale_with_modulus
    assert not ElasticObject(10.0, 0.3).apply(block()).forces_scale_with_modulus


def test_readings_are_named_in_the_order_of_their_rows() -> None:
    model = block(
        markers=(Marker("m", 1.0, 1.0),), taxels=(Taxel("t", 0.0, 0.0, 1.0, 1.0),), gauges=(Gauge("g", 0.0, 1.0),)
    )
    assert [column.name for column in model.columns] == ["m.x", "m.y", "m.z", "t", "g"]
    assert [reading.name for reading in model.readings] == ["m", "t", "g"]


def test_bars_are_strained_along_their_directions_and_lack_what_the_mesh_cannot_resolve() -> None:
    directions = np.array([[1.0, 0.0], [0.6, 0.8]])
    ends = np.array([[-1.0, 1.0, 0.0], [-0.5, 0.0, 0.5]])  # of three nodes; the second bar is 2 mm long
    bars = EmbeddedBars(
        directions, sp.kron(sp.csr_matrix(ends), np.eye(2), format="csr"), np.ones(2), np.array([[0.5, 0.5]]),
        2.0 * np.eye(2),
    )  # fmt: skip
    u = np.array([[0.0, 0.0], [0.3, 7.0], [0.4, 0.2]])
    assert bars.rows @ u.ravel() == pytest.approx([0.3, 0.5 * (0.6 * 0.4 + 0.8 * 0.2)])
    assert bars.in_mesh(0.5 * np.eye(2)).subgrid_compliance == pytest.approx(
        1.5 * np.array([[0.5, 0.5, 0.5], [0.5, 1.0, 0.0], [0.5, 0.0, 1.0]])
    )


def test_targets_pass_through_every_leg() -> None:
    path = targets((Leg(1.0, steps=2), Leg(1.0, slide_x_mm=3.0, steps=3)))
    assert [(t.depth_mm, t.slide_x_mm) for t in path] == [(0.5, 0), (1, 0), (1, 1), (1, 2), (1, 3)]


def test_time_runs_through_legs_with_a_duration() -> None:
    path = targets((Leg(1.0, steps=2, duration_s=4.0), Leg(1.0, steps=1), Leg(0.0, steps=2, duration_s=1.0)))
    assert [t.time_s for t in path] == [2.0, 4.0, 4.0, 4.5, 5.0]


def test_a_pose_between_two_is_linear_in_all_coordinates() -> None:
    assert Move(ObjectPose(0.0, 1.0), ObjectPose(4.0, 3.0, 8.0, 2.0)).at(0.25) == ObjectPose(1.0, 1.5, 2.0, 0.5)


def test_the_ratio_of_lengths_is_none_where_the_path_turns() -> None:
    first = Move(ObjectPose(0.0), ObjectPose(1.0, 2.0))
    assert Move(first.end, ObjectPose(1.5, 3.0)).length_ratio(first) == pytest.approx(0.5)
    assert Move(first.end, ObjectPose(1.0, 3.0)).length_ratio(first) is None
    assert Move(first.end, ObjectPose(0.5, 1.0)).length_ratio(first) is None


def test_legs_are_cut_where_a_coordinate_has_given_values() -> None:
    """Every cut is a station, increments are no longer than before, and legs with a force are kept."""
    legs = (Leg(2.0, steps=4, duration_s=1.0), Leg(2.0, slide_x_mm=3.0, steps=3), Leg(3.0, force_N=5.0, steps=2))
    cut = ending_at(legs, "depth_mm", np.array([0.3, 1.0, 2.0, 2.5]))
    assert [leg.depth_mm for leg in cut] == pytest.approx([0.3, 1.0, 2.0, 2.0, 3.0])
    assert [leg.steps for leg in cut] == [1, 2, 2, 3, 2]
    assert [leg.duration_s for leg in cut[:3]] == pytest.approx([0.15, 0.35, 0.5])
    assert cut[3:] == legs[1:]
    slid = ending_at(legs, "slide_x_mm", np.array([1.5]))
    assert [(leg.depth_mm, leg.slide_x_mm, leg.steps) for leg in slid[1:3]] == [(2.0, 1.5, 2), (2.0, 3.0, 2)]
    assert slid[0] == legs[0]


def test_the_moment_of_a_couple_is_force_times_arm_in_section_and_solid() -> None:
    places, forces = np.array([[1.0, 3.0], [-1.0, 3.0]]), np.array([[0.0, 2.0], [0.0, -2.0]])
    assert Loads(places, 0.0 * places, forces).moment == pytest.approx([0.0, 0.0, 4.0])
    solid = [np.column_stack([v, [5.0, 5.0]]) for v in (places, 0.0 * forces)]
    solid[1][:, 2] = [1.0, 1.0]
    # two forces of 1 N along z at y = 3
    assert Loads(solid[0], 0.0 * solid[0], solid[1]).moment == pytest.approx([6.0, 0.0, 0.0])


def test_gaps_are_measured_by_the_depth_and_by_the_deepest_leg_without_one() -> None:
    legs = (Leg(0.4, steps=1), Leg(0.1, steps=1), Leg(0.0, steps=1))
    problem = build(block(mesh=MeshOptions(2.0, 2.0, "swept"), legs=legs))
    assert length_scale(problem, Move(ObjectPose(0.1), ObjectPose(0.2))) == 0.2
    assert length_scale(problem, Move(ObjectPose(0.0), ObjectPose(0.0))) == 0.4
    assert length_scale(problem, Move(ObjectPose(0.1), ObjectPose(0.1, turn_z=0.1))) == 0.4
