"""State of a press, and where points that close in an increment touch."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, FrictionLaw, TwoCoefficients
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.results.state import State
from finger3d.objects import Cylinder, Move, ObjectPose
from tests.models import half_cylinder, run


def test_arrays_of_a_state_cannot_be_changed() -> None:
    _, steps = run(half_cylinder(1.0, steps=1))
    with pytest.raises(ValueError, match="read-only"):
        steps[-1].meshed_state.body[0] = 0.0


def test_points_that_close_move_until_they_touch() -> None:
    # the gaps of five points: one closes midway, one early, one late, one recedes, one touches already
    gap = np.array([0.2, 0.1, 0.9, 0.3, 0.0])
    change = np.array([[-0.4, 0.06], [-0.4, -0.06], [-0.4, 0.06], [0.1, 0.06], [-0.1, 0.06]])
    status = np.array([OPEN, OPEN, OPEN, OPEN, SLIP], dtype=np.int8)
    bases = np.broadcast_to(np.array([[0.0, -1.0], [1.0, 0.0]]), (5, 2, 2)).copy()
    contact = ContactState(status, np.zeros((5, 2)), gap, np.zeros((5, 1)), np.zeros((5, 1)), bases)
    last = Move(ObjectPose(0.0), ObjectPose(1.0))
    state = State(contact, None, (last, change))
    same, half = Move(last.end, ObjectPose(2.0)), Move(last.end, ObjectPose(1.5))
    assert state.share_until_touch(same) == pytest.approx([0.5, 0.25, 1.0, 1.0, 0.0])
    assert state.share_until_touch(half) == pytest.approx([0.5, 0.25, 0.5, 0.5, 0.0])
    wanted = np.array([[0.03, 0.2], [-0.015, 0.1], [0.06, 0.4], [0.06, -0.1], [0.0, 0.0]])
    assert state.motion_until_touch(same) == pytest.approx(wanted)
    assert not state.motion_until_touch(Move(last.end, ObjectPose(1.0, slide_x_mm=0.5))).any()
    assert not State(contact, None).motion_until_touch(same).any()


@pytest.mark.parametrize("changes", [{"rule": "paper"}, {"friction": TwoCoefficients(0.25, 0.7, "keep")}])
def test_presses_that_their_increments_define_take_these_as_they_are(
    changes: dict[str, str | FrictionLaw], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = build(replace(half_cylinder(0.5, steps=3), **changes))

    def refused(*arguments: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(State, "motion_until_touch", refused)
    steps = list(march(problem))
    assert len(steps) == 3
    assert all(len(step.parts) == 1 for step in steps)


def test_the_increment_in_which_contact_begins_has_three_parts() -> None:
    _, steps = run(replace(half_cylinder(0.5, steps=4), object=Cylinder(radius_mm=20.0)))
    assert [len(step.parts) for step in steps] == [3, 1, 1, 1]
    depths = [pose.depth_mm / steps[0].target.depth_mm for pose, _ in steps[0].parts]
    assert depths == pytest.approx([1.0 / 16.0, 0.25, 1.0])
    assert steps[0].parts[-1][1] is steps[0].meshed_state
