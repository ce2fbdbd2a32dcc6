"""Path of the object: poses at the end of every increment."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.model import Leg
from finger3d.mechanics.path import AUTO_START, ending_at, targets
from finger3d.objects import Move, ObjectPose


def test_targets_pass_through_every_leg() -> None:
    path = targets((Leg(1.0, steps=2), Leg(1.0, slide_x_mm=3.0, steps=3)))
    assert [(t.depth_mm, t.slide_x_mm) for t in path] == [(0.5, 0), (1, 0), (1, 1), (1, 2), (1, 3)]


def test_time_runs_through_legs_with_a_duration() -> None:
    path = targets((Leg(1.0, steps=2, duration_s=4.0), Leg(1.0, steps=1), Leg(0.0, steps=2, duration_s=1.0)))
    assert [t.time_s for t in path] == [2.0, 4.0, 4.0, 4.5, 5.0]


def test_automatic_legs_begin_with_a_fixed_number() -> None:
    assert len(targets((Leg(1.0, steps="auto"),))) == AUTO_START


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
