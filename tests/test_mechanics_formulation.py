"""What all formulations share: moments and the scale of gaps."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulation import Loads, length_scale
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Move, ObjectPose
from tests.models import block


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
