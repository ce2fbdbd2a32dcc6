"""Increments in parts: their energies add up to those of the press, and one begins at the end of a similar one."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.parts import Substep, energies, solved_in_turn
from finger3d.mechanics.march.solve import Press
from finger3d.mechanics.path import stations
from finger3d.objects import Cylinder, Move, ObjectPose
from tests.models import half_cylinder, large_fig9


def test_energies_of_parts_add_up() -> None:
    problem = build(replace(half_cylinder(0.3), object=Cylinder(radius_mm=10.0)))
    press = Press(problem)
    frames = [press.advance(station) for station in stations(problem.model.legs)]
    ends = [(press.formulation.start(problem), problem.origin)]
    ends += [(state, pose) for frame in frames for pose, state in frame.parts]
    parts = [Substep(a, b, Move(one, other)) for (a, one), (b, other) in pairwise((s, p) for s, p in ends)]
    work, lost = energies(problem, parts)
    assert work == pytest.approx(frames[-1].external_work_mJ, rel=1e-12)
    assert lost == pytest.approx(frames[-1].dissipation_mJ, rel=1e-12)
    assert energies(problem, []) == (0, 0)


def test_an_increment_begins_at_the_end_of_a_similar_one() -> None:
    problem = build(large_fig9(0.45, 4.0))
    press = Press(problem)
    moves = press.moves_to(ObjectPose(4.0))
    first, parts = solved_in_turn(problem, press.workspace, press.state, moves, 6)
    assert len(parts) == len(moves) == 3
    again, _ = solved_in_turn(problem, press.workspace, press.state, moves, 6, near=parts)
    assert first.outcome.ok
    assert again.outcome.ok
    # one contact solution an iteration: those that remain bring down errors of 5e-9 with the tangent of another part
    assert again.iterations < 0.5 * first.iterations
    assert np.allclose(again.state.body.unknowns, first.state.body.unknowns, atol=1e-7)
